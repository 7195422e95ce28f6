"""Lanes, which show states over time such as "at the limit", and the events of a flight."""

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import aircraft
from harness.chatter import swinging
from harness.log import FlightLog
from harness.log.signals import Signals, at_limit
from harness.plants.plant import Outcome
from harness.review.styled import Colour

WINDOW = 1.0  # s: a lane has one state per window, so that a chattering command stays readable
BRIEF = "\n\n"  # before a state: its word stands below the lane, where the viewer cuts it off, and in its tooltip
MOST_EVENTS = 15  # of one lane; a lane with more changes becomes one event
GUSTS = (0.25, 0.1)  # thresholds, relative to the nominal airspeed

_GREEN, _BLUE, _AMBER, _RED, _SLATE = (70, 150, 80), (60, 115, 175), (200, 130, 40), (200, 60, 60), (85, 90, 100)
COLOURS: Mapping[str, Colour] = MappingProxyType(
    {
        "not converged": _SLATE,
        "outside tolerance": _SLATE,
        "within tolerance": _BLUE,
        "converged": _GREEN,
        "free": _SLATE,
        "on and off the limit": _AMBER,
        "at the limit": _RED,
        "quiet": _SLATE,
        "oscillates": _AMBER,
        "limit cycle": _RED,
        "normal": _SLATE,
        "bank at its limit": _AMBER,
        "beyond the stall angle": _RED,
        "calm": _SLATE,
        "gusts above 10 %": _AMBER,
        "gusts above 25 %": _RED,
        "at rest": _SLATE,
        "straight": _SLATE,
        "turning": _BLUE,
        "faster": _AMBER,
        "slower": _AMBER,
        **{outcome.value: _RED for outcome in Outcome if outcome is not Outcome.COMPLETED},
    }
)


class Change(NamedTuple):
    """A change of a lane's state at `time`, s."""

    time: float
    state: str


class Event(NamedTuple):
    """An event at `time`, s; `level` is one of Rerun's text log levels."""

    time: float
    level: str
    text: str


LANES = ("circle", "command", "chatter", "aircraft", "air", "target")
LANES_OF_SEVERAL = ("circle", "chatter")  # which each of several flights has


def lane_entity(lane: str, flight: str = "") -> str:
    """The entity of a lane. The viewer shows its whole name, so it is of plain words, without escapes."""
    return f"/{lane}" + (f"/{re.sub('[^0-9A-Za-z_.]+', '-', flight).strip('-')}" if flight else "")


def lanes_by_flight(logs: Mapping[str, FlightLog]) -> dict[str, list[Change]]:
    """The lanes by entity: all of one flight, `LANES_OF_SEVERAL` of more; names that would be one are numbered."""
    if len(logs) == 1:
        return {lane_entity(name): changes for name, changes in lanes(*logs.values()).items()}
    found: dict[str, list[Change]] = {}
    for number, (name, log) in enumerate(logs.items(), 1):
        taken = lane_entity(LANES_OF_SEVERAL[0], name) in found
        for lane, changes in zip(LANES_OF_SEVERAL, (summary(log), chatter_lane(log)), strict=True):
            found[lane_entity(lane, f"{name}-{number}" if taken else name)] = changes
    return {entity: changes for entity, changes in found.items() if changes}


def without_cut_words(changes: Sequence[Change], until: float, length: Callable[[str], float]) -> list[Change]:
    """The changes with `BRIEF` before each state that does not last as long as its word is: `length`, s."""
    ends = [*(change.time for change in changes[1:]), until]
    return [
        Change(time, state if end - time >= length(state) else f"{BRIEF}{state}")
        for (time, state), end in zip(changes, ends, strict=True)
    ]


def lanes(log: FlightLog) -> dict[str, list[Change]]:
    """The lanes of a flight by name, without those that would be empty."""
    if not len(log):
        return {}
    changes_by_lane = {
        "circle": _circle(log),
        "command": command_lane(log),
        "chatter": chatter_lane(log),
        "aircraft": _aircraft(log),
        "air": _air(log),
        "target": _target(log),
    }
    return {name: [*changes, *_ending(log)] for name, changes in changes_by_lane.items() if changes}


def summary(log: FlightLog) -> list[Change]:
    """One lane that sums up the flight: converged or not and, until then, whether the command is at its limit."""
    if not len(log):
        return []
    limits, circle = command_lane(log), _circle(log)
    since = next((change.time for change in circle if change.state == "converged"), math.inf)
    before = [Change(time, "not converged" if state == "free" else state) for time, state in limits if time < since]
    settled = [Change(since, "converged")] if math.isfinite(since) else []
    return [*_merged([*before, *settled]), *_ending(log)]


def events(log: FlightLog, lanes: Mapping[str, Sequence[Change]], shared: bool = True) -> list[Event]:
    """The events of a flight, sorted by time, those of its `lanes` included.

    Without `shared`, the events of target and air are left out: another flight in the same view has them.
    """
    if not len(log):
        return [Event(0.0, "WARN", _end_text(log))]
    events = [*_crossing(log), *_feasible(log), *(_gust(log) if shared else ())]
    for name, changes in lanes.items():
        if not shared and name in ("air", "target"):
            continue
        states = [change for change in changes if change.state != log.outcome.value]
        if len(states) > MOST_EVENTS:
            events.append(Event(states[0].time, "INFO", f"{name}: {states[0].state}; then {len(states) - 1} changes"))
        else:
            events += [Event(time, _level(state), f"{name}: {state}") for time, state in states]
    completed = log.outcome is Outcome.COMPLETED
    events.append(Event(float(log["time"][-1]), "INFO" if completed else "WARN", _end_text(log)))
    return sorted(events, key=lambda event: event.time)


def command_lane(log: FlightLog) -> list[Change]:
    """Whether the command is at its limit: for a whole window, for part of it, or not at all."""
    held = at_limit(log)
    shares = [float(part.mean()) for part in _windows(log, held.astype(float))]
    return _lane(log, ["at the limit" if s == 1.0 else "on and off the limit" if s else "free" for s in shares])


def chatter_lane(log: FlightLog) -> list[Change]:
    """Whether the command oscillates, and in the judged window whether that is a limit cycle."""
    if not len(log):
        return []
    signals = Signals(log)
    cycles_from = float(log["time"][signals.window.first]) if signals.limit_cycle else math.inf
    oscillating = _windows(log, swinging(log["heading_rate_command"], log.flight.guidance_period).astype(float))
    named = (("limit cycle" if time >= cycles_from else "oscillates") for time in log["time"][_begins(log)])
    return _lane(log, [name if part.mean() >= 0.5 else "quiet" for name, part in zip(named, oscillating, strict=True)])


def _circle(log: FlightLog) -> list[Change]:
    tolerance = log.flight.metrics.tolerance
    settled = Signals(log).settling_time()
    inside = [bool((np.abs(part) < tolerance).all()) for part in _windows(log, log["range_error"])]
    changes = _lane(log, ["within tolerance" if is_inside else "outside tolerance" for is_inside in inside])
    if settled is None:
        return changes
    return [*(change for change in changes if change.time < settled), Change(settled, "converged")]


def _aircraft(log: FlightLog) -> list[Change]:
    """Stall and bank limit, from the airframe's own data; empty for a plant without an airframe."""
    if np.isnan(log["angle_of_attack"]).all():
        return []
    limits = aircraft.limits(aircraft.folder(log.flight.aircraft))
    stalled = _windows(log, (log["angle_of_attack"] >= limits.stall).astype(float))
    banked = _windows(log, (np.abs(log["bank_command"]) >= limits.bank - 1e-9).astype(float))
    states = [
        "beyond the stall angle" if s.any() else "bank at its limit" if b.any() else "normal"
        for s, b in zip(stalled, banked, strict=True)
    ]
    return _lane(log, states)


def _air(log: FlightLog) -> list[Change]:
    """The strongest gust of each window; empty in steady wind."""
    gusts = _gusts(log) / log.flight.start.airspeed
    if not (gusts > 1e-9).any():
        return []
    peaks = [float(part.max()) for part in _windows(log, gusts)]
    names = [next((f"gusts above {100 * level:.0f} %" for level in GUSTS if peak > level), "calm") for peak in peaks]
    return _lane(log, names)


def _target(log: FlightLog) -> list[Change]:
    """Whether a moving target speeds up, slows down, turns or goes straight; empty for a target at rest."""
    speed = np.hypot(log["target_velocity_north"], log["target_velocity_east"])
    acceleration, turn = log["target_acceleration"], log["target_turn_rate"]
    if not speed.any():
        return []
    states = np.select(
        [acceleration > 1e-6, acceleration < -1e-6, np.abs(turn) > 1e-6, speed > 1e-6],
        ["faster", "slower", "turning", "straight"],
        "at rest",
    )
    changed = np.flatnonzero(np.append(True, states[1:] != states[:-1]))
    return [Change(float(log["time"][i]), str(states[i])) for i in changed]


def _ending(log: FlightLog) -> list[Change]:
    """The outcome of a flight that ended early."""
    return [] if log.outcome is Outcome.COMPLETED else [Change(float(log["time"][-1]), log.outcome.value)]


def _crossing(log: FlightLog) -> Iterator[Event]:
    error = log["range_error"]
    crossed = np.flatnonzero(error * error[0] < 0)
    if crossed.size:
        yield Event(float(log["time"][crossed[0]]), "INFO", "crosses the circle for the first time")
        worst = crossed[np.abs(error[crossed]).argmax()]
        yield Event(float(log["time"][worst]), "INFO", f"largest overshoot, {abs(error[worst]):.3g} m")


def _feasible(log: FlightLog) -> Iterator[Event]:
    """Where the circle cannot be held from then on, and where it can again."""
    is_held = log["feasibility_margin"] >= 0.0
    changed = np.flatnonzero(np.append(not is_held[0], is_held[1:] != is_held[:-1]))
    if len(changed) > MOST_EVENTS:
        text = f"the circle cannot be held; then {len(changed) - 1} changes"
        yield Event(float(log["time"][changed[0]]), "WARN", text)
        return
    for row in changed:
        time, margin = float(log["time"][row]), math.degrees(log["feasibility_margin"][row])
        if is_held[row]:
            yield Event(time, "INFO", "the circle can be held again")
        else:
            lacking = (
                f"the command's limit is {-margin:.3g} deg/s too small" if math.isfinite(margin) else "at any rate"
            )
            yield Event(time, "WARN", f"the circle cannot be held: {lacking}")


def _gust(log: FlightLog) -> Iterator[Event]:
    gusts = _gusts(log)
    if (gusts > 1e-9).any():
        strongest = int(gusts.argmax())
        yield Event(float(log["time"][strongest]), "INFO", f"strongest gust, {gusts[strongest]:.3g} m/s")


def _gusts(log: FlightLog) -> NDArray[np.float64]:
    W_x, W_y = log.flight.wind.steady
    square = (log["wind_north"] - W_x) ** 2 + (log["wind_east"] - W_y) ** 2 + log["wind_down"] ** 2
    return np.asarray(np.sqrt(square), dtype=np.float64)


def _end_text(log: FlightLog) -> str:
    return f"{log.outcome.value}{': ' if log.reason else ''}{log.reason}"


def _level(state: str) -> str:
    return "WARN" if COLOURS[state] in (_RED, _AMBER) else "INFO"


def _windows(log: FlightLog, values: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    begins = _begins(log)
    return [values[begin:end] for begin, end in zip(begins, [*begins[1:], len(values)], strict=True)]


def _begins(log: FlightLog) -> list[int]:
    """The first row of each window; rows that are left at the end belong to the last window."""
    rows = max(1, round(WINDOW / log.flight.guidance_period))
    return list(range(0, max(1, len(log) - rows + 1), rows))


def _lane(log: FlightLog, states: Sequence[str]) -> list[Change]:
    times = log["time"][_begins(log)]
    return _merged([Change(float(time), state) for time, state in zip(times, states, strict=True)])


def _merged(changes: Sequence[Change]) -> list[Change]:
    return [change for i, change in enumerate(changes) if i == 0 or change.state != changes[i - 1].state]
