"""The panels of a recorded flight, on a page and in a recording alike: track, values over time, turn relation."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from harness.recorded.assessment import Assessment
from harness.recorded.part_finding import CANNOT, PartFinding
from harness.recorded.recorded_flight import QUANTITIES, Array, RecordedFlight

DEG = 180.0 / math.pi
TURN = "turn relation"
_SPAN = 0.4  # s: span of the differences that give the rate of the yaw
COMMANDED, FLOWN, OTHER = "commanded", "flown", "other"  # which line of a panel


class PanelLine(NamedTuple):
    """One line: what it is, and its values in the unit of the panel."""

    name: str
    kind: str
    time: Array
    values: Array
    held: bool = False  # until the next value


class FlightPanel(NamedTuple):
    """Lines over time."""

    title: str
    unit: str
    lines: Sequence[PanelLine]


class Scatter(NamedTuple):
    """The turn relation, deg/s: required and flown rate of each window, the fit, and the margin."""

    asked: Array
    flown: Array
    slope: float
    low: float  # of the slope
    high: float
    allowed: tuple[float, float]  # slopes
    word: str


_PANELS = (
    ("Airspeed", ("airspeed_command", "airspeed")),
    ("Bank", ("bank_command", "bank")),
    ("Heading rate", ("heading_rate_command",)),
    ("Altitude", ("altitude_command", "altitude")),
    ("Altitude minus command", ("altitude_error",)),
    ("Lateral specific force", ("lateral_acceleration",)),
    ("Throttle", ("throttle",)),
)


def panels(whole: RecordedFlight, found: Assessment) -> Iterator[FlightPanel]:
    """The panels for which the log has something. Signs are those of the assessment."""
    flight = _turned(whole, found)
    for title, names in _PANELS:
        lines = [_line(flight, name) for name in names if name in flight]
        if title == "Airspeed":
            lines += _of_the_track(flight, found)
        if title == "Heading rate" and lines:
            lines += _of_the_yaw(flight)
        if any(line.kind != COMMANDED for line in lines):
            yield FlightPanel(title, QUANTITIES[names[-1]].unit.replace("rad", "deg"), lines)


def track(whole: RecordedFlight) -> tuple[Array, Array, Array] | None:
    """Time, s, north and east, m: the position, or the ground velocity summed up; None where there is neither."""
    if whole.has("north", "east"):
        time = whole["north"].time
        places = [time, whole["north"].values, whole["east"].at(time)]
    elif whole.has("velocity_north", "velocity_east"):
        time = whole["velocity_north"].time
        velocities = np.nan_to_num(whole.table(("velocity_north", "velocity_east"), time))
        steps = 0.5 * np.diff(time)[:, None] * (velocities[1:] + velocities[:-1])
        places = [time, *np.vstack([np.zeros(2), np.cumsum(steps, axis=0)]).T]
    else:
        return None
    known = np.isfinite(places[1]) & np.isfinite(places[2])
    t, north, east = (place[known] for place in places)
    return (t, north, east) if len(t) > 1 else None


def scatter(found: Assessment) -> Scatter | None:
    """The turn relation as a picture; None where it could not be judged."""
    finding = turn_finding(found)
    if finding is None or finding.word == CANNOT or not found.points:
        return None
    asked, flown = (DEG * np.array([getattr(point, name) for point in found.points]) for name in ("asked", "flown"))
    low, high = finding.bounds
    allowed = (-math.inf if low is None else low, math.inf if high is None else high)
    return Scatter(asked, flown, finding.value, finding.low, finding.high, allowed, str(finding.word))


def judged(found: Assessment) -> tuple[float, float] | None:
    """The times between which the flight is judged, s; None where nothing is."""
    is_judged = any(finding.word != CANNOT for finding in found.findings)
    return (found.begin, found.end) if is_judged else None


def turn_finding(found: Assessment) -> PartFinding | None:
    """The text on the turn relation."""
    return next((finding for finding in found.findings if finding.part.title == TURN), None)


def _turned(whole: RecordedFlight, found: Assessment) -> RecordedFlight:
    """The whole flight, where the assessment turned a channel's sign round with that sign."""
    turned = [
        name
        for name, channel in found.flight.channels.items()
        if name in whole and len(channel) and _opposite(channel.values, whole[name].at(channel.time))
    ]
    return whole.changed(np.negative, *turned)


def _opposite(one: Array, other: Array) -> bool:
    known = np.isfinite(other)
    return bool(known.any()) and bool(np.array_equal(one[known], -other[known])) and bool(np.any(one[known]))


def _line(flight: RecordedFlight, name: str) -> PanelLine:
    channel = flight[name]
    scale = DEG if QUANTITIES[name].unit.startswith("rad") else 1.0
    if name.endswith("_command"):
        return PanelLine("commanded", COMMANDED, channel.time, scale * channel.values, held=True)
    return PanelLine(str(channel.basis), FLOWN, channel.time, scale * channel.values)


def _of_the_track(flight: RecordedFlight, found: Assessment) -> list[PanelLine]:
    """The size of the ground velocity minus the wind: what the airspeed should be."""
    if not found.wind or not flight.has("velocity_north", "velocity_east"):
        return []
    time = flight["velocity_north"].time
    north, east = flight.table(("velocity_north", "velocity_east"), time).T
    speed = np.hypot(north - found.wind.north[0], east - found.wind.east[0])
    return [PanelLine("ground velocity minus wind", OTHER, time, speed)]


def _of_the_yaw(flight: RecordedFlight) -> list[PanelLine]:
    """How fast the nose turns, over spans of `_SPAN`."""
    if not flight.has("yaw"):
        return []
    time = np.arange(flight["yaw"].time[0], flight["yaw"].time[-1], _SPAN)
    rate = DEG * np.diff(flight["yaw"].at(time)) / _SPAN
    return [PanelLine("rate of the yaw", FLOWN, time[:-1] + 0.5 * _SPAN, rate)]
