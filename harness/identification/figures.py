"""Figures of an identification, as SVG: step responses and Bode plot, flown and fitted."""

import math

import numpy as np
from matplotlib.figure import Figure

from harness.drawing import draw
from harness.identification.fit import followed
from harness.identification.identify import Identification
from harness.identification.manoeuvres import FASTEST, SLOWEST, STEP, held, lines

_CLOSE_UP = 3.0  # s, from the start of the steps
_COLOURS = ("#9ecae1", "#6baed6", "#3182bd", "#08519c", "#08306b")
_FITTED = "#c03030"


def step_plot(identification: Identification) -> str:
    """The flown step responses and the fitted one, relative to the command: the beginning and the whole."""

    def paint(figure: Figure) -> None:
        for axes, length in zip(
            figure.subplots(1, 2, sharey=True), (_CLOSE_UP, STEP * len(identification.steps[0].rate)), strict=True
        ):
            count = round(length / STEP)
            time = STEP * (np.arange(count) + 0.5)
            for step, colour in zip(identification.steps, _COLOURS, strict=True):
                axes.plot(
                    time, step.rate[:count], color=colour, lw=1, label=f"flown, {math.degrees(step.amplitude):g} °/s"
                )
            fitted = followed(identification.identified.heading_rate, held([1.0], length)) / math.radians(1.0)
            axes.plot(time, fitted, "--", color=_FITTED, lw=1.2, label="lagged")
            axes.set(xlabel="time, s", xlim=(0.0, length))
        figure.axes[0].set(ylabel="heading rate / command")
        figure.axes[1].legend(loc="lower right")
        figure.suptitle(
            f"{identification.airframe.name} at {identification.identified.airspeed:g} m/s: steps of heading rate"
        )

    return draw(paint)


def bode_plot(identification: Identification) -> str:
    """Gain and phase of the heading rate over its command: the flown sweeps and the fitted response."""

    def paint(figure: Figure) -> None:
        gain, phase = figure.subplots(2, 1, sharex=True)
        for (name, sweep), colour in zip(identification.sweeps.items(), _COLOURS[1::2] + _COLOURS[-1:], strict=False):
            label = f"flown, {math.degrees(sweep.rms):g} °/s rms ({name})"
            gain.loglog(lines(), np.abs(sweep.ratio), ".", color=colour, ms=4, label=label)
            phase.semilogx(lines(), np.degrees(np.unwrap(np.angle(sweep.ratio))), ".", color=colour, ms=4)
        omega = np.geomspace(SLOWEST, FASTEST, 400)
        fitted = identification.identified.heading_rate.at(omega)
        gain.loglog(omega, np.abs(fitted), color=_FITTED, lw=1, label="lagged")
        phase.semilogx(omega, np.degrees(np.unwrap(np.angle(fitted))), color=_FITTED, lw=1)
        gain.axhline(math.sqrt(0.5), color="0.6", lw=0.6)
        gain.set(ylabel="gain", ylim=(0.01, 2.0))
        phase.set(ylabel="phase, deg", xlabel="frequency, rad/s")
        gain.legend(loc="lower left")
        at = f"{identification.airframe.name} at {identification.identified.airspeed:g} m/s"
        figure.suptitle(f"{at}: heading rate over its command")

    return draw(paint, height=5.0)
