"""What pairs say: mean differences with their intervals, equivalence, convergence, shares.

The *mean* of the paired differences, since means add up along the ladder of plants and a censored mean is the
restricted mean of survival analysis; its BCa interval, since differences are skewed. Draws are independent, flights of
one seed are not: an interval resamples the seeds' means.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special, stats

from harness.world.randomness import stream

Array = NDArray[np.float64]

CONFIDENCE = 0.95
RESAMPLES = 9999
LEAST_SEEDS = 5  # of fewer draws a bootstrap knows too little


class Effect(NamedTuple):
    """A mean and its 95 % interval, or why there is none. NaN when there are no values."""

    mean: float
    low: float | None
    high: float | None
    pairs: int
    seeds: int
    why: str  # there is no interval; empty when there is one


class Share(NamedTuple):
    """A proportion with its 95 % interval (Wilson's)."""

    number: int
    of: int
    share: float
    low: float
    high: float


def effect(values: Array, seeds: Sequence[object] | NDArray[np.generic], purpose: str) -> Effect:
    """The mean over the seeds' means, with a BCa interval from the random stream of `purpose`. NaN counts as absent."""
    there = ~np.isnan(values)
    values = values[there]
    if not len(values):
        return Effect(np.nan, None, None, 0, 0, "no pairs")
    labels, belongs = np.unique(np.asarray(seeds)[there], return_inverse=True)
    means = np.bincount(belongs, weights=values) / np.bincount(belongs)
    mean, count = float(means.mean()), len(labels)
    why = ""
    if count == 1:
        why = "one seed: nothing was drawn"
    elif not varies(means):
        why = "no variation: the seeds change nothing"
    elif count < LEAST_SEEDS:
        why = f"{count} seeds are too few, {LEAST_SEEDS} are needed"
    if why:
        return Effect(mean, None, None, len(values), count, why)
    interval = stats.bootstrap(
        (means,), np.mean, confidence_level=CONFIDENCE, n_resamples=RESAMPLES, rng=stream(0, f"bootstrap {purpose}")
    ).confidence_interval
    return Effect(mean, float(interval.low), float(interval.high), len(values), count, "")


def varies(values: Array) -> bool:
    """Whether they differ by more than rounding."""
    return bool(np.ptp(values) > 1e-9 * max(1.0, float(np.abs(values).max())))


def equivalence(above: Array, below: Array) -> float | None:
    """The p-value of two one-sided t-tests: that mean(above) <= 0 or mean(below) >= 0.

    `above` holds the pairs' distances from the lower bound, `below` those from the upper one, negative inside; either
    may be empty for a bound that is not there. None without variation: then there is nothing to test.
    """
    tested = [sign * side for side, sign in ((above, 1.0), (below, -1.0)) if len(side)]
    if any(len(side) < 2 or not varies(side) for side in tested):
        return None
    return max(_one_sided(side) for side in tested)


def _one_sided(values: Array) -> float:
    """Of a mean that is not above zero."""
    n = len(values)
    t = values.mean() / (values.std(ddof=1) / np.sqrt(n))
    return float(special.stdtr(n - 1, -t))


def holm(p: Sequence[float]) -> list[float]:
    """Holm's step-down adjustment, in the order given."""
    order = np.argsort(p)
    scaled = np.asarray(p, float)[order] * np.arange(len(p), 0, -1)
    adjusted = np.empty(len(p))
    adjusted[order] = np.minimum(1.0, np.maximum.accumulate(scaled))
    return [float(value) for value in adjusted]


def mcnemar(only_first: int, only_second: int) -> float:
    """Exact p-value for pairs in which one converges and the other does not."""
    discordant = only_first + only_second
    return float(stats.binomtest(only_first, discordant).pvalue) if discordant else 1.0


def share(number: int, of: int) -> Share:
    """`number` out of `of`; of nothing, the interval is everything."""
    if not of:
        return Share(0, 0, np.nan, 0.0, 1.0)
    interval = stats.binomtest(number, of).proportion_ci(CONFIDENCE, "wilson")
    return Share(number, of, number / of, float(interval.low), float(interval.high))
