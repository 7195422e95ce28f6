"""How long flights take: a guess from their length, corrected by those that were flown."""

from harness.flight import Flight

CHUNK = 0.3  # s of flights in one message to a worker
# Seconds on the machine of `make bench`: of any plant per guidance period, per step of JSBSim, gust, measurement.
_PERIOD, _STEP, _GUST, _SAMPLE = 6e-6, 6.5e-6, 1e-6, 60e-6
_RUNGS = {"lagged": 20e-6, "coordinated": 45e-6}  # per guidance period, or per 50 ms of a longer one
_BEGIN, _LOAD = 0.003, 0.012  # of any flight, metrics and digest included; of loading and trimming an airframe
_FORGETTING = 0.2


class Estimate:
    """Seconds that flights take on this machine; learns while they are flown."""

    def __init__(self) -> None:
        self._ratio: dict[str, float] = {}  # of what they take to what was guessed, by plant

    def seconds(self, flight: Flight) -> float:
        """Wall time of the flight in one process."""
        return guess(flight) * self._ratio.get(flight.plant, 1.0)

    def learn(self, flight: Flight, seconds: float) -> None:
        """Takes in how long it took."""
        ratio, known = seconds / guess(flight), self._ratio.get(flight.plant)
        self._ratio[flight.plant] = ratio if known is None else known + _FORGETTING * (ratio - known)


def guess(flight: Flight) -> float:
    """Seconds on a machine like that of `make bench`."""
    seconds, steps = _BEGIN + flight.periods * _PERIOD, flight.duration / flight.step
    if flight.plant in _RUNGS:
        seconds += _LOAD + max(flight.periods, flight.duration / 0.05) * _RUNGS[flight.plant]
    if flight.plant == "sixdof":
        seconds += _LOAD + steps * _STEP
    if flight.wind.turbulence != "none":
        seconds += steps * _GUST
    if flight.estimator.kind == "ekf":
        seconds += flight.duration / flight.estimator.period * _SAMPLE
    return seconds
