"""A recorded flight: channels in SI, each with its own times, and what is wrong with the log."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from harness.error import HarnessError, did_you_mean

Array = NDArray[np.float64]

# Two samples further apart than this many usual intervals have a gap between them. A value that stays the same is a
# sample once in HELD usual intervals, so that a constant signal has no gap.
GAP = 8.0
HELD = 3.0
LARGEST = 1e9  # larger numbers are damaged, as in settings


class LogError(HarnessError, OSError, ValueError):
    """A log that cannot be read, or has nothing to judge."""


class Basis(StrEnum):
    """Where the values of a channel come from."""

    MEASURED = "measured"  # by a sensor
    ESTIMATED = "estimated"  # by a filter of the autopilot
    COMMANDED = "commanded"
    DERIVED = "derived"  # by the reader, from other channels


class Quantity(NamedTuple):
    """The quantity of a channel."""

    unit: str  # SI, or rad
    meaning: str


# The names of a simulated flight's log wherever the quantity is the same.
QUANTITIES: Mapping[str, Quantity] = MappingProxyType(
    {
        "north": Quantity("m", "position, from the log's own origin"),
        "east": Quantity("m", "position, from the log's own origin"),
        "altitude": Quantity("m", "height above the log's own origin"),
        "velocity_north": Quantity("m/s", "over the ground"),
        "velocity_east": Quantity("m/s", "over the ground"),
        "velocity_down": Quantity("m/s", "over the ground"),
        "velocity_forward": Quantity("m/s", "over the ground, along the body's x axis"),
        "velocity_right": Quantity("m/s", "over the ground, along the body's y axis"),
        "velocity_below": Quantity("m/s", "over the ground, along the body's z axis"),
        "ground_speed": Quantity("m/s", "size of the horizontal velocity over the ground"),
        "airspeed": Quantity("m/s", "speed relative to the air, as the log gives it"),
        "wind_north": Quantity("m/s", "velocity of the air"),
        "wind_east": Quantity("m/s", "velocity of the air"),
        "wind_down": Quantity("m/s", "velocity of the air"),
        "bank": Quantity("rad", "right wing down is positive"),
        "pitch": Quantity("rad", "nose up is positive"),
        "yaw": Quantity("rad", "direction of the nose, clockwise from north, unwrapped"),
        "course": Quantity("rad", "direction of the ground velocity, clockwise from north, unwrapped"),
        "roll_rate": Quantity("rad/s", "about the body's x axis"),
        "pitch_rate": Quantity("rad/s", "about the body's y axis"),
        "yaw_rate": Quantity("rad/s", "about the body's z axis"),
        "forward_acceleration": Quantity("m/s2", "specific force along the body's x axis"),
        "lateral_acceleration": Quantity("m/s2", "specific force along the body's y axis; 0 in a coordinated turn"),
        "vertical_acceleration": Quantity("m/s2", "specific force along the body's z axis; about -9.8 in level flight"),
        "angle_of_attack": Quantity("rad", ""),
        "sideslip": Quantity("rad", "positive with the wind from the right"),
        "aileron": Quantity("rad", "rolls right"),
        "elevator": Quantity("rad", "pitches down"),
        "rudder": Quantity("rad", "yaws left"),
        "throttle": Quantity("", "0 to 1"),
        "bank_command": Quantity("rad", ""),
        "pitch_command": Quantity("rad", ""),
        "yaw_command": Quantity("rad", "counted on beyond a turn"),
        "course_command": Quantity("rad", "counted on beyond a turn"),
        "heading_rate_command": Quantity("rad/s", "of the direction of the air velocity"),
        "roll_rate_command": Quantity("rad/s", ""),
        "pitch_rate_command": Quantity("rad/s", ""),
        "yaw_rate_command": Quantity("rad/s", ""),
        "airspeed_command": Quantity("m/s", ""),
        "altitude_command": Quantity("m", "above the origin of altitude"),
        "altitude_error": Quantity("m", "altitude minus commanded altitude"),
    }
)
DIRECTIONS = ("yaw", "course", "yaw_command", "course_command")  # unwrapped angles


@dataclass(frozen=True, slots=True, eq=False)
class Channel:
    """One quantity of a recorded flight: its new values, with their own times. See `sampled`."""

    time: Array  # s since the log's first row, increasing
    values: Array  # SI, rad
    basis: Basis
    source: str  # file or message, and field
    rows: int  # of the log, which may repeat a value many times
    note: str = ""  # what else a reader of the values should know

    def __len__(self) -> int:
        return len(self.time)

    @property
    def interval(self) -> float:
        """The usual time from one new value to the next, s; inf of fewer than two."""
        return float(np.median(np.diff(self.time))) if len(self.time) > 1 else math.inf

    @property
    def rate(self) -> float:
        """New values per second, as a rule. A log may hold many more rows."""
        return 1.0 / self.interval

    @property
    def longest_gap(self) -> float:
        """The longest time without a new value, s."""
        return float(np.diff(self.time).max()) if len(self.time) > 1 else math.inf

    def at(self, time: Array) -> Array:
        """The values at these times, s: of a command the latest, of anything else interpolated.

        NaN before the first and after the last sample, and between samples that are `GAP` usual intervals apart.
        """
        found: Array = np.full(np.shape(time), np.nan)
        if not len(self):
            return found
        if self.basis is Basis.COMMANDED:
            latest = np.searchsorted(self.time, time, side="right") - 1
            known = (latest >= 0) & (time <= self.time[-1])
            found[known] = self.values[latest[known]]
            return found
        found = np.interp(time, self.time, self.values, left=np.nan, right=np.nan)
        after = np.clip(np.searchsorted(self.time, time, side="left"), 1, max(1, len(self) - 1))
        if len(self) > 1:
            apart = self.time[after] - self.time[after - 1]
            found[(apart > GAP * self.interval) & (time > self.time[after - 1]) & (time < self.time[after])] = np.nan
        return found

    def between(self, begin: float, end: float) -> "Channel":
        """The samples from `begin` to `end`, s."""
        inside = (self.time >= begin) & (self.time <= end)
        time, values = self.time[inside], self.values[inside]
        rows = round(self.rows * len(time) / max(1, len(self)))
        before = int(np.searchsorted(self.time, begin)) - 1
        if self.basis is Basis.COMMANDED and before >= 0:  # a command holds until the next
            time, values = np.append(begin, time), np.append(self.values[before], values)
        return replace(self, time=time, values=values, rows=rows)


def sampled(time: Array, values: Array, basis: Basis, source: str, note: str = "") -> Channel:
    """The channel of a log's rows, of which those that repeat the value before are no samples.

    A row counts when its value is new, or when `HELD` usual intervals between new values have passed without one: then
    the quantity itself has not changed. `time` increases; rows without a number below `LARGEST` are left out.
    """
    finite = (np.abs(values) < LARGEST) & np.isfinite(time)
    time, values = time[finite], values[finite]
    kept = _new(time, values)
    return Channel(time[kept], values[kept], basis, source, len(time), note)


def _new(time: Array, values: Array) -> NDArray[np.bool_]:
    """Which rows are samples: see `sampled`."""
    if len(time) < 2:
        return np.ones(len(time), bool)
    new = np.append(True, np.diff(values) != 0.0)
    begin = time[new]  # of each run of equal values
    usual = float(np.median(np.diff(begin))) if len(begin) > 2 else float(np.median(np.diff(time)))
    run = np.cumsum(new) - 1
    waited = np.floor((time - begin[run]) / (HELD * usual))
    again = np.append(False, np.diff(waited) > 0.0)
    last = np.append(np.diff(run) > 0, True)
    kept: NDArray[np.bool_] = new | again | (last & (waited >= 1.0))
    return kept


class LoggedEvent(NamedTuple):
    """Something that the log says happened."""

    time: float  # s
    text: str


@dataclass(frozen=True, eq=False)
class RecordedFlight:
    """The content of a log. `flight["bank"]` is a channel; names as in `QUANTITIES`. SI, rad, NED."""

    name: str
    sources: tuple[str, ...]  # files
    clock: str  # what the times are counted by
    channels: Mapping[str, Channel]
    problems: tuple[str, ...] = ()  # what is wrong with the log, a line each
    events: tuple[LoggedEvent, ...] = ()  # modes and the like
    failure: LoggedEvent | None = None  # from then on the aircraft has failed
    parameters: Mapping[str, float] = field(default_factory=dict)  # settings of the autopilot, where the log has them
    of_receipt: bool = False  # the times are those of receipt: they include telemetry latency
    refusals: tuple[str, ...] = ()  # why nothing may be judged from this log, a line each
    vehicle: str = ""  # the autopilot, according to the log

    def __getitem__(self, name: str) -> Channel:
        """The channel. Raises KeyError, for a name that is none of `QUANTITIES` too."""
        if name not in self.channels:
            raise KeyError(f"{self.name} has no channel {name!r}{did_you_mean(name, self.channels)}")
        return self.channels[name]

    def __contains__(self, name: object) -> bool:
        return name in self.channels

    def has(self, *names: str) -> bool:
        """Whether the log has all of these channels, each with two samples at least."""
        return all(name in self.channels and len(self.channels[name]) > 1 for name in names)

    @property
    def begin(self) -> float:
        """The time of the first sample, s; NaN without any."""
        return min((float(c.time[0]) for c in self.channels.values() if len(c)), default=math.nan)

    @property
    def end(self) -> float:
        """The time of the last sample, s; NaN without any."""
        return max((float(c.time[-1]) for c in self.channels.values() if len(c)), default=math.nan)

    def between(self, begin: float = -math.inf, end: float = math.inf) -> "RecordedFlight":
        """The same flight from `begin` to `end`, s; channels without a sample there are left out."""
        cut = {name: channel.between(begin, end) for name, channel in self.channels.items()}
        events = tuple(event for event in self.events if begin <= event.time <= end)
        left = {name: channel for name, channel in cut.items() if len(channel) and begin <= self.end}
        return replace(self, channels=left, events=events)

    def table(self, names: Iterable[str], time: Array) -> Array:
        """The channels at these times, (times, names); NaN where one is not known."""
        return np.column_stack([self[name].at(time) for name in names])

    def with_channel(self, name: str, channel: Channel) -> "RecordedFlight":
        """The same flight with one more channel, or another one of this name."""
        return replace(self, channels={**self.channels, name: channel})

    def changed(self, change: Callable[[Array], Array], *names: str) -> "RecordedFlight":
        """The same flight with other values in these channels, such as another sign."""
        new = {name: replace(self[name], values=change(self[name].values)) for name in names}
        return replace(self, channels={**self.channels, **new})
