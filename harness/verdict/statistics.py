"""What paired differences say of their mean: an interval, and the evidence for a word.

Flights of one seed share air, noise and start, so a seed is one draw however many flights it has: every number here is
made of the means of seeds. Below `LEAST_SEEDS` seeds there is no interval.

The interval is, on each side, the wider of two: that of Student's T, and that of Hall's cubic transformation of T
(1992, *On the removal of skewness by transformation*, J. R. Statist. Soc. B 54), which follows the skewness of the
sample. Both take the quantiles of half of the degrees of freedom: a family of tests reaches far into the tails, of
which few seeds say little. `docs/reference/statistics.md` shows how often the interval holds the truth and how often a
word is false.

Seeds that all agree have no scatter to make an interval of. Three cases:

- Nothing is drawn: the flights cannot differ, whatever their number, and what one of them says is exact.
- Something is drawn, and a number comes out the same in `LEAST_EQUAL` seeds: it counts as exact.
- Something is drawn, and all seeds agree on a share of flights: what it is a share of happened in none of them, or in
  all. How rare it may then be is a matter of their number, however well the result may be understood: the evidence is
  the exact binomial one, and its interval that of Clopper and Pearson.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special, stats

Array = NDArray[np.float64]

CONFIDENCE = 0.95
LEAST_SEEDS = 5  # of fewer draws an interval knows too little of the scatter
LEAST_EQUAL = 14  # equal draws exclude, at 95 %, that one seed in five differs: 1 - 0.05^(1/14) = 0.19
ANYWHERE = (-math.inf, math.inf)  # where the mean of a seed may be that is no share
MOST_SEEDS = 10_000  # beyond it "more seeds" is no advice


@dataclass(frozen=True)
class Sample:
    """The differences of one cell, as means of seeds."""

    means: Array  # one per seed
    pairs: int
    drawn: bool  # something differs between seeds: air, noise, a start
    reach: tuple[float, float] = ANYWHERE  # the least and the most that a seed may say; finite of a share of flights

    @property
    def seeds(self) -> int:
        return len(self.means)

    @property
    def mean(self) -> float:
        """NaN of nothing."""
        return float(self.means.mean()) if len(self.means) else math.nan

    @property
    def is_exact(self) -> bool:
        """Nothing is left to chance: nothing was drawn, or enough draws of a number are all equal."""
        counts_as_exact = not self.drawn or (self.reach == ANYWHERE and self.seeds >= LEAST_EQUAL)
        return self.seeds > 0 and not self.varies and counts_as_exact

    @property
    def is_unanimous(self) -> bool:
        """A share of drawn flights on which all seeds agree."""
        return self.drawn and self.reach != ANYWHERE and self.seeds > 0 and not self.varies

    @cached_property
    def varies(self) -> bool:
        """Whether the seeds differ by more than rounding."""
        return bool(len(self.means)) and bool(np.ptp(self.means) > 1e-9 * max(1e-3, float(np.abs(self.means).max())))

    @property
    def is_judged(self) -> bool:
        """Whether there is an interval, of no width where the difference is exact."""
        return self.is_exact or self.is_unanimous or (self.varies and self.seeds >= LEAST_SEEDS)

    @property
    def why_not(self) -> str:
        """Why there is no interval; empty when there is one."""
        if self.is_judged:
            return ""
        if not self.seeds:
            return "no pairs"
        if not self.varies and self.seeds > 1:
            return f"all {self.seeds} seeds agree; {LEAST_EQUAL} are needed to exclude that one in five does not"
        return f"{self.seeds} seed{'s' if self.seeds > 1 else ''}; {LEAST_SEEDS} are needed"

    def interval(self) -> tuple[float, float] | None:
        """The 95 % interval of the mean; None when there is none."""
        if self.is_exact:
            return self.mean, self.mean
        if not self.is_judged:
            return None
        least, most = self.reach
        if self.is_unanimous:
            chance = (0.5 - 0.5 * CONFIDENCE) ** (1.0 / self.seeds)
            return least + chance * (self.mean - least), most - chance * (most - self.mean)
        T = float(special.stdtrit(self._degrees, 0.5 + 0.5 * CONFIDENCE))
        scale, a = self._scale
        low = max(T, _untransformed(T, a))
        high = min(-T, _untransformed(-T, a))
        return max(least, self.mean - low * scale), min(most, self.mean - high * scale)

    def p_above(self, bound: float) -> float:
        """One-sided p-value that the mean is not above the bound: small is evidence that it is."""
        if self.is_exact:
            return 0.0 if self.mean > bound else 1.0
        if not self.is_judged:
            return 1.0
        if self.is_unanimous:
            return self.chance(bound) ** self.seeds if self.mean > bound else 1.0
        scale, a = self._scale
        T = (self.mean - bound) / scale
        return float(special.stdtr(self._degrees, -min(T, _transformed(T, a))))

    def p_below(self, bound: float) -> float:
        """The same for a mean below the bound."""
        if self.is_exact:
            return 0.0 if self.mean < bound else 1.0
        if not self.is_judged:
            return 1.0
        if self.is_unanimous:
            return self.chance(bound) ** self.seeds if self.mean < bound else 1.0
        scale, a = self._scale
        T = (self.mean - bound) / scale
        return float(special.stdtr(self._degrees, max(T, _transformed(T, a))))

    def chance(self, bound: float) -> float:
        """The largest chance that one more seed agrees with unanimous ones, were the true mean on the bound.

        All others would then have to be as far beyond the bound as a seed can be. The bound is within `reach`.
        """
        end = self.reach[bound > self.mean]
        return (end - bound) / (end - self.mean) if bound != self.mean else 1.0

    def less(self, by: Array) -> "Sample":
        """The sample of what the seeds' means exceed these values by."""
        return Sample(self.means - by, self.pairs, self.drawn)

    @property
    def _degrees(self) -> float:
        """Degrees of freedom of the quantiles."""
        return 0.5 * (self.seeds - 1)

    @cached_property
    def _scale(self) -> tuple[float, float]:
        """The standard error, and the skewness over the root of the number of seeds."""
        n, d = self.seeds, self.means - self.means.mean()
        variance = float(d @ d) / n
        skewness = float(np.mean(d**3)) / variance**1.5 * math.sqrt(n * (n - 1)) / (n - 2)
        return math.sqrt(variance / (n - 1)), skewness / math.sqrt(n)


def _transformed(T: float, a: float) -> float:
    """Hall's transformation of Student's T, a the skewness over the root of n; it rises with T."""
    return T + a * T * T / 3.0 + a * a * T**3 / 27.0 + a / 6.0


def _untransformed(y: float, a: float) -> float:
    """Its inverse."""
    return 3.0 / a * (math.cbrt(1.0 + a * (y - a / 6.0)) - 1.0) if abs(a) > 1e-9 else y


def sample(
    values: Array,
    seeds: Sequence[object] | NDArray[np.generic],
    *,
    drawn: bool,
    reach: tuple[float, float] = ANYWHERE,
) -> Sample:
    """The differences by seed; NaN counts as absent."""
    there = ~np.isnan(values)
    values = values[there]
    if not len(values):
        return Sample(values, 0, drawn, reach)
    _, belongs = np.unique(np.asarray(seeds)[there], return_inverse=True)
    return Sample(np.bincount(belongs, weights=values) / np.bincount(belongs), len(values), drawn, reach)


class Evidence(NamedTuple):
    """Two-sided p-values: that the mean lies within the bounds, and that it lies outside. Small is evidence."""

    holds: float
    fails: float
    can_err: bool  # chance is in it: not in what is exact, nor where too few seeds say nothing

    @property
    def strongest(self) -> float:
        return min(self.holds, self.fails)


def evidence(of: Sample, low: Array | float | None, high: Array | float | None) -> Evidence:
    """Whether the mean lies within the bounds, numbers or one for each seed; None for a bound that is not there."""
    if of.is_exact:  # on the bound itself a number holds
        within = (low is None or of.mean >= np.mean(low)) and (high is None or of.mean <= np.mean(high))
        return Evidence(0.0, 1.0, can_err=False) if within else Evidence(1.0, 0.0, can_err=False)
    inside, outside = [], []
    if low is not None:
        by_seed, bound = (of, low) if isinstance(low, float) else (of.less(low), 0.0)
        inside.append(by_seed.p_above(bound))
        outside.append(by_seed.p_below(bound))
    if high is not None:
        by_seed, bound = (of, high) if isinstance(high, float) else (of.less(high), 0.0)
        inside.append(by_seed.p_below(bound))
        outside.append(by_seed.p_above(bound))
    return Evidence(min(1.0, 2.0 * max(inside)), min(1.0, 2.0 * min(outside)), of.is_judged)


def holm(p: Sequence[float]) -> list[float]:
    """Holm's step-down adjustment, in the order given."""
    order = np.argsort(p)
    scaled = np.asarray(p, float)[order] * np.arange(len(p), 0, -1)
    adjusted = np.empty(len(p))
    adjusted[order] = np.minimum(1.0, np.maximum.accumulate(scaled))
    return [float(value) for value in adjusted]


def seeds_to_decide(of: Sample, low: float | None, high: float | None, level: float) -> int | None:
    """How many seeds in all would decide, were mean and scatter to stay as they are; None when `MOST_SEEDS` would not.

    `level` is the two-sided significance that the test has to reach in its family.
    """
    bounds = [bound for bound in (low, high) if bound is not None]
    if of.is_unanimous:
        chance = max(map(of.chance, bounds))
        needed = math.log(0.5 * level) / math.log(chance) if 0.0 < chance < 1.0 else math.inf
        return math.ceil(needed) if needed <= MOST_SEEDS else None
    if not of.varies:
        return LEAST_EQUAL if of.seeds < LEAST_EQUAL else None
    distance = min(abs(of.mean - bound) for bound in bounds)
    spread = float(np.std(of.means, ddof=1))
    if of.seeds < 3:
        return LEAST_SEEDS
    n = np.unique(np.geomspace(max(LEAST_SEEDS, of.seeds + 1), MOST_SEEDS, 400).astype(int))
    enough = special.stdtrit(0.5 * (n - 1), 1.0 - 0.5 * level) * spread / np.sqrt(n) <= distance
    return int(n[np.argmax(enough)]) if enough.any() else None


class Share(NamedTuple):
    """A proportion of flights with its 95 % interval, seeds as clusters."""

    number: int
    of: int
    seeds: int
    low: float
    high: float

    @property
    def share(self) -> float:
        return self.number / self.of if self.of else math.nan


def share(true: NDArray[np.bool_], seeds: NDArray[np.generic], *, drawn: bool) -> Share:
    """How many of the flights, with an interval.

    Flights of one seed are alike: the interval is Clopper and Pearson's of as many independent flights as the scatter
    between the seeds' shares allows (the design effect of Kish), of as many as there are seeds at least.
    """
    number, of = int(true.sum()), len(true)
    if not of:
        return Share(0, 0, 0, 0.0, 1.0)
    by_seed = sample(true.astype(float), seeds, drawn=drawn)
    p, n = number / of, by_seed.seeds
    if not drawn:
        return Share(number, of, n, p, p)
    independent = float(n)
    scatter = float(np.var(by_seed.means, ddof=1)) if n > 1 else 0.0
    if scatter > 0.0:
        independent = min(float(of), max(float(n), p * (1.0 - p) / (scatter / n)))
    k, tail = p * independent, 0.5 * (1.0 - CONFIDENCE)
    low = float(stats.beta.ppf(tail, k, independent - k + 1.0)) if number else 0.0
    high = float(stats.beta.ppf(1.0 - tail, k + 1.0, independent - k)) if number < of else 1.0
    return Share(number, of, n, low, high)


def upper_bound(number: int, of: int) -> float:
    """The one-sided 95 % upper bound on a proportion (Clopper and Pearson), of independent draws."""
    return float(stats.beta.ppf(CONFIDENCE, number + 1.0, of - number)) if number < of else 1.0
