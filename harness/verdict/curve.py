"""A curve: metrics over the one numeric setting that varies, with the intervals of the means."""

import math
from collections.abc import Mapping, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
import pandas as pd

from harness.verdict.comparison import Comparison
from harness.verdict.flown import TOLD
from harness.verdict.pairs import is_drawn, ordered, shown, spread
from harness.verdict.statistics import sample


class Point(NamedTuple):
    """The flights of one value of the setting: mean and 95 % interval, NaN where there is none."""

    x: float
    mean: float
    low: float
    high: float
    keys: tuple[str, ...]


class CurveSet(NamedTuple):
    """The flights at the same values of all other axes."""

    axis: str
    at: Mapping[str, object]  # the other axes
    lines: Mapping[str, Mapping[str, Sequence[Point]]]  # value of what is compared -> metric of `TOLD` -> its points


def curves(comparison: Comparison) -> list[CurveSet]:
    """A set of curves for each combination of the other axes; empty unless one numeric axis varies."""
    flights = spread(comparison.table)
    if comparison.by not in flights:
        flights[comparison.by] = comparison.table[comparison.by]
    values = {axis: ordered(flights[axis]) for axis in (*comparison.axes, comparison.by)}
    numeric = [axis for axis, of in values.items() if all(isinstance(value, int | float) for value in of)]
    if len(numeric) != 1:
        return []
    (axis,) = numeric
    fixed = [name for name in comparison.axes if name != axis]
    found = []
    for at in product(*(values[name] for name in fixed)):
        there = flights
        for name, value in zip(fixed, at, strict=True):
            there = there[there[name].map(shown) == shown(value)]
        if len(there):
            several = {} if comparison.by == axis else {shown(value): value for value in values[comparison.by]}
            of = {name: there[there[comparison.by] == value] for name, value in several.items()} or {"": there}
            lines = {name: _line(rows, axis) for name, rows in of.items() if len(rows)}
            found.append(CurveSet(axis, dict(zip(fixed, at, strict=True)), lines))
    return found


def _line(flights: pd.DataFrame, axis: str) -> dict[str, list[Point]]:
    return {metric: [_point(x, flights[flights[axis] == x], metric) for x in ordered(flights[axis])] for metric in TOLD}


def _point(x: object, rows: pd.DataFrame, metric: str) -> Point:
    of = sample(rows[metric].to_numpy(np.float64), rows["seed"].to_numpy(), drawn=is_drawn(rows))
    low, high = of.interval() or (math.nan, math.nan)
    return Point(float(str(x)), of.mean, low, high, tuple(rows["key"]))
