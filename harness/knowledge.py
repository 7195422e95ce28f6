"""The law's observations at each guidance step: measurements of its aircraft and the wind, and the estimated target."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from autopilot.estimator import Estimator, Measurement, measurement
from harness.flight import Flight
from harness.plants.plant import End, Outcome
from harness.plants.state import State
from harness.world.randomness import stream
from harness.world.target import Target, TargetState

NO_MEASUREMENT = Measurement(math.nan, math.nan)
_AHEAD = 1000  # guidance steps that the filter works ahead


class Instruments:
    """The law's measurements, with the errors of one flight; `wind` is the estimated wind, m/s, north, east.

    The noise of the course depends on the seed and the number of the guidance step alone.
    """

    def __init__(self, flight: Flight) -> None:
        errors = flight.errors
        self.wind = errors.estimated(flight.wind.steady)
        self.scale, self._deviation = errors.airspeed_scale, errors.course_noise
        self._noise = stream(flight.seed, "course") if errors.course_noise else None

    def turns(self, steps: int) -> NDArray[np.float64]:
        """The errors of the course at so many guidance steps, rad; none where the course is exact."""
        return self._deviation * self._noise.standard_normal(steps) if self._noise else np.empty(0)

    def read(self, state: State) -> State:
        """The aircraft's state as it is measured at the next guidance step."""
        if self.scale != 1.0:
            state = state._replace(airspeed=self.scale * state.airspeed)
        if self._noise:
            turn = self._deviation * self._noise.standard_normal()
            v_x, v_y = turned(state.velocity_north, state.velocity_east, turn)
            state = state._replace(velocity_north=v_x, velocity_east=v_y, heading=heading_in(self.wind, v_x, v_y))
        return state


def turned(v_x: float, v_y: float, turn: float) -> tuple[float, float]:
    """A velocity turned by this angle, rad, clockwise."""
    c, s = math.cos(turn), math.sin(turn)
    return c * v_x - s * v_y, s * v_x + c * v_y


def heading_in(wind: tuple[float, float], velocity_north: float, velocity_east: float) -> float:
    """psi_a, rad: the direction of (ground velocity - wind), all m/s."""
    W_x, W_y = wind
    return math.atan2(velocity_east - W_y, velocity_north - W_x)


class Sighting(NamedTuple):
    """The settings that decide the estimates of a flight, without plant and law. Fields as in `Flight`."""

    estimator: Estimator
    target: Target
    seed: int
    step: float
    guidance_period: float
    periods: int


def sighting(flight: Flight) -> Sighting:
    """The `Sighting` of this flight."""
    return Sighting._make(getattr(flight, name) for name in Sighting._fields)


class Estimation:
    """The sensor and the filter of one flight: the estimated target at each guidance step.

    `rows` holds one tuple per guidance step, for the log, and for some steps to come: the filter's `Estimate`, then the
    latest innovation (NaN in a step without a new measurement). A lost measurement is drawn as well, so that the others
    keep their noise.
    """

    def __init__(self, of: Sighting) -> None:
        self.rows: list[tuple[float, ...]] = []
        self._target = of.target.start()  # at any time: measurements may fall between two guidance steps
        self._measure, self._filter = sensor(of.estimator, of.seed), of.estimator.start()
        self._is_lost = losses(of.estimator, of.seed)
        self._step, self._period = of.step, of.estimator.period
        self._steps_per_guidance = round(of.guidance_period / of.step)
        self._steps_per_measurement = round(of.estimator.period / of.step)
        self._last = of.periods
        self._end: End | None = None  # how the filter ended, after the last of the rows
        self._measurements = 0  # due so far, with the lost ones; the next one has this number

    def at(self, k: int, truth: TargetState) -> TargetState:
        """The estimated target at the k-th guidance step, after all measurements due by then; SI, rad, north-east.

        Its acceleration and turn rate are 0, for the filter estimates neither. `truth`, the target at this moment, is
        not used: the sensor measures at its own instants, counted in simulation steps. Raises `End` when the filter
        fails or diverges: that is an outcome of the flight.
        """
        if k >= len(self.rows) and self._end is None:
            self._work_ahead(k)
        if k >= len(self.rows) and self._end:
            raise self._end
        return TargetState(*self.rows[k][:4])

    def _work_ahead(self, k: int) -> None:
        """Makes the rows up to the k-th and some more, until the flight or the filter ends.

        No aircraft is in them. In turn with JSBSim, which takes the processor's cache, a filter takes twice the time.
        """
        try:
            for row in range(len(self.rows), min(k + _AHEAD, self._last) + 1):
                self.rows.append(self._row(row))
        except End as end:
            self._end = end

    def _row(self, k: int) -> tuple[float, ...]:
        now, innovation = k * self._steps_per_guidance, NO_MEASUREMENT
        try:
            while self._measurements * self._steps_per_measurement <= now:
                time = self._measurements * self._period
                measured = self._measure(self._target(time))
                if self._is_lost(time) and self._measurements:
                    self._filter.miss()
                else:
                    innovation = self._filter.update(measured)
                self._measurements += 1
            age = (now - (self._measurements - 1) * self._steps_per_measurement) * self._step
            estimate = self._filter.at(age)
        except Exception as error:
            raise End(Outcome.INVALID, f"the estimator raised {type(error).__name__}: {error}") from error
        if not all(map(math.isfinite, estimate)):
            raise End(Outcome.INVALID, "the estimator diverged: a number of its estimate is not finite")
        return (*estimate, *innovation)


def losses(estimator: Estimator, seed: int) -> Callable[[float], bool]:
    """Whether the next measurement, due at this time, s, is lost; to be called for each in turn.

    What is lost at random depends on `seed` and the number of the measurement alone.
    """
    draw, begin, end = stream(seed, "lost measurements"), estimator.lost_from, estimator.lost_from + estimator.lost_for

    def is_lost(time: float) -> bool:
        return bool(draw.random() < estimator.lost_share) or begin <= time < end

    return is_lost


def perfect_estimator(settings: Estimator) -> Callable[[int, TargetState], TargetState]:
    """The estimator of `kind = "truth"`: the true target, with 0 for each part that `settings` calls unknown."""
    unknown = {f"target_{name}": 0.0 for name in ("acceleration", "turn_rate") if getattr(settings, name) == "unknown"}
    if unknown:
        return lambda k, truth: truth._replace(**unknown)
    return lambda k, truth: truth


def sensor(estimator: Estimator, seed: int) -> Callable[[TargetState], Measurement]:
    """The sensor: from the true target to a noisy range (m) and azimuth (rad, clockwise from north).

    The noise is white and Gaussian, with the variances of `estimator`; it depends on `seed` alone.
    """
    noise, position = stream(seed, "sensor"), estimator.sensor_position
    range_deviation, azimuth_deviation = math.sqrt(estimator.range_variance), math.sqrt(estimator.azimuth_variance)

    def measure(truth: TargetState) -> Measurement:
        exact = measurement(truth.target_north, truth.target_east, *position)
        in_range, in_azimuth = noise.standard_normal(2).tolist()
        return Measurement(exact.range + range_deviation * in_range, exact.azimuth + azimuth_deviation * in_azimuth)

    return measure
