"""All that is predicted of a flight's loop, as one value: for the command `harness predict`, and for Python."""

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from math import degrees, isfinite

import aircraft
from autopilot.nftsm import Nftsm
from autopilot.response import critical_gain
from harness.flight import Flight
from harness.limit_cycle.march import MOST, UnsettledError, settled
from harness.limit_cycle.margin import ENOUGH, Following, following
from harness.limit_cycle.predicted import unforeseen
from harness.limit_cycle.prediction import LawFailed, Loop, boundary
from harness.plants.identified import identified
from harness.tables import number

_NEAR = 1.15  # times a border: the loop is tried so far on either side of it


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopReport:
    """What is predicted of a law behind the inner loop of an airframe. SI, rad; None where unknown."""

    aircraft: str
    airspeed: float
    period: float  # s, for which a command is held
    bandwidth: float  # rad/s, of the inner loop
    low_frequency_delay: float  # s, of the inner loop
    holds_circle: bool  # whether the heading-rate limit allows the heading rate of the circle
    critical_gain: float  # 1/s from heading error to command, at which the loop becomes unstable
    following: Following
    left_out: str  # the active error that the prediction does not model, in a sentence; empty where there is none
    least_bandwidth: float | None = None  # rad/s, at these gains without a limit cycle; for NFTSM
    most_gains: tuple[float, float] | None = None  # k2 and k3, 1/s, without a limit cycle; for NFTSM


def report(flight: Flight) -> LoopReport:
    """What is predicted of a flight. Raises `IdentifiedError`."""
    airspeed = flight.start.airspeed
    response = identified(aircraft.folder(flight.aircraft), airspeed).heading_rate
    loop = Loop(flight.law, response, airspeed, flight.guidance_period)
    found = LoopReport(
        aircraft=flight.aircraft,
        airspeed=airspeed,
        period=loop.period,
        bandwidth=response.bandwidth,
        low_frequency_delay=response.lag,
        holds_circle=loop.holds_circle,
        critical_gain=critical_gain(response, loop.period)[0],
        following=following(flight),
        left_out=unforeseen(flight),
    )
    law = loop.law
    if type(law) is not Nftsm or not loop.holds_circle:
        return found
    faster = _border(lambda q: replace(loop, response=response.quicker(q)), 4.0)
    gains = _border(lambda q: replace(loop, law=replace(law, k2=q * law.k2, k3=q * law.k3)), 0.3)
    return replace(
        found,
        least_bandwidth=faster and faster * response.bandwidth,
        most_gains=(gains * law.k2, gains * law.k3) if gains else None,
    )


def _border(loop_at: Callable[[float], Loop], guess: float) -> float | None:
    """The q at which the limit cycle begins or ends; None where none is found, or the loop does not bear it out."""
    try:
        q = boundary(loop_at, guess)
        is_border = isfinite(q) and settled(loop_at(q / _NEAR)).rests != settled(loop_at(q * _NEAR)).rests
    except (UnsettledError, LawFailed):
        return None
    return q if is_border else None


def rows(found: LoopReport) -> Iterator[tuple[str, str]]:
    """The report as a table of two columns, in the units of a terminal."""
    loop = found.following
    yield "limit cycle", _verdict(loop)
    if cycle := loop.cycle:
        known = cycle.is_known
        yield "  frequency", f"{cycle.frequency:.3g} Hz" if known else "not found"
        yield "  heading rate", f"±{degrees(cycle.heading_rate):.3g} deg/s" if known else "not found"
        if known:
            yield "  command", f"±{degrees(cycle.command):.3g} deg/s"
            yield "  range error", f"{cycle.range_mean:.3g} ±{cycle.range_error:.3g} m"
    yield "gain margin", _margin(loop.margin)
    yield "gain crossover", "unknown" if loop.crossover is None else f"{loop.crossover:.3g} rad/s"
    yield "phase margin", "unknown" if loop.phase_margin is None else f"{degrees(loop.phase_margin):.0f} deg"
    yield "low-frequency delay", f"{found.low_frequency_delay:.3g} s"
    if loop.crossover_delay is not None:
        yield "delay at crossover", f"{loop.crossover_delay:.3g} s"
        yield "gain at crossover", f"{number(loop.crossover_gain)} (heading rate over its command)"
    yield "inner-loop bandwidth", f"{found.bandwidth:.3g} rad/s"
    yield "critical gain", f"{found.critical_gain:.3g} 1/s (from heading error to command)"


def sentences(found: LoopReport) -> Iterator[str]:
    """What would avoid the limit cycle, or begin it."""
    if found.least_bandwidth is not None:
        bandwidth, times = found.least_bandwidth, found.least_bandwidth / found.bandwidth
        if found.following.chatters:
            yield (
                f"to avoid it at these gains the inner-loop bandwidth must be at least {bandwidth:.3g} rad/s "
                f"({times:.3g} times)"
            )
        else:
            yield f"a limit cycle begins if the bandwidth falls below {bandwidth:.3g} rad/s ({times:.3g} times)"
    if found.most_gains is not None:
        k2, k3 = found.most_gains
        yield f"no limit cycle up to k2 = {k2:.3g}, k3 = {k3:.3g} 1/s"


def document(found: LoopReport) -> dict[str, object]:
    """The report for JSON: SI, rad; null where unknown, or infinite."""
    told = asdict(found)
    loop = told.pop("following")
    cycle = found.following.cycle
    loop["cycle"] = {name: _finite(value) for name, value in cycle._asdict().items()} if cycle else None
    return {"limit_cycle": _word(found.following)} | {name: _finite(value) for name, value in (told | loop).items()}


def _verdict(loop: Following) -> str:
    return f"unknown: {loop.reason}" if loop.chatters is None else _word(loop)


def _word(loop: Following) -> str:
    return "unknown" if loop.chatters is None else "predicted" if loop.chatters else "none"


def _margin(margin: float | None) -> str:
    if margin is None:
        return "unknown"
    return f"{margin:.3g} (recommended: at least {ENOUGH:g})" if margin else f"below {1.0 / MOST:g}"


def _finite(value: object) -> object:
    return None if isinstance(value, float) and not isfinite(value) else value
