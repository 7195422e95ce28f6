"""The size of a matrix before it is flown: every mistake in it, its warnings, how long it takes."""

from collections.abc import Iterator
from dataclasses import dataclass, field

from harness.checks import try_start
from harness.feasibility import warnings
from harness.flight import Flight
from harness.plants.plant import PlantError
from harness.runs.matrix import Combination, Matrix
from harness.runs.wall_time import typical_wall_time
from harness.settings import SettingsError

_ROW_BYTES = 4500  # in the journal and in flights.parquet
_RECORDED_BYTES = 450  # per guidance period, in a recording
_MOST_MISTAKES = 20
_MOST_STARTS = 200  # that are tried out before flying; more, and what cannot start becomes a row


@dataclass(slots=True)
class Survey:
    """The size of a matrix. Counts are of flights."""

    flights: int = 0
    random: int = 0  # whose seed matters
    seconds: float = 0.0  # estimated, of one process
    periods: int = 0  # guidance periods, of all flights together
    mistakes: list[str] = field(default_factory=list)
    varies: dict[str, int] = field(default_factory=dict)  # the number of values of each axis
    warnings: dict[str, int] = field(default_factory=dict)  # how many flights each is about

    @property
    def idle_seeds(self) -> int:
        """How many seeds there are that change nothing; 0 when they do, or there is one."""
        seeds = self.varies.get("seed", 1)
        return seeds if seeds > 1 and self.flights and not self.random else 0


def disk(found: Survey, recorded: int) -> float:
    """Bytes of the results, when so many flights are recorded."""
    each = found.periods / found.flights * _RECORDED_BYTES if found.flights else 0.0
    return found.flights * _ROW_BYTES + min(recorded, found.flights) * each


def survey(matrix: Matrix, limit: int | None = None, done: frozenset[int] = frozenset()) -> Iterator[Survey]:
    """Goes through the matrix but for what is done, and yields the survey so far now and then, at last the whole.

    Raises `SettingsError` at the end with the mistakes that it found.
    """
    found = Survey(varies={key: count for key, count in matrix.varies.items() if count > 1})
    seen, starts = _Seen(), set[object]()
    for position in range(matrix.positions):
        if limit is not None and found.flights >= limit:
            break
        if position in done:
            found.flights += 1
            continue
        combination = matrix.at(position)
        if combination is None:
            continue
        found.flights += 1
        try:
            one = seen.get(matrix, combination)
            if one.start not in starts and len(starts) < _MOST_STARTS:
                starts.add(one.start)
                _try_start(matrix, combination)
        except SettingsError as error:
            found.mistakes += [line for line in error.lines if line not in found.mistakes]
            if len(found.mistakes) >= _MOST_MISTAKES:
                break
            continue
        for warning in one.warnings:
            found.warnings[warning] = found.warnings.get(warning, 0) + 1
        found.random += one.random or bool(matrix.draws)
        found.seconds += one.seconds
        found.periods += one.periods
        if found.flights % 500 == 0:
            yield found
    if found.mistakes:
        more = ["... and perhaps more"] if len(found.mistakes) >= _MOST_MISTAKES else []
        raise SettingsError([*found.mistakes[:_MOST_MISTAKES], *more])
    yield found


@dataclass(frozen=True, slots=True)
class _One:
    """What one flight comes to."""

    warnings: tuple[str, ...]
    random: bool
    seconds: float
    periods: int
    start: object  # equal for flights that start alike


class _Seen:
    """Flights that differ in the seed alone come to the same, so they are looked at once."""

    def __init__(self) -> None:
        self._known: dict[str, _One] = {}
        self._seeds: set[object] = set()

    def get(self, matrix: Matrix, combination: Combination) -> _One:
        seed = repr(combination.values.get("seed"))
        if matrix.draws or "seed" not in combination.values:
            return _one(matrix.flight(combination))
        others = repr([(key, value) for key, value in combination.values.items() if key != "seed"])
        if others not in self._known or seed not in self._seeds:
            self._known[others] = _one(matrix.flight(combination))
            self._seeds.add(seed)
        return self._known[others]


def _one(flight: Flight) -> _One:
    random = flight.estimator.filters or flight.wind.turbulence != "none"
    start = (flight.plant, flight.aircraft, flight.step, flight.start.airspeed, flight.start.altitude)
    return _One(tuple(warnings(flight)), random, typical_wall_time(flight), flight.periods, start)


def _try_start(matrix: Matrix, combination: Combination) -> None:
    """Raises `SettingsError` when the flight cannot start."""
    flight = matrix.flight(combination)
    try:
        try_start(flight)
    except PlantError as error:
        raise SettingsError([f"{matrix.located(combination).locate(error.key)}: {error}"]) from None
