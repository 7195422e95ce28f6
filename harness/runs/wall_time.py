"""The wall time that flights take: typical for their length and plant, corrected by those flown so far."""

from harness.flight import Flight
from harness.plants.ladder import PLANTS

CHUNK = 0.3  # s of flights in one message to a worker
# Seconds on the machine of `make bench`: of any plant per guidance period, per gust, per measurement.
_PERIOD, _GUST, _SAMPLE = 6e-6, 1e-6, 60e-6
_BEGIN = 0.003  # of any flight, metrics and digest included
_FORGETTING = 0.2


class WallTime:
    """Seconds that flights take on this machine; learns while they are flown."""

    def __init__(self) -> None:
        self._ratio: dict[str, float] = {}  # of what they take to what was guessed, by plant

    def seconds(self, flight: Flight) -> float:
        """Wall time of the flight in one process."""
        return typical_wall_time(flight) * self._ratio.get(flight.plant, 1.0)

    def learn(self, flight: Flight, seconds: float) -> None:
        """Takes in how long it took."""
        ratio, known = seconds / typical_wall_time(flight), self._ratio.get(flight.plant)
        self._ratio[flight.plant] = ratio if known is None else known + _FORGETTING * (ratio - known)


def typical_wall_time(flight: Flight) -> float:
    """Seconds on a machine like that of `make bench`."""
    seconds, steps = _BEGIN + flight.periods * _PERIOD, flight.duration / flight.step
    cost = PLANTS[flight.plant].cost
    seconds += cost.start + max(flight.periods, flight.duration / 0.05) * cost.period + steps * cost.step
    if flight.wind.turbulence != "none":
        seconds += steps * _GUST
    if flight.estimator.kind == "ekf":
        seconds += flight.duration / flight.estimator.period * _SAMPLE
    return seconds
