"""The step and the Bode plot of an identification: flown against fitted, as SVG."""

import math

import numpy as np
from matplotlib.figure import Figure

from harness.drawing import draw
from harness.identification.fit import followed
from harness.identification.identify import Identification
from harness.identification.manoeuvres import FASTEST, SLOWEST, STEP, held, lines

_SHOWN = 3.0  # s, of the steps
_COLOURS = ("#9ecae1", "#6baed6", "#3182bd", "#08519c", "#08306b")
_FITTED = "#c03030"


def step_plot(found: Identification) -> str:
    """The flown steps and the fitted one, relative to the command; the beginning and the whole."""

    def paint(figure: Figure) -> None:
        for axes, shown in zip(
            figure.subplots(1, 2, sharey=True), (_SHOWN, STEP * len(found.steps[0].rate)), strict=True
        ):
            count = round(shown / STEP)
            time = STEP * (np.arange(count) + 0.5)
            for step, colour in zip(found.steps, _COLOURS, strict=True):
                axes.plot(
                    time, step.rate[:count], color=colour, lw=1, label=f"flown, {math.degrees(step.amplitude):g} °/s"
                )
            fitted = followed(found.identified.heading_rate, held([1.0], shown)) / math.radians(1.0)
            axes.plot(time, fitted, "--", color=_FITTED, lw=1.2, label="lagged")
            axes.set(xlabel="time, s", xlim=(0.0, shown))
        figure.axes[0].set(ylabel="heading rate / command")
        figure.axes[1].legend(loc="lower right")
        figure.suptitle(f"{found.airframe.name} at {found.identified.airspeed:g} m/s: steps of heading rate")

    return draw(paint)


def bode_plot(found: Identification) -> str:
    """Gain and phase of the flown sweeps, and of the fitted response."""

    def paint(figure: Figure) -> None:
        gain, phase = figure.subplots(2, 1, sharex=True)
        for (name, sweep), colour in zip(found.sweeps.items(), _COLOURS[1::2] + _COLOURS[-1:], strict=False):
            label = f"flown, {math.degrees(sweep.rms):g} °/s rms ({name})"
            gain.loglog(lines(), np.abs(sweep.ratio), ".", color=colour, ms=4, label=label)
            phase.semilogx(lines(), np.degrees(np.unwrap(np.angle(sweep.ratio))), ".", color=colour, ms=4)
        omega = np.geomspace(SLOWEST, FASTEST, 400)
        fitted = found.identified.heading_rate.at(omega)
        gain.loglog(omega, np.abs(fitted), color=_FITTED, lw=1, label="lagged")
        phase.semilogx(omega, np.degrees(np.unwrap(np.angle(fitted))), color=_FITTED, lw=1)
        gain.axhline(math.sqrt(0.5), color="0.6", lw=0.6)
        gain.set(ylabel="gain", ylim=(0.01, 2.0))
        phase.set(ylabel="phase, deg", xlabel="frequency, rad/s")
        gain.legend(loc="lower left")
        figure.suptitle(f"{found.airframe.name} at {found.identified.airspeed:g} m/s: heading rate over its command")

    return draw(paint, height=5.0)
