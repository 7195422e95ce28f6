"""The wall time that flights take: typical for their length and plant, corrected by those flown so far."""

from collections import defaultdict, deque
from collections.abc import Mapping
from statistics import median

from harness.flight import Flight
from harness.plants.ladder import PLANTS

CHUNK = 0.3  # s of flights that a worker is sent in one message
# Seconds on the machine of `make bench`, on every plant: per guidance period, per gust, per measurement.
_PERIOD, _GUST, _SAMPLE = 6e-6, 1e-6, 60e-6
_OVERHEAD = 0.003  # s per flight: start, metrics and digest
_LATEST = 51  # flights of a plant, of which `TimeLeft` takes the median
_SETTLING = 0.5  # s after which the measured pace of the workers counts as much as that all of them fly
_FORGETTING = 0.2  # weight of the latest flight in the running mean


class WallTime:
    """The wall time of flights on this machine: the typical one, times a ratio per plant that is learned."""

    def __init__(self) -> None:
        self._ratio: dict[str, float] = {}  # measured over typical wall time, by plant

    def seconds(self, flight: Flight) -> float:
        """The expected wall time, s, of the flight in one process."""
        return typical_wall_time(flight) * self._ratio.get(flight.plant, 1.0)

    def learn(self, flight: Flight, seconds: float) -> None:
        """Takes in the measured wall time of a flight."""
        ratio, known = seconds / typical_wall_time(flight), self._ratio.get(flight.plant)
        self._ratio[flight.plant] = ratio if known is None else known + _FORGETTING * (ratio - known)


class TimeLeft:
    """The time that a run still takes, from what the flights to come typically take and from those flown so far.

    Each plant has a ratio of measured over typical wall time: the median of its latest flights, since the first one in
    a process imports libraries. What the workers do between flights shows in the pace: wall time of flights per second.
    """

    def __init__(self, typical: Mapping[str, float], workers: int) -> None:
        """`typical`: the typical wall time, s, of all flights to be flown, by plant."""
        self._typical, self._workers, self._is_known = dict(typical), max(1, workers), bool(typical)
        self._ratios: dict[str, deque[float]] = defaultdict(lambda: deque(maxlen=_LATEST))
        self._flown = 0.0  # s: wall time of flights since the first was back
        self._first: float | None = None
        self._last = 0.0

    def leave_out(self, flight: Flight) -> None:
        """A flight that is not flown after all, or is done."""
        self._typical[flight.plant] = self._typical.get(flight.plant, 0.0) - typical_wall_time(flight)

    def learn(self, flight: Flight, seconds: float | None, now: float) -> None:
        """Takes in a flight that is back at the time `now`, and its wall time where it was measured; both in s."""
        self.leave_out(flight)
        if seconds is None:
            return
        self._ratios[flight.plant].append(seconds / typical_wall_time(flight))
        if self._first is None:
            self._first = now
        elif now > self._first:
            self._flown += seconds
        self._last = now

    def seconds(self, now: float) -> float | None:
        """The time left, s; None before the first flight is back, or when nothing is known of the flights to come."""
        if self._first is None or not self._is_known:
            return None
        ratios = {plant: median(latest) for plant, latest in self._ratios.items()}
        others = median(ratios.values())
        left = sum(max(0.0, typical) * ratios.get(plant, others) for plant, typical in self._typical.items())
        passed = self._last - self._first
        pace = min(self._workers, (self._flown + self._workers * _SETTLING) / (passed + _SETTLING))
        return max(0.0, left / pace - (now - self._last))


def typical_wall_time(flight: Flight) -> float:
    """The wall time, s, on a machine like that of `make bench`."""
    seconds, steps = _OVERHEAD + flight.periods * _PERIOD, flight.duration / flight.step
    cost = PLANTS[flight.plant].cost
    seconds += cost.start + max(flight.periods, flight.duration / 0.05) * cost.period + steps * cost.step
    if flight.wind.turbulence != "none":
        seconds += steps * _GUST
    if flight.estimator.filters:
        seconds += flight.duration / flight.estimator.period * _SAMPLE
    return seconds
