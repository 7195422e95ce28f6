"""Sensor and estimator of a flight: what the law knows of the target, and when."""

import math
from collections.abc import Callable

from autopilot.estimator import Estimator, Measurement, measurement
from harness.flight import Flight
from harness.plants.plant import End, Outcome
from harness.world.randomness import stream
from harness.world.target import TargetState


class Estimation:
    """Sensor and estimator in flight: what the law knows of the target at each guidance step, and the log's rows."""

    def __init__(self, flight: Flight, target: Callable[[float], TargetState]) -> None:
        self.rows: list[tuple[float, ...]] = []
        self._target = target
        self._measure, self._tracker = sensor(flight.estimator, flight.seed), flight.estimator.start()
        self._step, self._period = flight.step, flight.estimator.period
        self._guidance_steps = round(flight.guidance_period / flight.step)
        self._sample_steps = round(flight.estimator.period / flight.step)
        self._due = 0  # the number of the next measurement

    def at(self, k: int) -> TargetState:
        """At the k-th guidance step, after the measurements due by then. Its acceleration and turn rate are unknown: 0.

        Time is counted in steps. A filter's fault is a flight's outcome: `End`.
        """
        now, innovation = k * self._guidance_steps, Measurement(math.nan, math.nan)
        try:
            while self._due * self._sample_steps <= now:
                innovation = self._tracker.update(self._measure(self._target(self._due * self._period)))
                self._due += 1
            estimate = self._tracker.at((now - (self._due - 1) * self._sample_steps) * self._step)
        except Exception as error:
            raise End(Outcome.INVALID, f"the estimator raised {type(error).__name__}: {error}") from error
        if not all(map(math.isfinite, estimate)):
            raise End(Outcome.INVALID, "the estimator diverged: a number of its estimate is not finite")
        self.rows.append((*estimate, *innovation))
        return TargetState(*estimate[:4])


def told(estimator: Estimator) -> Callable[[TargetState], TargetState] | None:
    """What a law that is told the truth does not get to know: it is zero to it. None when it is told everything."""
    hidden = {f"target_{name}": 0.0 for name in ("acceleration", "turn_rate") if getattr(estimator, name) == "unknown"}
    return (lambda truth: truth._replace(**hidden)) if hidden else None


def sensor(estimator: Estimator, seed: int) -> Callable[[TargetState], Measurement]:
    """The estimator's sensor: range and azimuth of a target, with white Gaussian noise that the seed alone decides."""
    noise, position = stream(seed, "sensor"), estimator.sensor_position
    range_deviation, azimuth_deviation = math.sqrt(estimator.range_variance), math.sqrt(estimator.azimuth_variance)

    def measure(truth: TargetState) -> Measurement:
        exact = measurement(truth.target_north, truth.target_east, *position)
        in_range, in_azimuth = noise.standard_normal(2).tolist()
        return Measurement(exact.range + range_deviation * in_range, exact.azimuth + azimuth_deviation * in_azimuth)

    return measure
