"""An identification in lines of text."""

import math
from collections.abc import Iterator

from autopilot.response import Response
from harness.identification.identify import Identification
from harness.identification.manoeuvres import STEP
from harness.tables import table

BOUND = 0.05  # rms error over the command, above which manoeuvres are listed

_POINTS_RAD_S = (0.3, 1.0, 3.0, 10.0)


def summary_lines(identification: Identification) -> Iterator[str]:
    """The manoeuvres, the fit, and its errors."""
    fitted = identification.identified
    yield f"{identification.airframe.name} at {fitted.airspeed:g} m/s"
    yield ""
    length = STEP * len(identification.steps[0].rate)
    yield f"Step response of the heading rate (psi_a); gain and later columns are taken {length:g} s after the step:"
    yield from table(
        ["step\ndeg/s", "lag (63 %)\ns", "overshoot\n%", "gain", "turn ratio", "bank\ndeg"],
        (
            [
                f"{math.degrees(step.amplitude):.3g}",
                f"{step.lag:.3f}",
                f"{100 * step.overshoot:.1f}",
                f"{step.gain:.3f}",
                f"{step.turn_ratio:.3f}",
                f"{math.degrees(step.bank):.1f}",
            ]
            for step in identification.steps
        ),
        "r",
    )
    yield ""
    yield "Frequency response of the heading rate to its command, from sweeps over 0.05 to 20 rad/s, gain and phase:"
    yield from table(
        ["command rms\ndeg/s", "bandwidth\nrad/s", *(f"at {omega:g}\nrad/s" for omega in _POINTS_RAD_S)],
        (
            [f"{math.degrees(sweep.rms):.3g}", f"{sweep.bandwidth:.2f}"]
            + [f"{gain:.3f}, {math.degrees(phase):.0f} deg" for gain, phase in map(sweep.at, _POINTS_RAD_S)]
            for sweep in identification.sweeps.values()
        ),
        "r",
    )
    yield ""
    yield "Fit:"
    hold = fitted.hold
    error, excursion = identification.airspeed_error
    yield from table(
        [],
        [
            ["  heading rate from its command", _response(fitted.heading_rate)],
            ["  bank from its command", _response(fitted.bank) if fitted.bank else ""],
            [
                "  airspeed from the load factor",
                f"gain {hold.gain:.3g} m/s2, {hold.frequency:.3g} rad/s, damping {hold.damping:.3g}",
            ],
        ],
    )
    yield f"Error of the airspeed in a turn: {error:.4f} m/s rms, where the airspeed changes by {excursion:.4f} m/s."
    yield ""
    yield "Error of the heading rate on manoeuvres that the fit did not use, rms, in % of the command's rms:"
    yield from table(
        ["manoeuvre", "lagged", "coordinated"],
        (
            [name, f"{100 * lagged:.1f}", f"{100 * coordinated:.1f}"]
            for name, (lagged, coordinated) in fitted.errors.items()
        ),
        "lr",
    )
    for i, plant in enumerate(("lagged", "coordinated")):
        beyond = [name for name, errors in fitted.errors.items() if errors[i] > BOUND]
        if beyond:
            of = f"{len(beyond)} of {len(fitted.errors)}"
            yield f"The error of {plant} exceeds {100 * BOUND:g} % in {of} manoeuvres: {'; '.join(beyond)}."


def _response(r: Response) -> str:
    return (
        f"delay {r.delay:.3f} s; mode {r.frequency:.3g} rad/s, damping {r.damping:.2f}, lead {r.lead:.3f} s; sideslip "
        f"{r.sideslip_frequency:.3g} rad/s, damping {r.sideslip_damping:.2f}, zeros {r.zero_frequency:.3g} rad/s, "
        f"damping {r.zero_damping:.2f}; slow mode {100 * r.tail_share:.1f} % at {r.tail_rate:.2f} 1/s"
    )
