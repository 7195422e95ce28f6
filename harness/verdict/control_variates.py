"""Means and shares of the highest plant, with a cheaper plant of many more seeds as a control variate.

The seeds that both plants flew say how far the two go together; the further seeds of the cheap one say its mean. A mean
is corrected by a coefficient times what the cheap plant's mean of the common seeds is off. The coefficient of a seed is
estimated from the other seeds alone, so the correction is unbiased. Of a share the coefficient is one: the cheap share,
plus the flights that only the one has, minus those that only the other has.

Each part has an interval of its own, and half-widths are added in squares (MOVER: Zou and Donner, *Construction of
confidence limits about effect measures*, Statistics in Medicine 27, 2008). A flight that only the one plant has is none
that only the other has, so the more there are of the one the fewer there are of the other: a correlation of two cells
of a multinomial, which widens the interval of their difference.
"""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import pandas as pd

from harness.log.metric import METRICS
from harness.plants.ladder import rung
from harness.tables import number, table
from harness.verdict.pairs import (
    FAILED,
    SHARES,
    CompareError,
    Pairs,
    axes,
    cells,
    is_share,
    ordered,
    pairs,
    settings_of,
    shown,
    spread,
)
from harness.verdict.statistics import Array, Sample, Share, sample, share

LEAST_SAVED = 2.0  # a smaller factor is not worth another number
LEAST_SEEDS = 12  # on both plants: of fewer the coefficient knows too little
ALIGNMENT = "lllrrllrr"  # of the columns of `row`


class Interval(NamedTuple):
    """A mean or a share, with its 95 % interval."""

    mean: float
    low: float
    high: float

    @property
    def width(self) -> float:
        return self.high - self.low


class Controlled(NamedTuple):
    """The interval of a plant's own flights, and the one with a control variate."""

    plain: Interval
    reduced: Interval


def mean_with(y: Array, x: Array, further: Array) -> Controlled | str:
    """The mean of y, whose control x was drawn with it, and `further` alone. One value per seed; else why not."""
    n, m = len(y), len(further)
    plain, known = Sample(y, n, drawn=True), Sample(further, m, drawn=True)
    apart, off = x - x.mean(), y - y.mean()
    squares, products = ((a @ b - n / (n - 1) * a * b) for a, b in ((apart, apart), (apart, off)))  # without each seed
    if not plain.varies or squares.min() <= 1e-9 * (apart @ apart):
        return "the same in every flight" if not plain.varies else "the control hardly varies"
    slopes = products / squares * m / (n + m)  # least variance: the further seeds say no exact mean either
    corrected = Sample(y - slopes * (x - known.mean), n, drawn=True)
    own, rest, its = plain.interval(), corrected.interval(), known.interval()
    if own is None or rest is None or its is None or not corrected.varies:
        return "too few seeds, or no scatter, for an interval"
    slope = float(slopes.mean())
    below, above = sorted(slope * (end - known.mean) for end in its)
    mean = corrected.mean
    reduced = Interval(mean, mean - math.hypot(mean - rest[0], below), mean + math.hypot(rest[1] - mean, above))
    return Controlled(Interval(plain.mean, *own), reduced)


def share_with(y: Array, x: Array, further: Array) -> Controlled:
    """The same of a share: 1 for a flight that has it, 0 for one that has it not."""
    own, its, only_y, only_x = (
        share(of, np.arange(len(of)), drawn=True) for of in (y == 1.0, further == 1.0, y > x, x > y)
    )
    mean = its.share + only_y.share - only_x.share
    below = _added(its.share - its.low, only_y.share - only_y.low, only_x.high - only_x.share, only_y, only_x)
    above = _added(its.high - its.share, only_y.high - only_y.share, only_x.share - only_x.low, only_y, only_x)
    reduced = Interval(*(min(1.0, max(0.0, p)) for p in (mean, mean - below, mean + above)))
    return Controlled(Interval(own.share, own.low, own.high), reduced)


def _added(its: float, own: float, other: float, only_y: Share, only_x: Share) -> float:
    """Half-widths of the cheap share and of two that exclude each other, added in squares with their correlation."""
    odds = [each.share / (1.0 - each.share) if each.share < 1.0 else 0.0 for each in (only_y, only_x)]
    return math.sqrt(its * its + own * own + other * other + 2.0 * math.sqrt(math.prod(odds)) * own * other)


@dataclass(frozen=True, slots=True)
class Reduced:
    """One metric in one cell: what the flights of the plant alone say, and what they say with a control variate."""

    metric: str
    aircraft: str
    at: Mapping[str, object]  # the cell: axis -> value
    plant: str
    control: str  # the cheap plant
    seeds: int  # on both plants
    further: int  # seeds on the cheap one alone
    cost: float = 1.0  # wall time of all the flights, over that of the plant's own
    of: Controlled | None = None
    why: str = ""  # there is none

    @property
    def factor(self) -> float:
        """How many times the flights would give the plain interval the width of the other; NaN where there is none."""
        if self.of is None:
            return math.nan
        width = self.of.reduced.width
        return (self.of.plain.width / width) ** 2 if width else math.inf

    @property
    def factor_of_time(self) -> float:
        """The same in time: what the cheap flights took counts."""
        return self.factor / self.cost

    @property
    def saves(self) -> bool:
        return self.factor >= LEAST_SAVED

    @property
    def rank(self) -> tuple[float, int, int]:
        """The better, the higher."""
        return (0.0 if math.isnan(self.factor) else self.factor, self.further, rung(self.control))


def reductions(flights: pd.DataFrame) -> list[Reduced]:
    """Every metric in every cell, with the cheap plant that does best. Of flights as they enter a comparison.

    Raises `CompareError` where no flight can serve as a control.
    """
    flights = flights[~flights["outcome"].isin(FAILED)].reset_index(drop=True)
    *cheap, plant = ordered(flights["plant"])
    if not cheap:
        raise CompareError(f"--variance-reduction: all flights have plant = {plant}: fly a cheaper plant, too")
    found = []
    for aircraft, of_one in flights[flights["plant"] == plant].groupby("aircraft", sort=False):
        rows = of_one.reset_index(drop=True)
        for cell in cells(Pairs(rows, rows, rows[:0]), axes(spread(rows), ("plant", "aircraft"))):
            here = rows.iloc[cell.rows]
            controls = {str(control): _cheap(here, flights, str(control)) for control in cheap}
            for column in (*(name for name, metric in METRICS.items() if metric.compared), *SHARES):
                tried = [
                    _reduced(Reduced(column, str(aircraft), cell.at, str(plant), control, 0, 0), *rows_of_both)
                    for control, rows_of_both in controls.items()
                ]
                found.append(max(tried, key=lambda each: each.rank))
    return found


class Saved(NamedTuple):
    """What is saved where, and what is not, in words."""

    summary: str
    headings: Sequence[str]
    rows: Sequence[Sequence[str]]  # where it saves
    legend: str
    others: Sequence[tuple[int, str]]  # how many are not done, and why
    advice: str  # what to fly so that something is saved; empty where something could be told


def told(found: Sequence[Reduced], folder: str) -> Saved:
    """Of flights of one highest plant in this folder; `found` is not empty."""
    plant = found[0].plant
    saving = [each for each in found if each.saves]
    why = Counter(each.why or f"saves less than a factor of {LEAST_SAVED:g}" for each in found if not each.saves)
    return Saved(
        f"Means and shares of {plant}, alone and with a cheaper plant as a control variate: in {len(saving)} of "
        f"{len(found)} (a metric in a cell) this saves a factor of {LEAST_SAVED:g} or more of {plant} flights.",
        headings(plant),
        [row(each) for each in saving],
        f"Flights: how many times the flights of {plant} would make its own interval as narrow. Time: the same, "
        "with the time that the cheaper flights took; below 1 more flights of its own are the quicker way.",
        [(count, reason) for reason, count in why.most_common()],
        ""
        if any(each.of for each in found)
        else "A control variate needs both plants with the same seeds, and the cheaper one with more: fly the file "
        f"into {folder} again, with --set plant=CHEAPER --set 'seed={{start=FIRST_NEW, count=MANY}}'.",
    )


def lines(found: Sequence[Reduced], folder: str) -> Iterator[str]:
    """The same for a terminal."""
    if not found:
        return
    what = told(found, folder)
    yield what.summary
    if what.rows:
        yield ""
        yield from table(what.headings, what.rows, ALIGNMENT)
        yield ""
        yield what.legend
    if what.others:
        yield "Not done:"
        yield from (f"  {count}: {reason}" for count, reason in what.others)
    if what.advice:
        yield what.advice


def headings(plant: str) -> list[str]:
    """Over the columns of `row`."""
    return ["metric", "cell", "control", "seeds", "further", f"{plant} alone", "with control", "flights", "time"]


def row(of: Reduced) -> list[str]:
    """A line of the table, of one that has both intervals."""
    cell = ", ".join([of.aircraft, *(f"{axis} = {shown(value)}" for axis, value in of.at.items())])
    intervals = [f"{number(i.mean)} [{number(i.low)}, {number(i.high)}]" for i in of.of or ()]
    factors = [f"{factor:.3g}" for factor in (of.factor, of.factor_of_time)]
    return [of.metric, cell, of.control, str(of.seeds), str(of.further), *intervals, *factors]


def records(found: Sequence[Reduced]) -> list[dict[str, object]]:
    """All of them, fit for a table or for JSON."""
    return [
        {
            "metric": each.metric, "aircraft": each.aircraft, **each.at, "plant": each.plant, "control": each.control,
            "seeds": each.seeds, "further_seeds": each.further,
            "plain": each.of and each.of.plain._asdict(), "reduced": each.of and each.of.reduced._asdict(),
            "factor_of_flights": each.factor, "factor_of_time": each.factor_of_time, "why_not": each.why,
        }
        for each in found
    ]  # fmt: skip


def _cheap(here: pd.DataFrame, flights: pd.DataFrame, control: str) -> tuple[Pairs, pd.DataFrame]:
    """The flights of a cell beside those of a cheap plant, and the further ones: alike in all that is fixed there."""
    cheap = flights[flights["plant"] == control]
    for column in settings_of(here):
        values = here[column]
        if column not in ("plant", "seed") and values.nunique(dropna=False) == 1:
            value = values.iloc[0]
            cheap = cheap[cheap[column].isna() if value != value else [each == value for each in cheap[column]]]
    both = pd.concat([here, cheap], ignore_index=True)
    paired = pairs(both, ["plant"], both["plant"] == control)
    return paired, cheap[~cheap["seed"].isin(paired.other["seed"])]


def _reduced(of: Reduced, paired: Pairs, further: pd.DataFrame) -> Reduced:
    """With its numbers, or with why there are none."""
    metric, control = METRICS.get(of.metric), paired.reference
    keep, keep_further = np.ones(len(paired), bool), np.ones(len(further), bool)
    if metric is not None and metric.of_circling:  # the same event on the cheap plant says of which flights
        keep, keep_further = control["circles"].to_numpy(bool), further["circles"].to_numpy(bool)
    columns = {
        of.plant: (paired.other[keep], paired.seeds[keep]),
        of.control: (control[keep], paired.seeds[keep]),
        "": (further[keep_further], further["seed"].to_numpy()[keep_further]),
    }
    seconds = [float(rows["seconds"].sum()) for rows in (paired.other, control, further)]
    of = replace(
        of,
        seeds=len(set(paired.seeds[keep])),
        further=len(set(further["seed"][keep_further])),
        cost=sum(seconds) / seconds[0] if seconds[0] else 1.0,
    )
    if of.seeds < LEAST_SEEDS:
        return replace(of, why=f"{of.seeds} seeds on both plants; {LEAST_SEEDS} are needed")
    if of.further < LEAST_SEEDS:
        return replace(of, why=f"{of.further} further seeds on the cheap plant; {LEAST_SEEDS} are needed")
    values = []
    for plant, (rows, seeds) in columns.items():
        numbers = rows[of.metric].to_numpy(float)
        if np.isnan(numbers).any():
            return replace(of, why=f"some flights on {plant or of.control} have no such number")
        values.append(sample(numbers, seeds, drawn=True).means)
    if is_share(of.metric) and all(np.isin(each, (0.0, 1.0)).all() for each in values):
        return replace(of, of=share_with(*values))
    found = mean_with(*values)
    return replace(of, why=found) if isinstance(found, str) else replace(of, of=found)
