"""Orders: which law is better on a plant, in one condition, and where another plant gives another order.

A condition is one combination of all that was set, but for plant, law and seed; nothing is ever averaged over several.
For two laws in a condition one is better, or they tie, or the order is undecided. They tie where their ratio is shown
to lie within the tie's bounds, and differ where it is shown to lie outside: by the mean of its logarithm over paired
seeds, with Holm's adjustment over all pairs of laws on the plant. A ratio in which the seeds agree is exact.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import combinations
from typing import NamedTuple

import numpy as np
import pandas as pd

from harness.plants.ladder import BASELINE
from harness.verdict.pairs import CompareError, is_drawn, ordered
from harness.verdict.statistics import Array, Sample, evidence, holm, sample


class Tie(NamedTuple):
    """Two numbers tie when they differ by less than a share of the smaller one; less than `least` counts as that."""

    share: float
    least: float

    @property
    def bound(self) -> float:
        """The largest logarithm of the ratio of a tie."""
        return math.log1p(self.share)

    def times(self, a: Array | float, b: Array | float) -> Array:
        """The logarithm of b over a."""
        return np.asarray(np.log(np.maximum(b, self.least) / np.maximum(a, self.least)))

    def ratios(self, a: pd.Series, b: pd.Series, *, drawn: bool) -> Sample:
        """These logarithms over the seeds, the index of both; exact where they agree."""
        of = sample(self.times(a.to_numpy(float), b.to_numpy(float)), a.index.to_list(), drawn=drawn)
        return of if of.varies else replace(of, drawn=False)


class Relation(StrEnum):
    """The relation of the first of two laws to the second."""

    BETTER = "better"
    WORSE = "worse"
    TIE = "tie"
    UNDECIDED = "undecided"

    @property
    def is_order(self) -> bool:
        """Whether one of the two is better."""
        return self in (Relation.BETTER, Relation.WORSE)


class Standing(NamedTuple):
    """A law on a plant in a condition: the mean of a metric over the seeds, and its 95 % interval."""

    mean: float
    low: float  # NaN without an interval
    high: float
    seeds: int


@dataclass(frozen=True, slots=True)
class Order:
    """The laws on one plant in one condition. A smaller number is better."""

    plant: str
    places: Mapping[str, Standing]  # by law, the best first
    relations: Mapping[tuple[str, str], Relation]  # of the first law against the second, for each pair of laws
    left_out: Mapping[str, int]  # laws without a place, and in how many seeds they were lost or have no such number

    def relation(self, law: str, other: str) -> Relation:
        """The relation of a law to another."""
        if (law, other) in self.relations:
            return self.relations[law, other]
        opposite = {Relation.BETTER: Relation.WORSE, Relation.WORSE: Relation.BETTER}
        relation = self.relations[other, law]
        return opposite.get(relation, relation)


class Reordered(NamedTuple):
    """Two laws whose relation on a plant is another than on the reference: of `law` against `other`."""

    law: str
    other: str
    reference: Relation
    there: Relation

    @property
    def is_reversal(self) -> bool:
        """Whether each of the two is better on one of the plants."""
        return self.reference.is_order and self.there.is_order


@dataclass(frozen=True, slots=True)
class Ranking:
    """The orders of one condition, one for each plant, by one metric."""

    at: Mapping[str, object]  # the condition: setting -> value
    metric: str
    tie: Tie
    orders: Mapping[str, Order]  # by plant, up the ladder

    def changes(self, plant: str, reference: str = BASELINE) -> list[Reordered]:
        """The pairs of laws whose order or tie differs from that on the reference; reversals first."""
        here, there = self.orders[reference], self.orders[plant]
        found = []
        for law, other in combinations([law for law in here.places if law in there.places], 2):
            relations = here.relation(law, other), there.relation(law, other)
            if relations[0] != relations[1] and Relation.UNDECIDED not in relations:
                found.append(Reordered(law, other, *relations))
        return sorted(found, key=lambda change: not change.is_reversal)

    def undecided(self, plant: str, reference: str = BASELINE) -> tuple[int, int]:
        """The number of pairs of laws that are undecided on one of the two plants, and the number of pairs."""
        here, there = self.orders[reference], self.orders[plant]
        pairs = list(combinations([law for law in here.places if law in there.places], 2))
        told = [Relation.UNDECIDED not in (here.relation(*pair), there.relation(*pair)) for pair in pairs]
        return len(told) - sum(told), len(told)

    def agreement(self, plant: str, reference: str = BASELINE) -> tuple[float, int]:
        """Kendall's tau-b of the means of two plants, those within the tie's bounds being equal; and how many laws.

        1: the same order; -1: the reversed one; NaN where all laws tie on one of the plants.
        """
        here, there = self.orders[reference].places, self.orders[plant].places
        laws = [law for law in here if law in there]
        pairs = list(combinations(laws, 2))
        first, second = (np.array([self._sign(on[a].mean, on[b].mean) for a, b in pairs]) for on in (here, there))
        scale = math.sqrt(float(first @ first) * float(second @ second))
        return (float(first @ second) / scale if scale else math.nan), len(laws)

    def _sign(self, a: float, b: float) -> float:
        times = float(self.tie.times(a, b))
        return 0.0 if abs(times) <= self.tie.bound else math.copysign(1.0, times)


def rankings(
    flights: pd.DataFrame, metric: str, tie: Tie, condition: Sequence[str], significance: float = 0.05
) -> Iterator[Ranking]:
    """One for each combination of the columns `condition`.

    `flights` has the columns plant, law, seed and the metric, as `entered` and `spread` make them. Raises
    `CompareError` when a law was flown twice with one seed in a condition: then it is a mix of conditions.
    """
    for values, table in flights.groupby(list(condition), sort=False):
        at = dict(zip(condition, values, strict=True))
        twice = table.duplicated(["plant", "law", "seed"])
        if twice.any():
            first = table[twice].iloc[0]
            raise CompareError(
                f"{first['law']} was flown more than once with seed {first['seed']} on {first['plant']} at {at}: "
                "that is a mix of conditions, of which no mean is taken"
            )
        yield _ranking(table, at, metric, tie, significance)


def _ranking(table: pd.DataFrame, at: Mapping[str, object], metric: str, tie: Tie, significance: float) -> Ranking:
    drawn = any(is_drawn(of_law) for _, of_law in table.groupby(["plant", "law"]))
    numbers, places, left_out = {}, {}, {}
    for plant in map(str, ordered(table["plant"])):
        by_seed = table[table["plant"] == plant].pivot(index="seed", columns="law", values=metric).astype(float)
        missing = by_seed.isna().sum()  # of a flight that ended early there is no number
        left_out[plant] = {str(law): int(count) for law, count in missing.items() if count}
        numbers[plant] = by_seed.drop(columns=list(left_out[plant]))
        samples = {str(law): sample(x.to_numpy(), list(x.index), drawn=drawn) for law, x in numbers[plant].items()}
        placed = {law: Standing(x.mean, *(x.interval() or (math.nan, math.nan)), x.seeds) for law, x in samples.items()}
        places[plant] = dict(sorted(placed.items(), key=lambda item: item[1].mean))

    orders = {
        plant: Order(plant, places[plant], _relations(numbers[plant], places[plant], tie, significance, drawn=drawn),
                     left_out[plant])
        for plant in numbers
    }  # fmt: skip
    return Ranking(at, metric, tie, orders)


def _relations(
    by_seed: pd.DataFrame, laws: Iterable[str], tie: Tie, significance: float, *, drawn: bool
) -> dict[tuple[str, str], Relation]:
    """The relation of each pair of laws, whose numbers are columns with a row for each seed."""
    pairs = list(combinations(laws, 2))
    samples = [tie.ratios(by_seed[law], by_seed[other], drawn=drawn) for law, other in pairs]
    shown = [evidence(of, -tie.bound, tie.bound) for of in samples]
    adjusted = holm([each.strongest for each in shown])
    relations = {}
    for pair, of, each, p in zip(pairs, samples, shown, adjusted, strict=True):
        apart = Relation.BETTER if of.mean > 0.0 else Relation.WORSE
        told = Relation.TIE if each.holds <= each.fails else apart
        relations[pair] = told if p <= significance else Relation.UNDECIDED
    return relations
