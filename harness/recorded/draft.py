"""A recorded flight while it is being read: what every reader of a log does with its rows."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from harness.recorded.recorded_flight import (
    DIRECTIONS,
    Array,
    Basis,
    Channel,
    LogError,
    LoggedEvent,
    RecordedFlight,
    sampled,
)

FASTEST = 100.0  # 1/s: rows that come faster are averaged, so that a long log takes no large memory
LARGEST, LARGEST_TIME = 1e9, 1e11  # SI: larger numbers are invalid
WILD = 0.01  # share of rows with a time far off that count as damaged; with more, the clock was set back
LONGEST = 86_400.0  # s: largest time from the middle of a log; times further away are damaged
DISORDER = 1.0  # s: rows out of order by up to this are sorted; beyond it the clock was set back


@dataclass
class Draft:
    """Channels and problems, in the log's own seconds, which may count from any moment."""

    name: str
    sources: Sequence[str]
    clock: str
    channels: dict[str, Channel] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)
    refusals: list[str] = field(default_factory=list)
    events: list[LoggedEvent] = field(default_factory=list)
    failure: LoggedEvent | None = None
    parameters: dict[str, float] = field(default_factory=dict)
    of_receipt: bool = False
    vehicle: str = ""

    def add(self, name: str, time: Array, values: Array, basis: Basis, source: str, note: str = "") -> None:
        """Adds a channel, unless a better source gave it before. `time` increases: see `in_order`."""
        if name in self.channels:
            return
        finite = np.abs(values) < LARGEST  # neither is a NaN
        if missing := int(np.count_nonzero(~finite)):
            self.problems.append(f"{source}: {missing} of {len(values)} values of {name} are no numbers, and left out")
        time, values = time[finite], values[finite]
        if name in DIRECTIONS:
            values = np.unwrap(values)
        rows = len(time)
        time, values = _slower(time, values, basis)
        if len(channel := sampled(time, values, basis, source, note)):
            self.channels[name] = replace(channel, rows=channel.rows + rows - len(time))

    def in_order(self, time: Array, source: str) -> NDArray[np.intp]:
        """The rows whose times increase, in that order. What is left out, or out of order, becomes a problem."""
        rows = np.flatnonzero(np.abs(time) < LARGEST_TIME)
        if missing := len(time) - len(rows):
            self.problems.append(f"{source}: {missing} of {len(time)} rows have no time, and are left out")
        t = time[rows]
        far = np.abs(t - np.median(t)) > LONGEST if len(t) else t > 0.0
        far |= t - np.minimum.accumulate(t[::-1])[::-1] > DISORDER
        if 0 < (wild := int(np.count_nonzero(far))) <= WILD * len(t):
            self.problems.append(f"{source}: {wild} of {len(time)} rows have a time far off, and are left out")
            rows, t = rows[~far], t[~far]
        late = np.maximum.accumulate(t) - t if len(t) else t
        if len(t) and late.max() > DISORDER:
            k = int(np.argmax(late > DISORDER))
            at = f"at row {rows[k] + 1} from {t[:k].max() - t[0]:.2f} s to {t[k] - t[0]:.2f} s after its first"
            self.refusals.append(f"{source}: the clock goes back {at}: two recordings, or a restart, in one log")
            rows, t, late = rows[:k], t[:k], late[:k]
        if disordered := int(np.count_nonzero(late > 0.0)):
            how = f"are out of order by up to {late.max():.3g} s, and are sorted"
            self.problems.append(f"{source}: {disordered} of {len(time)} rows {how}")
            rows = rows[np.argsort(t, kind="stable")]
        repeated = np.diff(time[rows], prepend=-np.inf) == 0.0
        if count := int(np.count_nonzero(repeated)):
            self.problems.append(
                f"{source}: {count} of {len(time)} rows have the time of the row before, and are left out"
            )
        kept: NDArray[np.intp] = rows[~repeated]
        return kept

    def _leave_out_what_is_far_off(self) -> None:
        """Channels with a time more than `LONGEST` from the middle of the one with most samples."""
        if not self.channels:
            return
        middle = float(np.median(max(self.channels.values(), key=len).time))
        for name, channel in list(self.channels.items()):
            if np.abs(channel.time - middle).max() > LONGEST:
                del self.channels[name]
                self.problems.append(f"{channel.source}: {name} has times a day away from the others, and is left out")

    def finished(self) -> RecordedFlight:
        """The flight, its times in seconds since the log's first row. Raises `LogError` for one without any channel."""
        self._leave_out_what_is_far_off()
        if not self.channels:
            why = "; ".join([*self.refusals, *self.problems])
            raise LogError(f"{self.name}: has no channel that can be judged{f' ({why})' if why else ''}")
        begin = min(float(channel.time[0]) for channel in self.channels.values())
        channels = {
            name: Channel(c.time - begin, c.values, c.basis, c.source, c.rows, c.note)
            for name, c in self.channels.items()
        }
        events = sorted(LoggedEvent(time - begin, text) for time, text in self.events)
        failure = self.failure and self.failure._replace(time=self.failure.time - begin)
        return RecordedFlight(
            self.name,
            tuple(self.sources),
            self.clock,
            channels,
            tuple(self.problems),
            tuple(events),
            failure,
            self.parameters,
            self.of_receipt,
            tuple(self.refusals),
            self.vehicle,
        )


def _slower(time: Array, values: Array, basis: Basis) -> tuple[Array, Array]:
    """The means of time and values in spans of 1 / `FASTEST`, of a command the latest; as it is where rows are slow."""
    if len(time) < 2 or np.median(np.diff(time)) > 0.9 / FASTEST:
        return time, values
    span = np.floor((time - time[0]) * FASTEST)
    begin = np.flatnonzero(np.append(True, np.diff(span) > 0.0))
    if basis is Basis.COMMANDED:
        last = np.append(begin[1:], len(time)) - 1
        return time[last], values[last]
    count = np.diff(np.append(begin, len(time)))
    return np.add.reduceat(time, begin) / count, np.add.reduceat(values, begin) / count
