"""The size of a matrix before it is flown: every mistake in it, its warnings, how long it takes."""

import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field

from harness.feasibility import warnings
from harness.flight import Flight
from harness.runs.matrix import Combination, Matrix
from harness.runs.wall_time import typical_wall_time
from harness.settings import SettingsError
from harness.settings.laws import source_of
from harness.settings.tried import slowness

_ROW_BYTES = 4500  # in the journal and in flights.parquet
_RECORDED_BYTES = 450  # per guidance period, in a recording
_NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[-+]?\d+)?")
_MOST_MISTAKES = 50
_MOST_STARTS = 200  # tried before the run; beyond it, a flight that cannot start becomes a row of the run


@dataclass(slots=True)
class Warned:
    """A warning that flights share, but for the numbers in it."""

    text: str  # of the first of them
    flights: int = 0
    alike: bool = True  # whether all have the same numbers


@dataclass(slots=True)
class Survey:
    """The size and the warnings of a matrix. Counts are of flights."""

    flights: int = 0
    random: int = 0  # flights whose seed matters
    typical: dict[str, float] = field(default_factory=dict)  # s: wall time of the flights of each plant, in one process
    periods: int = 0  # guidance periods, of all flights together
    mistakes: list[str] = field(default_factory=list)
    varies: dict[str, int] = field(default_factory=dict)  # the number of values of each axis
    warnings: dict[str, Warned] = field(default_factory=dict)  # by their text without numbers
    examples: dict[object, Flight] = field(default_factory=dict)  # one flight of each kind that is compiled alike

    @property
    def idle_seeds(self) -> int:
        """The number of seeds, if there are several and none of them changes a flight; otherwise 0."""
        seeds = self.varies.get("seed", 1)
        return seeds if seeds > 1 and self.flights and not self.random else 0


def disk(total: Survey, recorded: int) -> float:
    """The size of the results in bytes, with `recorded` flights recorded."""
    each = total.periods / total.flights * _RECORDED_BYTES if total.flights else 0.0
    return total.flights * _ROW_BYTES + min(recorded, total.flights) * each


def survey(matrix: Matrix, limit: int | None = None, done: Collection[int] = ()) -> Iterator[Survey]:
    """Checks all flights of the matrix, which may be a draft, except those at the positions `done`.

    Yields the survey so far every 500 flights, and the complete survey at the end. Raises `SettingsError` at the end
    with all mistakes, or after the first `_MOST_MISTAKES`.
    """
    varies = {key: count for key, count in matrix.varies.items() if count > 1}
    total = Survey(mistakes=[*matrix.mistakes], varies=varies)
    seen, starts = _Seen(), set[object]()
    for position in range(matrix.positions):
        if limit is not None and total.flights >= limit:
            break
        if position in done:
            total.flights += 1
            continue
        combination = matrix.at(position)
        if combination is None:
            continue
        total.flights += 1
        try:
            flight = seen.get(matrix, combination)
            if flight.start not in starts and len(starts) < _MOST_STARTS:
                starts.add(flight.start)
                matrix.located(combination).flight(started=True)
        except SettingsError as error:
            total.mistakes += [line for line in error.lines if line not in total.mistakes]
            if len(total.mistakes) >= _MOST_MISTAKES:
                break
            continue
        for warning in flight.warnings:
            shared = total.warnings.setdefault(_NUMBER.sub("#", warning), Warned(warning))
            shared.flights += 1
            shared.alike &= warning == shared.text
        total.random += flight.random or bool(matrix.draws)
        total.typical[flight.plant] = total.typical.get(flight.plant, 0.0) + flight.seconds
        total.periods += flight.periods
        total.examples.setdefault(flight.kind, flight.flight)
        if total.flights % 500 == 0:
            yield total
    if total.mistakes:
        more = ["... and perhaps more"] if len(total.mistakes) >= _MOST_MISTAKES else []
        raise SettingsError([*sorted(total.mistakes[:_MOST_MISTAKES], key=matrix.file.order), *more])
    yield total


@dataclass(frozen=True, slots=True)
class _FlightSurvey:
    """The survey of one flight."""

    warnings: tuple[str, ...]
    random: bool
    plant: str
    seconds: float
    periods: int
    start: object  # equal for flights that have the same start
    kind: object  # equal for flights that are compiled alike
    flight: Flight  # the first of those that are surveyed once


class _Seen:
    """Surveys by settings without the seed: flights that differ in the seed alone are surveyed once."""

    def __init__(self) -> None:
        self._known: dict[str, _FlightSurvey | None] = {}  # None for a flight that has a mistake
        self._seeds: set[object] = set()
        self._wrong = 0  # flights that have a mistake
        self._slow: dict[type, tuple[str, ...]] = {}  # remarks on the speed of a user-defined law

    def get(self, matrix: Matrix, combination: Combination) -> _FlightSurvey:
        """The survey of a flight. Raises `SettingsError` with its mistakes, of flights that are surveyed once."""
        seed = repr(combination.values.get("seed"))
        others = repr([(k, v) for k, v in combination.values.items() if k != "seed" and k not in combination.drawn])
        is_alone = bool(combination.drawn) or "seed" not in combination.values
        if others not in self._known or seed not in self._seeds or (is_alone and self._known[others]):
            self._seeds.add(seed)
            try:
                flight = matrix.flight(combination, started=self._wrong < _MOST_STARTS)
                if source_of(flight.law) and type(flight.law) not in self._slow:
                    self._slow[type(flight.law)] = tuple(slowness(flight))
                self._known[others] = _flight_survey(flight, self._slow.get(type(flight.law), ()))
            except SettingsError:
                self._known[others] = None
                self._wrong += 1
                raise
        known = self._known[others]
        if known is None:
            raise SettingsError([])
        return known


def _flight_survey(flight: Flight, slow: tuple[str, ...]) -> _FlightSurvey:
    errors = flight.errors
    random = flight.estimator.filters or flight.wind.turbulence != "none" or errors.course_noise > 0.0
    body = (flight.aircraft, errors.mass_scale, errors.cg_aft, errors.actuator_lag)
    kind = (flight.plant, type(flight.law), flight.estimator.filters, bool(errors.command_delay))
    start = (flight.plant, *body, flight.step, flight.start.airspeed, flight.start.altitude)
    return _FlightSurvey(
        (*warnings(flight), *slow), random, flight.plant, typical_wall_time(flight), flight.periods, start, kind, flight
    )
