"""The summary at the end of a run: one line for each combination of the axes, over all its seeds."""

import json
import statistics
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from harness.log.metric import METRICS, YES_OR_NO
from harness.plants.plant import Outcome
from harness.runs.journal import reading
from harness.runs.matrix import Matrix
from harness.settings.columns import by_column
from harness.settings.laws import is_own, short_names


class Line(NamedTuple):
    """Flights that differ only in the seed and in what is drawn from it."""

    labels: tuple[str, ...]  # the value of each axis
    outcomes: Mapping[str, int]  # the number of flights by outcome
    settled: int  # the number of flights that converged
    medians: Mapping[str, float | None]  # by metric, over the flights that have it; the share of yes for yes or no

    @property
    def flights(self) -> int:
        return sum(self.outcomes.values())


class Failure(NamedTuple):
    """How a flight failed."""

    outcome: Outcome
    reason: str


class Summary(NamedTuple):
    """Results by the axes of a matrix."""

    axes: Sequence[str]  # keys that vary together are joined by commas
    lines: Sequence[Line]  # in the order of the matrix
    more: int  # the number of lines left out
    failures: Counter[Failure]  # in all lines


def summary(matrix: Matrix, folder: Path, most: int) -> Summary:
    """The results of the matrix so far, in at most `most` lines."""
    axes = _axes(matrix)
    keys = [axis.split(", ") for axis in axes]
    groups: dict[tuple[str, ...], _Group] = {}
    left_out: set[tuple[str, ...]] = set()
    failures: Counter[Failure] = Counter()
    with reading(folder) as journal:
        rows = journal.execute(
            "SELECT p.position, f.outcome, f.reason, f.settings, f.metrics FROM positions p JOIN flights f USING (key) "
            "WHERE p.matrix = ? ORDER BY p.position",
            (matrix.identifier,),
        )
        for position, outcome, reason, settings, metrics in rows:
            if Outcome(outcome).failed:
                failures[Failure(Outcome(outcome), reason)] += 1
            columns = by_column(json.loads(settings))
            combination = matrix.at(position)
            columns |= dict.fromkeys(combination.drawn if combination else (), "drawn")
            labels = tuple(" ".join(_text(columns.get(key)) for key in together) for together in keys)
            if labels not in groups and len(groups) == most:
                left_out.add(labels)
            else:
                groups.setdefault(labels, _Group()).add(outcome, json.loads(metrics))
    laws = short_names(label for labels in groups for label in labels if is_own(label))
    lines = [group.line(tuple(laws.get(label, label) for label in labels)) for labels, group in groups.items()]
    return Summary(axes, lines, len(left_out), failures)


class _Group:
    def __init__(self) -> None:
        self._outcomes: dict[str, int] = {}
        self._values: dict[str, list[float]] = {name: [] for name, m in METRICS.items() if m.in_short_tables}

    def add(self, outcome: str, metrics: Mapping[str, float | bool | None]) -> None:
        self._outcomes[outcome] = self._outcomes.get(outcome, 0) + 1
        for name, values in self._values.items():
            if (value := metrics.get(name)) is not None:
                values.append(value)

    def line(self, labels: tuple[str, ...]) -> Line:
        medians = {name: _typical(name, values) if values else None for name, values in self._values.items()}
        return Line(labels, self._outcomes, len(self._values["convergence_time_s"]), medians)


def _typical(metric: str, values: Sequence[float]) -> float:
    """The median of a metric's values; of a yes-or-no metric the share of yes."""
    return statistics.fmean(values) if METRICS[metric].unit == YES_OR_NO else statistics.median(values)


def _axes(matrix: Matrix) -> list[str]:
    """The axes that vary, without the seed and without keys that are drawn."""
    several = len(matrix.blocks) > 1  # an included flight may differ from the matrix in a key of one value
    left_out = {"seed", *matrix.draws}
    return [keys for keys, count in matrix.varies.items() if (several or count > 1) and keys not in left_out]


def _text(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list):
        return f"[{', '.join(map(_text, value))}]"
    return "-" if value is None else str(value)
