"""A map: one metric over two numeric axes, a cell for each combination that was flown."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from harness.error import did_you_mean
from harness.log.metric import METRICS, YES_OR_NO
from harness.tables import number, table
from harness.verdict.comparison import Comparison
from harness.verdict.pairs import CompareError, is_ordered, ordered, shown, spread

DEFAULT = ("chatters", "range_error_rms_m")  # drawn by default
ROUNDING = 1e-6  # smaller ranges of a metric are rounding, and no map is drawn
BEYOND = "*"  # marks a cell in which a limit cycle is predicted
_MOST_GRIDS = 12
_FLOWN = 0.25  # least share of a grid's cells that must be flown: points of maps and searches are on no grid


@dataclass(frozen=True, slots=True)
class GridCell:
    """The flights of one combination: the median of the metric, or the share of yes; NaN where it is not known."""

    value: float
    margin: float  # to the predicted limit cycle; NaN where it is not known
    keys: tuple[str, ...]

    @property
    def beyond(self) -> bool:
        """Whether a limit cycle is predicted."""
        return self.margin < 1.0


@dataclass(frozen=True, slots=True)
class Grid:
    """One metric by two axes, of the flights that are alike in everything else."""

    metric: str
    at: Mapping[str, object]  # what is the same in all cells, of what varies
    rows: tuple[str, Sequence[object]]  # axis and values
    columns: tuple[str, Sequence[object]]
    cells: Mapping[tuple[object, object], GridCell]

    @property
    def title(self) -> str:
        metric = METRICS[self.metric]
        unit = " (share of flights)" if metric.unit == YES_OR_NO else ""
        where = ", ".join(f"{axis} = {shown(value)}" for axis, value in self.at.items())
        return f"{self.metric}{unit}" + (f" at {where}" if where else "")

    def shade(self, cell: GridCell) -> float:
        """How far up its value lies between the smallest of the map and the largest, 0 to 1."""
        known = [each.value for each in self.cells.values() if not math.isnan(each.value)]
        reach = max(known) - min(known) if known else 0.0
        return (cell.value - min(known)) / reach if reach > ROUNDING and not math.isnan(cell.value) else 0.0

    def text(self, cell: GridCell | None) -> str:
        """The text of a cell."""
        return "" if cell is None else number(None if math.isnan(cell.value) else cell.value)


def grids(comparison: Comparison, metric: str) -> list[Grid]:
    """A map for each value of what is compared, and of the other axes, by the two numeric axes of most values.

    Empty where fewer than two numeric axes vary. Raises `CompareError` for an unknown metric.
    """
    return maps(comparison.table, comparison.axes, metric, [comparison.by])


def maps(
    entered: pd.DataFrame, axes: Mapping[str, Sequence[object]], metric: str, others: Sequence[str] = ()
) -> list[Grid]:
    """The grid of flights as they enter a comparison, and the axes that vary; `others` are separated as well."""
    if metric not in METRICS:
        hint = did_you_mean(metric, METRICS)
        raise CompareError(f"no metric has the name {metric!r}{hint}; see `harness list metrics`")
    flights = spread(entered)
    flights = flights.assign(**{name: entered[name] for name in others if name not in flights})
    values = {axis: ordered(flights[axis]) for axis in (*axes, *others)}
    numeric = sorted((axis for axis in values if is_ordered(values[axis])), key=lambda axis: -len(values[axis]))[:2]
    if len(numeric) < 2:
        return []
    first, second = sorted(numeric)
    fixed = [axis for axis in values if axis not in numeric]
    places = {axis: {shown(value): i for i, value in enumerate(values[axis])} for axis in fixed}
    by_place: dict[tuple[int, ...], list[int]] = {}  # of combinations that were flown: of many axes they are few
    for row, flight in enumerate(flights[fixed].itertuples(index=False)):
        by_place.setdefault(tuple(places[a][shown(v)] for a, v in zip(fixed, flight, strict=True)), []).append(row)
    found = []
    for place in sorted(by_place):
        there = flights.iloc[by_place[place]]
        at = {axis: values[axis][i] for axis, i in zip(fixed, place, strict=True)}
        cells = {(row, column): _cell(rows, metric) for (row, column), rows in there.groupby([first, second])}
        rows, columns = ((axis, ordered(there[axis])) for axis in (first, second))
        if len(cells) >= _FLOWN * len(rows[1]) * len(columns[1]):
            found.append(Grid(metric, at, rows, columns, cells))
    return found


def answering(comparison: Comparison) -> list[Grid]:
    """The maps at the value furthest from the baseline; none of limit cycles where none shows."""
    return [
        each
        for metric in DEFAULT
        for each in grids(comparison, metric)
        if comparison.by not in each.at or shown(each.at[comparison.by]) == comparison.values[-1]
        if any(cell.value > 0.0 for cell in each.cells.values())
    ]


def _cell(rows: pd.DataFrame, metric: str) -> GridCell:
    known = rows[metric].dropna()
    typical = known.mean() if METRICS[metric].unit == YES_OR_NO else known.median()
    margins = rows["limit_cycle_margin"].dropna() if "limit_cycle_margin" in rows else known[:0]
    return GridCell(
        float(typical) if len(known) else math.nan,
        float(margins.iloc[0]) if len(margins) else math.nan,
        tuple(rows["key"]),
    )


def lines(found: Sequence[Grid]) -> Iterator[str]:
    """Maps for a terminal."""
    for grid in found[:_MOST_GRIDS]:
        (down, rows), (across, columns) = grid.rows, grid.columns
        yield ""
        yield f"{grid.title}; {down} down, {across} across:"
        body = [[shown(row), *(_marked(grid, grid.cells.get((row, column))) for column in columns)] for row in rows]
        yield from (f"  {line}" for line in table(["", *(f"{shown(column)} " for column in columns)], body, "r"))
    if len(found) > _MOST_GRIDS:
        yield f"... and {len(found) - _MOST_GRIDS} more maps: choose with --where KEY=VALUE"
    if any(cell.beyond for grid in found for cell in grid.cells.values()):
        yield f"{BEYOND} a limit cycle is predicted behind the airframe's inner loop (`harness predict`)"


def _marked(grid: Grid, cell: GridCell | None) -> str:
    return f"{grid.text(cell)}{BEYOND if cell and cell.beyond else ' '}"
