"""The law's observations at each guidance step: measurements of its aircraft and the wind, and the estimated target."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from autopilot.estimator import Estimate, Estimator, Measurement, measurement
from harness.flight import Flight
from harness.plants.plant import End, Outcome
from harness.plants.state import State
from harness.world.randomness import stream
from harness.world.target import Target, TargetState

NO_MEASUREMENT = Measurement(math.nan, math.nan)
_AHEAD = 1000  # guidance steps that the filter works ahead
_ESTIMATED = len(Estimate._fields)


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

    A lost measurement is drawn as well, so that the others keep their noise.
    """

    def __init__(self, of: Sighting) -> None:
        self._of = of
        self._target = of.target.start()  # at any time: measurements may fall between two guidance steps
        self._measure, self._filter = sensor(of.estimator, of.seed), of.estimator.start()
        self._is_lost = losses(of.estimator, of.seed)
        self._steps_per_guidance = round(of.guidance_period / of.step)
        self._steps_per_measurement = round(of.estimator.period / of.step)
        self._known: list[tuple[float, ...]] = []  # by the filter, at each measurement so far, with the lost ones
        self._innovations: list[Measurement] = []
        self._table, self._made = np.empty((of.periods + 1, _ESTIMATED + len(Measurement._fields))), 0
        self._end: End | None = None  # how the filter ended, after the last of the rows

    @property
    def rows(self) -> NDArray[np.float64]:
        """A row per guidance step, for the log, and for some steps to come.

        The filter's `Estimate`, then the latest innovation: NaN in a step without a new measurement.
        """
        return self._table[: self._made]

    def at(self, k: int, truth: TargetState) -> TargetState:
        """The estimated target at the k-th guidance step, after all measurements due by then; SI, rad, north-east.

        Its acceleration and turn rate are 0, for the filter estimates neither. `truth`, the target at this moment, is
        not used: the sensor measures at its own instants, counted in simulation steps. Raises `End` when the filter
        fails or diverges: that is an outcome of the flight.
        """
        while self._made <= min(k, self._of.periods) and self._end is None:
            self._work_ahead()
        if k >= self._made and self._end:
            raise self._end
        return TargetState(*self._table[k, :4].tolist())

    def _work_ahead(self) -> None:
        """Makes the next rows, until the flight or the filter ends: in the same blocks, whoever asks for them.

        No aircraft is in them. In turn with JSBSim, which takes the processor's cache, a filter takes twice the time.
        """
        begin, end = self._made, min(self._made + _AHEAD, self._of.periods + 1)
        try:
            while self._row_of(len(self._known)) < end:
                self._take(len(self._known))
        except (Exception, SystemExit) as error:
            self._end, end = _raised(error), self._row_of(len(self._known))
        try:
            self._made = self._filled(begin, end) if begin < end else end
        except (Exception, SystemExit) as error:
            self._end = _raised(error)

    def _row_of(self, measurement: int) -> int:
        """The first guidance step that is not before this measurement."""
        return -(-measurement * self._steps_per_measurement // self._steps_per_guidance)

    def _take(self, number: int) -> None:
        """Takes the measurement of this number."""
        time, innovation = number * self._of.estimator.period, NO_MEASUREMENT
        measured = self._measure(self._target(time))
        if self._is_lost(time) and number:
            self._filter.miss()
            if self._row_of(number) == self._row_of(number - 1):
                innovation = self._innovations[-1]
        else:
            innovation = Measurement._make(self._filter.update(measured))
        known = tuple(self._filter.known)
        if len(known) != len(self._known[0] if self._known else known):
            raise ValueError(f"known has {len(known)} numbers now, and had {len(self._known[0])}")
        self._known.append(known)
        self._innovations.append(innovation)

    def _filled(self, begin: int, end: int) -> int:
        """Fills these rows up to the first whose estimate is not finite, and gives its number, or `end`."""
        now, each = np.arange(begin, end) * self._steps_per_guidance, self._steps_per_measurement
        latest = now // each
        is_new = latest > (now - self._steps_per_guidance) // each
        age, first = (now - latest * each) * self._of.step, latest[0]
        known = np.array(self._known[first:], dtype=np.float64)[latest - first].T
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            numbers = Estimate._make(self._filter.ahead([*known], age))
            estimate = np.stack(np.broadcast_arrays(*numbers, age)[:-1], axis=1, dtype=np.float64)
        rows = self._table[begin:end]
        rows[:, :_ESTIMATED], rows[:, _ESTIMATED:] = estimate, NO_MEASUREMENT
        rows[is_new, _ESTIMATED:] = np.array(self._innovations[first:])[latest[is_new] - first]
        fails = np.flatnonzero(~np.isfinite(estimate).all(axis=1))
        if not fails.size:
            return end
        self._end = End(Outcome.INVALID, "the estimator diverged: a number of its estimate is not finite")
        return begin + int(fails[0])


def _raised(error: BaseException) -> End:
    return End(Outcome.INVALID, f"the estimator raised {type(error).__name__}: {error}")


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
