"""The wall time that flights take: typical for their length and plant, corrected by those flown so far."""

from harness.flight import Flight
from harness.plants.ladder import PLANTS

CHUNK = 0.3  # s of flights that a worker is sent in one message
# Seconds on the machine of `make bench`, on every plant: per guidance period, per gust, per measurement.
_PERIOD, _GUST, _SAMPLE = 6e-6, 1e-6, 60e-6
_OVERHEAD = 0.003  # s per flight: start, metrics and digest
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
