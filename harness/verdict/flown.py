"""Outcomes and metrics of the flights of each combination of settings."""

from collections.abc import Iterator
from typing import NamedTuple

import pandas as pd

from harness.log.metric import METRICS
from harness.plants.ladder import PLANTS
from harness.settings.laws import loaded_kind
from harness.tables import number, table
from harness.verdict.comparison import Comparison
from harness.verdict.pairs import joined, ordered, shown, spread

TOLD = ("convergence_time_s", "range_error_rms_m", "saturation_fraction", "sideslip_rms_deg")  # beside the counts
MOST_LINES = 24
MOST_VALUES = 4  # listed one by one


class Shares(NamedTuple):
    """Flights that have something, of those of which it is known."""

    number: int
    of: int

    def __str__(self) -> str:
        return f"{self.number} of {self.of}" if self.of else "-"


class Flown(NamedTuple):
    """Flights that differ only in the seed and in what is drawn from it."""

    at: tuple[object, ...]  # the value of each axis
    flights: int
    lost: int
    converged: int
    cycling: Shares
    medians: tuple[float | None, ...]  # of `TOLD`
    keys: tuple[str, ...]


def gains_by_rule(flights: pd.DataFrame) -> Iterator[str]:
    """Which rule gave which numbers, a sentence for each gain set that follows from a rule."""
    if "law.gains" not in flights:
        return
    for (name, gains), rows in flights.groupby(["law.name", "law.gains"], sort=False):
        kind = loaded_kind(str(name))
        if kind is None or gains not in kind.rules:
            continue
        base = kind.numbers(str(gains))
        decided = [gain for gain in base if (rows[f"law.{gain}"] != base[gain]).any()]
        given = rows.drop_duplicates(["aircraft", *(f"law.{gain}" for gain in decided)])
        each = [_given_by_rule(row, decided) for _, row in given.iterrows()]
        more = f"; and {len(each) - MOST_VALUES} more" if len(each) > MOST_VALUES else ""
        rule = f"{gains}, from {kind.rules[str(gains)].base}"
        yield f"Gains of {name} by the rule {rule}: {'; '.join(each[:MOST_VALUES])}{more}."


def predicting(flights: pd.DataFrame) -> Iterator[str]:
    """The laws with a model of the inner loop, which is bypassed on the plants with an ideal inner loop."""
    at_once = [plant for plant in flights["plant"].unique() if plant in PLANTS and PLANTS[plant].at_once]
    kinds = {str(name): loaded_kind(str(name)) for name in flights["law.name"].unique()}
    laws = [name for name, kind in kinds.items() if kind and getattr(kind.value, "uses_response", False)]
    if laws and at_once and len(at_once) < flights["plant"].nunique():
        plants = " and ".join(at_once)
        yield f"Use a model of the inner loop, bypassed on {plants} (ideal inner loop): {', '.join(laws)}."


def _given_by_rule(row: pd.Series, decided: list[str]) -> str:
    numbers = ", ".join(f"{gain} = {number(row['law.' + gain])}" for gain in decided)
    circle = f"{number(row['start.airspeed_mps'])} m/s, circle of {number(row['law.standoff_m'])} m"
    return f"{numbers or 'unchanged'} ({row['aircraft']}, {circle})"


def combinations(comparison: Comparison) -> tuple[list[str], list[Flown]]:
    """The axes, what is compared among them, and every combination of their values that was flown, in order."""
    flights = spread(comparison.table)
    if comparison.by not in flights:
        flights[comparison.by] = comparison.table[comparison.by]
    axes = [*comparison.axes, comparison.by]
    ranks = {axis: {shown(value): i for i, value in enumerate(ordered(flights[axis]))} for axis in axes}
    groups = flights.groupby(joined(flights, axes), sort=False)
    found = [_combination(tuple(rows[axis].iloc[0] for axis in axes), rows) for _, rows in groups]
    found.sort(key=lambda each: [ranks[axis][shown(value)] for axis, value in zip(axes, each.at, strict=True)])
    return axes, found


def _combination(at: tuple[object, ...], rows: pd.DataFrame) -> Flown:
    return Flown(
        at, len(rows), int(rows["lost"].sum()), int(rows["converged"].sum()), _cycling(rows),
        tuple(float(known.median()) if len(known := rows[name].dropna()) else None for name in TOLD),
        tuple(rows["key"]),
    )  # fmt: skip


def _cycling(rows: pd.DataFrame) -> Shares:
    return Shares(int(rows["chatters"].sum()), int(rows["chatters"].notna().sum()))


def lines(comparison: Comparison) -> Iterator[str]:
    """A line for each combination, of as many as a screen holds."""
    axes, found = combinations(comparison)
    metrics = [METRICS[name] for name in TOLD]
    headings = [
        *(axis.replace(".", ".\n") for axis in axes), "flights", "lost", "converge", "in a limit\ncycle",
        *(metric.column_heading for metric in metrics),
    ]  # fmt: skip
    rows = [
        [
            *map(shown, each.at), str(each.flights), str(each.lost), str(each.converged), str(each.cycling),
            *(number(value, metric.scale) for value, metric in zip(each.medians, metrics, strict=True)),
        ]
        for each in found[:MOST_LINES]
    ]  # fmt: skip
    sides = "".join("l" if isinstance(value, str) else "r" for value in found[0].at)
    yield from table(headings, rows, f"{sides}r")
    if (more := len(found) - MOST_LINES) > 0:
        yield f"... and {more} more: choose with --where KEY=VALUE, or see the page of `harness report`"


def quiet(comparison: Comparison) -> Iterator[str]:
    """The number of flights without a limit cycle, for each value that is compared."""
    flights = comparison.table
    values = ordered(flights[comparison.by])
    if len(values) > MOST_VALUES:
        cycling = [("", _cycling(flights))]
    else:
        cycling = [
            (f" with {comparison.by} = {shown(value)}", _cycling(flights[flights[comparison.by] == value]))
            for value in values
        ]
    told = [f"{of.number} of {of.of}{which}" for which, of in cycling if of.of]
    if told:
        yield f"In a limit cycle, of the flights in which this can be decided: {', '.join(told)}."
