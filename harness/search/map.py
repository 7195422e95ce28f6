"""A map of an answer over two settings, refined where it changes."""

import csv
import math
import statistics
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from harness.error import SettingsError
from harness.files import replacing
from harness.limit_cycle.predicted import predicted_margin
from harness.log.metric import METRICS, YES_OR_NO
from harness.plants.plant import Outcome
from harness.requirement import OUTCOME, Facts, RequirementError, requirement
from harness.runs.matrix import Combination
from harness.runs.run import Options, Progress
from harness.search.border import Answer, BorderSearch, Point, lines
from harness.search.dimension import Dimension, SearchError
from harness.search.flown import Candidate, fly_search
from harness.search.space import Space

CONVERGED = "converged"  # whether a flight has a convergence time
POINTS, BORDER = "points.csv", "border.csv"
MOST_PANELS = 12
LEAST, MOST = 10, 2000  # bounds of the resolution
_SHARE = 10  # default budget: one in ten of the full grid's flights,
_ROUNDS = 4  # or four times the first round, if that is more
_DIGITS = 7  # significant digits of a setting
_PREDICTED = 9  # points along each side, between which the predicted margin is interpolated


@dataclass(frozen=True, slots=True)
class Question:
    """The question that a map answers for each flight."""

    text: str
    answer: Callable[[Facts], Answer]
    is_number: bool

    def over(self, facts: Sequence[Facts]) -> Answer:
        """The combined answer of flights that differ only in their seed: the median, or the most frequent."""
        answers = [self.answer(fact) for fact in facts]
        (most, count), *_ = Counter(answers).most_common()
        if not self.is_number or (most is None and 2 * count >= len(answers)):
            return most
        return statistics.median(float(answer) for answer in answers if answer is not None)


def question(text: str) -> Question:
    """The question of a text: converged, outcome, a metric, or a requirement. Raises `SearchError`."""
    if text == CONVERGED:
        return Question(text, _of_result(lambda facts: facts.get("convergence_time_s") is not None), False)
    if text == OUTCOME:
        return Question(text, lambda facts: facts.get(OUTCOME), False)
    if metric := METRICS.get(text):
        is_number = metric.unit != YES_OR_NO
        known: Callable[[Facts], Answer] = lambda facts: facts.get(text)  # noqa: E731
        return Question(text, _of_result(known), is_number)
    try:
        asked = requirement(text)
    except RequirementError as error:
        allowed = f"must be {CONVERGED}, {OUTCOME}, a metric, or NAME OP VALUE"
        raise SearchError(f"--of {text!r}: {allowed}: {error}") from None
    if asked.is_foreseen:
        raise SearchError(f"--of {text!r}: {asked.name} is known without a flight: must be an outcome or a metric")
    return Question(str(asked), _of_result(asked.is_met), False)


def _of_result(answer: Callable[[Facts], Answer]) -> Callable[[Facts], Answer]:
    """The answer, but unknown for a flight whose computation failed."""
    return lambda facts: None if Outcome(str(facts[OUTCOME])).failed else answer(facts)


@dataclass(slots=True)
class MapPanel:
    """One combination of the matrix: its flights differ in the two settings, and in what is drawn from the seed."""

    at: Mapping[str, object]  # of what varies in the matrix
    conditions: Sequence[Combination]
    border: BorderSearch
    keys: dict[Point, Sequence[str]] = field(default_factory=dict)  # of the flights of a point
    refused: dict[Point, str] = field(default_factory=dict)  # why a point is no flight

    @property
    def flights(self) -> int:
        """How many were flown."""
        return sum(map(len, self.keys.values()))

    @property
    def open(self) -> int:
        """The number of squares in which the border is not located yet."""
        return sum(square.open for square in self.border.squares())


@dataclass(slots=True, kw_only=True)
class Map:
    """A search for the borders of an answer, and what it knows so far."""

    space: Space
    question: Question
    panels: Sequence[MapPanel]
    flights: int  # at most
    progress: Progress
    stopped: bool = False  # at this number, before the borders were located

    @property
    def x(self) -> Dimension:
        """The setting across."""
        return self.space.dimensions[0]

    @property
    def y(self) -> Dimension:
        """The setting upwards."""
        return self.space.dimensions[1]

    @property
    def full(self) -> int:
        """The flights of a full grid with the same steps."""
        return sum((panel.border.side + 1) ** 2 * len(panel.conditions) for panel in self.panels)

    def fly(self, folder: Path, options: Options) -> Iterator[Progress]:
        """Searches, and yields the progress at least a few times a second: see `fly_search`."""
        yield from fly_search(self.batches(), self.space.matrix, folder, options, self.progress)

    def batches(self) -> Iterator[Sequence[Candidate]]:
        """The flights of each round; a round is complete before the next one is requested."""
        for number in range(1, self.flights + 1):
            asked = [(panel, point) for panel in self.panels for point in panel.border.asked()]
            if not asked:
                return
            total = self.progress.total + sum(len(panel.conditions) for panel, _ in asked)
            if total > self.flights:
                self.stopped = True
                return
            batch = [(panel, point, made) for panel, point in asked if (made := self._candidate(panel, point))]
            self.progress.total += sum(len(made.flights) for *_, made in batch)
            self.progress.note = f"round {number}"
            if batch:
                yield [made for *_, made in batch]
            for panel, point, made in batch:
                panel.keys[point] = made.keys
                panel.border.answers[point] = self.question.over(made.facts)

    def values(self, panel: MapPanel, point: tuple[float, float]) -> Mapping[str, float]:
        """The two settings at a point."""
        shares = (step / panel.border.side for step in point)
        return {d.key: d.value(share, _DIGITS) for d, share in zip(self.space.dimensions, shares, strict=True)}

    def _candidate(self, panel: MapPanel, point: Point) -> Candidate | None:
        """The flights of a point; None where the settings refuse them, which is an unknown answer."""
        try:
            return self.space.candidate(self.values(panel, point), (), panel.conditions)
        except SettingsError as error:
            panel.refused[point] = error.lines[0]
            panel.border.answers[point] = None
            return None

    def predicted(self, panel: MapPanel) -> NDArray[np.float64] | None:
        """The margin to the predicted limit cycle, by row (y) and column (x) of evenly spread points; None: unknown."""
        side = panel.border.side
        steps = [side * i / (_PREDICTED - 1) for i in range(_PREDICTED)]
        margins = np.array([[self._margin(panel, (x, y)) for x in steps] for y in steps])
        return None if np.isnan(margins).all() else margins

    def _margin(self, panel: MapPanel, point: tuple[float, float]) -> float:
        try:
            (flight, *_) = self.space.candidate(self.values(panel, point), (), panel.conditions[:1]).flights
        except SettingsError:
            return math.nan
        margin = predicted_margin(flight)
        return math.nan if margin is None else margin

    def told(self, panel: MapPanel) -> str:
        """The share of each answer over the area of a panel, in words; for a number its least and largest."""
        filled = panel.border.filled().ravel().tolist()
        numbers = [answer for answer in filled if isinstance(answer, float)]
        counts = Counter(_word(answer) or "unknown" for answer in filled if not isinstance(answer, float))
        shares = [f"{word} {100 * count / len(filled):.1f} %" for word, count in counts.most_common()]
        return ", ".join([f"{min(numbers):.3g} to {max(numbers):.3g}", *shares] if numbers else shares)

    def write(self, folder: Path) -> list[Path]:
        """Writes the points that were flown and the located border as tables. Raises OSError."""
        axes, what = [self.x.key, self.y.key], list(dict.fromkeys(key for panel in self.panels for key in panel.at))
        points = []
        for panel in self.panels:
            for at, answer in sorted(panel.border.answers.items()):
                settings = [*map(panel.at.get, what), *self.values(panel, at).values()]
                points.append([*settings, _word(answer), " ".join(panel.keys.get(at, ()))])
        border = [
            [*map(panel.at.get, what), *self.values(panel, a).values(), *self.values(panel, b).values()]
            for panel in self.panels
            for a, b in lines(panel.border.squares())
        ]
        ends = [f"{key}_{end}" for end in ("from", "to") for key in axes]
        return [
            _table(folder / POINTS, [*what, *axes, self.question.text, "flights"], points),
            _table(folder / BORDER, [*what, *ends], border),
        ]


def map_of(space: Space, asked: Question, *, resolution: int, flights: int | None = None) -> Map:
    """A map, not begun. Raises `SearchError`."""
    if not LEAST <= resolution <= MOST:
        raise SearchError(f"--resolution is {resolution}, must be from {LEAST} to {MOST}")
    panels: dict[str, MapPanel] = {}
    for condition in space.conditions:
        at = {k: v for k, v in condition.values.items() if k != "seed" and k not in condition.drawn}
        panel = panels.setdefault(repr(at), MapPanel(at, [], BorderSearch.of(resolution)))
        panel.conditions = [*panel.conditions, condition]
    if len(panels) > MOST_PANELS:
        raise SearchError(f"the [matrix] has {len(panels)} combinations, and a map {MOST_PANELS} panels at most: --set")
    made = Map(space=space, question=asked, panels=list(panels.values()), flights=0, progress=Progress(0))
    first = sum(len(panel.border.first) * len(panel.conditions) for panel in made.panels)
    if flights is not None and flights < first:
        raise SearchError(
            f"--flights is {flights}, must be {first} at least, which is the first, coarse lattice"
            + (": with a smaller --resolution it has fewer points" if resolution > LEAST else "")
        )
    made.flights = flights or max(made.full // _SHARE, min(made.full, _ROUNDS * first))
    return made


def _table(path: Path, head: Sequence[str], rows: Sequence[Sequence[object]]) -> Path:
    with replacing(path) as partial, partial.open("w", encoding="utf-8", newline="") as text:
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(head)
        writer.writerows(rows)
    return path


def _word(answer: object) -> str:
    if isinstance(answer, bool):
        return "yes" if answer else "no"
    return "not located" if answer is ... else "" if answer is None else str(answer)
