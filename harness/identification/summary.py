"""An identification in lines of text."""

import math
from collections.abc import Iterator

from harness.identification.identify import Identification
from harness.plants.response import Response

BOUND = 0.05  # of the command, RMS: a held-out manoeuvre followed worse is named

_SHOWN_RAD_S = (0.3, 1.0, 3.0, 10.0)


def summary_lines(found: Identification) -> Iterator[str]:
    """What was flown, what was fitted, and how well the one follows the other."""
    known = found.identified
    yield f"{found.airframe.name} at {known.airspeed:g} m/s"
    yield ""
    yield "heading rate (psi_a) after a step of its command, and 10 s later"
    yield "  step deg/s  lag s (63 %)  overshoot %   gain  turn ratio  bank deg"
    for step in found.steps:
        yield (
            f"  {math.degrees(step.amplitude):10.3g}{step.lag:14.3f}{100 * step.overshoot:13.1f}{step.gain:7.3f}"
            f"{step.turn_ratio:12.3f}{math.degrees(step.bank):10.1f}"
        )
    yield ""
    yield "heading rate over its command, swept from 0.05 to 20 rad/s: gain at phase in deg"
    yield "  rms deg/s  bandwidth rad/s" + "".join(f"{f'at {omega:g} rad/s':>16}" for omega in _SHOWN_RAD_S)
    for sweep in found.sweeps.values():
        points = (sweep.at(omega) for omega in _SHOWN_RAD_S)
        shown = "".join(f"{f'{gain:.3f} at {math.degrees(phase):4.0f}':>16}" for gain, phase in points)
        yield f"  {math.degrees(sweep.rms):9.3g}{sweep.bandwidth:17.2f}{shown}"
    yield ""
    yield f"fitted: heading rate from its command  {_response(known.heading_rate)}"
    yield f"        bank from its command          {_response(known.bank)}"
    hold = known.hold
    yield (
        f"        airspeed from the load factor  {hold.gain:.3g} m/s2, {hold.frequency:.3g} rad/s, damping "
        f"{hold.damping:.3g}: {found.airspeed_error[0]:.4f} m/s rms from the flown in a turn that moves it by "
        f"{found.airspeed_error[1]:.4f}"
    )
    yield ""
    yield "not used in the fit: heading rate of the plant less the flown, rms in % of the command's"
    yield f"  {'':52}lagged  coordinated"
    for name, (lagged, coordinated) in known.errors.items():
        yield f"  {name:52}{100 * lagged:6.1f}{100 * coordinated:13.1f}"
    for i, plant in enumerate(("lagged", "coordinated")):
        beyond = [name for name, errors in known.errors.items() if errors[i] > BOUND]
        if beyond:
            yield (
                f"{plant} is farther than {100 * BOUND:g} % from the flown in {len(beyond)} of {len(known.errors)}: "
                f"{'; '.join(beyond)}"
            )


def _response(r: Response) -> str:
    return (
        f"delay {r.delay:.3f} s, {r.frequency:.3g} rad/s damping {r.damping:.2f} lead {r.lead:.3f} s, sideslip "
        f"{r.sideslip_frequency:.3g} rad/s damping {r.sideslip_damping:.2f} with zeros {r.zero_frequency:.3g} rad/s "
        f"damping {r.zero_damping:.2f}, {100 * r.tail_share:.1f} % at {r.tail_rate:.2f} 1/s"
    )
