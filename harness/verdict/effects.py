"""The effect of each plant of the ladder, and of each disturbance: one condition at a time, no mean over several.

Along the ladder the same seeds count on every rung, so the steps add up to the whole. A disturbance is added alone to
the same flight without it; what it adds to the *difference* between two plants is the difference of what it adds to
each.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pandas as pd

from harness.plants.ladder import PLANTS, rung
from harness.verdict.pairs import UNDISTURBED, Pairs, axes, cells, ordered, pairs, settings_of, shown, spread
from harness.verdict.statistics import Sample, sample

COSTS = ("convergence_time_s", "range_error_rms_m", "saturation_fraction", "command_activity_deg_s2", "overshoot_m")


@dataclass(frozen=True, slots=True)
class Disturbance:
    """Something that a setting adds to the undisturbed flight."""

    name: str
    keys: tuple[str, ...]  # the settings that change with it, and nothing else
    axis: str  # the column of `spread` that says how much
    unit: str = ""

    def level(self, value: object) -> str:
        return f"{self.name} {shown(value)}{self.unit}"


DISTURBANCES = (
    Disturbance("wind", ("wind.steady_mps",), "wind_speed_mps", " m/s"),
    Disturbance("turbulence", ("wind.turbulence",), "wind.turbulence"),
    Disturbance("target known by", ("estimator.kind",), "estimator.kind"),
    Disturbance("guidance period", ("guidance_period_s",), "guidance_period_s", " s"),
    Disturbance("airspeed used:", ("law.airspeed",), "law.airspeed"),
)


@dataclass(frozen=True, slots=True)
class Effect:
    """The effect of a plant or a disturbance on a metric in one cell."""

    metric: str
    what: str  # the rung's addition, or the disturbance
    plant: str  # on which; "A - B" of what it adds to a difference
    of: Sample

    @property
    def interval(self) -> tuple[float, float]:
        """NaN where there is none."""
        return self.of.interval() or (np.nan, np.nan)

    @property
    def word(self) -> str:
        low, high = self.interval
        return "higher" if low > 0.0 else "lower" if high < 0.0 else "undecided"


@dataclass(frozen=True, slots=True)
class Ladder:
    """A metric from the first rung to the last in one cell: means over the same seeds, so the steps add up."""

    aircraft: str
    at: Mapping[str, object]
    metric: str
    start: float
    steps: tuple[Effect, ...]
    end: float
    seeds: int


def ladders(flights: pd.DataFrame) -> Iterator[Ladder]:
    """In every undisturbed cell that was flown on two rungs or more. Of flights as they enter a comparison."""
    rungs = [plant for plant in PLANTS if plant in set(flights["plant"])]
    if len(rungs) < 2:
        return
    for aircraft, of_one in flights.groupby("aircraft"):
        quiet = of_one[_undisturbed(of_one)]
        first = quiet["plant"] == rungs[0]
        for at, rows in _cells(quiet[first]):
            scenario = quiet[first].iloc[rows]
            on = {rungs[0]: scenario.set_index("key", drop=False)}
            for plant in rungs[1:]:
                two = pd.concat([scenario, quiet[quiet["plant"] == plant]])
                paired = pairs(two, ["plant"], two["plant"] == rungs[0])
                on[plant] = paired.other.set_index(paired.reference["key"])
            common = [key for key in scenario["key"] if all(key in table.index for table in on.values())]
            for metric in COSTS:
                if ladder := _ladder(str(aircraft), at, metric, {p: t.loc[common] for p, t in on.items()}):
                    yield ladder


def _ladder(aircraft: str, at: Mapping[str, object], metric: str, on: Mapping[str, pd.DataFrame]) -> Ladder | None:
    values = {plant: table[metric].to_numpy(float) for plant, table in on.items()}
    known = np.all([~np.isnan(column) for column in values.values()], axis=0)
    if not known.any():
        return None
    seeds = next(iter(on.values()))["seed"].to_numpy()[known]
    by_plant = {plant: sample(column[known], seeds, drawn=True) for plant, column in values.items()}
    drawn = len(set(seeds.tolist())) > 1
    steps = tuple(
        Effect(metric, _adds(below, above), above, sample(values[above][known] - values[below][known], seeds,
                                                          drawn=drawn))
        for below, above in pairwise(on)
    )  # fmt: skip
    first, last = (by_plant[plant].mean for plant in (next(iter(on)), list(on)[-1]))
    return Ladder(aircraft, at, metric, first, steps, last, by_plant[next(iter(on))].seeds)


def _adds(below: str, above: str) -> str:
    """The effect of a plant over a lower one, including the plants between that were not flown."""
    return ", ".join(kind.adds for kind in list(PLANTS.values())[rung(below) + 1 : rung(above) + 1])


def _undisturbed(flights: pd.DataFrame) -> np.ndarray:
    """Whether a flight has no disturbance: still air, the truth, the nominal airspeed, the shortest period."""
    table = spread(flights)
    quiet = np.ones(len(table), bool)
    for column, value in _references(table).items():
        quiet &= (table[column] == value).to_numpy()
    return quiet


def _references(table: pd.DataFrame) -> dict[str, object]:
    known = {name: value for name, value in UNDISTURBED.items() if name in table and (table[name] == value).any()}
    if "guidance_period_s" in table:
        known["guidance_period_s"] = table["guidance_period_s"].min()
    return known


def _cells(flights: pd.DataFrame, without: Sequence[str] = ()) -> Iterator[tuple[Mapping[str, object], np.ndarray]]:
    table = flights.reset_index(drop=True)
    across = axes(spread(table), ("plant", "aircraft", *without))
    for cell in cells(Pairs(table, table, table[:0]), across):
        yield cell.at, cell.rows


@dataclass(frozen=True, slots=True)
class Disturbed:
    """The effect of a single disturbance in one cell: on two plants, and on the difference between them."""

    aircraft: str
    at: Mapping[str, object]
    what: str
    effects: tuple[Effect, ...]


def disturbances(flights: pd.DataFrame, plants: tuple[str, str]) -> Iterator[Disturbed]:
    """The effect of every disturbance, level by level, in every cell without other disturbances."""
    for aircraft, of_one in flights.groupby("aircraft"):
        for disturbance in DISTURBANCES:
            yield from _disturbed(str(aircraft), of_one.reset_index(drop=True), disturbance, plants)


def _disturbed(
    aircraft: str, flights: pd.DataFrame, disturbance: Disturbance, plants: tuple[str, str]
) -> Iterator[Disturbed]:
    table = spread(flights)
    present = [key for key in disturbance.keys if key in settings_of(flights)]
    if not present or disturbance.axis not in table or table[disturbance.axis].nunique() < 2:
        return
    references = _references(table)
    reference = references.pop(disturbance.axis)
    others_quiet = np.ones(len(table), bool)
    for column, value in references.items():
        others_quiet &= (table[column] == value).to_numpy()
    level = table[disturbance.axis]
    for value in (value for value in ordered(level) if value != reference):
        rows = others_quiet & level.isin([value, reference]).to_numpy() & table["plant"].isin(plants).to_numpy()
        those = flights[rows]
        paired = pairs(those, present, level[rows] == reference)
        if not len(paired):
            continue
        for at, cell in _cells(paired.other, (disturbance.axis, *present)):
            effects = tuple(_effects(paired.reference.iloc[cell], paired.other.iloc[cell], plants, disturbance, value))
            if effects:
                yield Disturbed(aircraft, at, disturbance.level(value), effects)


def _effects(
    before: pd.DataFrame, after: pd.DataFrame, plants: tuple[str, str], disturbance: Disturbance, value: object
) -> Iterator[Effect]:
    for metric in COSTS:
        change = after[metric].to_numpy(float) - before[metric].to_numpy(float)
        by_seed = {
            plant: pd.Series(change[mask], index=after["seed"].to_numpy()[mask]).groupby(level=0).mean().dropna()
            for plant in plants
            if (mask := (after["plant"] == plant).to_numpy()).any()
        }
        for plant, values in by_seed.items():
            if len(values):
                of = Sample(values.to_numpy(float), len(values), drawn=True)
                yield Effect(metric, disturbance.level(value), plant, of)
        if len(by_seed) == 2:
            both = pd.concat(by_seed.values(), axis=1, join="inner")
            if len(both):
                added = (both.iloc[:, 1] - both.iloc[:, 0]).to_numpy(float)
                yield Effect(metric, disturbance.level(value), f"{plants[1]} - {plants[0]}",
                             Sample(added, len(added), drawn=True))  # fmt: skip
