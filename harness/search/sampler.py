"""Where a search looks next: Bayesian optimisation with Gaussian processes, asked and told.

One process models the goal, one by how much the settings miss what is required; the next trial is where the expected
improvement times the probability that the requirements are met is largest (Gardner et al., ICML 2014). Of several goals
each trial weighs them at random (ParEGO: Knowles, IEEE TEC 10, 2006). The same seed and answers give the same
questions. Optuna has such a sampler that needs PyTorch; its default one was hardly better than chance here.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve, cholesky, solve_triangular
from scipy.optimize import minimize
from scipy.special import log_ndtr, ndtr
from scipy.stats import qmc

from harness.search.dimension import Dimension

Array = NDArray[np.float64]

_FARTHEST = 1.0  # by how much requirements are missed: more tells nothing more
_LOOKED_AT = 512  # points, of which the best is asked for; as many again nearer and nearer to it
_NEARER = (0.1, 0.03, 0.01)  # of the range
_MOST = 150  # trials that a model rests on: the latest
_NOISE = 1e-6  # variance, of standardised values


class Ask(NamedTuple):
    """A trial that is asked for."""

    number: int
    values: Mapping[str, float]  # by key, in file units


class Sampler:
    """Asks for settings and learns what became of them."""

    def __init__(self, dimensions: Sequence[Dimension], goals: int, seed: int) -> None:
        self._dimensions, self._goals = dimensions, goals
        self._noise = np.random.default_rng(seed)
        self._spread = qmc.Halton(len(dimensions), rng=np.random.default_rng(seed))
        self._first = 2 * len(dimensions) + 1  # trials that are spread evenly, before a model is asked
        self._at: list[Array] = []  # each trial in the unit cube
        self._off: list[float] = []  # by how much it misses what is required, below 0 its room; NaN while it is out
        self._reached: list[Sequence[float]] = []  # empty of one that was refused
        self._room: Model | None = None
        self._better: Model | None = None

    def ask(self) -> Ask:
        """The settings of a trial, to be told later."""
        met = sum(bool(goals) for goals in self._reached)
        out = sum(map(math.isnan, self._off))
        told = len(self._off) - out
        spread = not told or (met + out < self._first and len(self._at) < 4 * self._first)
        values = self._values(self._spread.random(1)[0] if spread else self._most_promising())
        self._at.append(np.array([d.share(values[d.key]) for d in self._dimensions]))
        self._off.append(math.nan)
        self._reached.append(())
        return Ask(len(self._at) - 1, values)

    def tell(self, ask: Ask, off: float, goals: Sequence[float] = ()) -> None:
        """By how much a trial misses what is required, above 0; else its room, below 0, and its goals."""
        self._off[ask.number] = min(max(off, -_FARTHEST), _FARTHEST)
        self._reached[ask.number] = tuple(goals)

    def _values(self, at: Array) -> Mapping[str, float]:
        return {d.key: d.value(share) for d, share in zip(self._dimensions, at.tolist(), strict=True)}

    def _most_promising(self) -> Array:
        at, off = np.array(self._at), np.array(self._off)
        known = np.flatnonzero(~np.isnan(off))[-_MOST:]
        met = np.array([i for i in known if self._reached[i]], np.intp)
        room = self._room = Model.of(at[known], off[known], self._room)
        room = room.with_believed(at[np.isnan(off)])
        if len(met):
            goal = self._weighed([self._reached[i] for i in met])
            better = self._better = Model.of(at[met], goal, self._better)
            better, best = better.with_believed(at[np.isnan(off)]), float(goal.min())
            centre = at[met[int(np.argmin(goal))]]
        else:
            better, best, centre = None, 0.0, at[known[int(np.argmin(off[known]))]]

        def promise(x: Array) -> Array:
            mean, deviation = room.at(x)
            value: Array = np.asarray(log_ndtr(-mean / deviation))
            if better is not None:
                value = value + _log_improvement(*better.at(x), best)
            return value

        x = np.vstack([qmc.Halton(len(centre), rng=self._noise).random(_LOOKED_AT), centre])
        for scale in (*_NEARER, 0.0):
            centre = x[int(np.argmax(promise(x)))]
            x = np.clip(centre + scale * self._noise.standard_normal((_LOOKED_AT, len(centre))), 0.0, 1.0)
            x = np.vstack([x, centre])
        chosen: Array = centre
        return chosen

    def _weighed(self, reached: Sequence[Sequence[float]]) -> Array:
        """One number of the goals of each trial: their logarithms, and of several the worst when weighed."""
        goals = np.array(reached)
        goals = np.log(goals + 1e-3 * np.median(goals, axis=0) + 1e-12)
        if self._goals == 1:
            return np.asarray(goals[:, 0])
        weights = self._noise.dirichlet(np.ones(self._goals))
        scaled = weights * (goals - goals.min(axis=0)) / np.maximum(np.ptp(goals, axis=0), 1e-12)
        return np.asarray(scaled.max(axis=1) + 0.05 * scaled.sum(axis=1))


def _log_improvement(mean: Array, deviation: Array, best: float) -> Array:
    """The logarithm of the expected improvement on `best`."""
    z = (best - mean) / deviation
    improvement = z * ndtr(z) + np.exp(-0.5 * z * z) / math.sqrt(math.tau)
    return np.asarray(np.log(np.maximum(improvement, 1e-300)) + np.log(deviation))


@dataclass(frozen=True, slots=True)
class Model:
    """A Gaussian process with a Matérn kernel (5/2), a length for each dimension, through standardised values."""

    x: Array  # a row for each point
    y: Array  # standardised
    mean: float
    scale: float
    lengths: Array
    noise: float

    @classmethod
    def of(cls, x: Array, values: Array, like: "Model | None" = None) -> "Model":
        """The most likely one for these values, with weak priors on lengths and noise; sought from one `like` it."""
        mean, scale = float(values.mean()), float(values.std()) or 1.0
        y = (values - mean) / scale

        def unlikely(logs: Array) -> float:
            lengths, noise = np.exp(logs[:-1]), math.exp(logs[-1])
            try:
                L = cholesky(_matern(x, x, lengths) + (noise + _NOISE) * np.eye(len(x)), lower=True)
            except np.linalg.LinAlgError:
                return 1e10
            a = solve_triangular(L, y, lower=True)
            prior = np.sum((logs[:-1] - math.log(0.5)) ** 2) / 2.0 + (logs[-1] - math.log(1e-3)) ** 2 / 8.0
            return float(0.5 * a @ a + np.log(np.diag(L)).sum() + prior)

        lengths, noise = (like.lengths, like.noise) if like else (np.full(x.shape[1], 0.5), 1e-3)
        start = np.log(np.append(lengths, noise))
        bounds = [(math.log(0.03), math.log(10.0))] * x.shape[1] + [(math.log(1e-6), 0.0)]
        found = minimize(unlikely, start, method="L-BFGS-B", bounds=bounds, options={"maxiter": 10 if like else 30}).x
        return cls(x, y, mean, scale, np.exp(found[:-1]), float(np.exp(found[-1])) + _NOISE)

    def with_believed(self, x: Array) -> "Model":
        """The same with further points, whose values are believed to be what it expects there."""
        if not len(x):
            return self
        y = (self.at(x)[0] - self.mean) / self.scale
        return Model(np.vstack([self.x, x]), np.append(self.y, y), self.mean, self.scale, self.lengths, self.noise)

    def at(self, x: Array) -> tuple[Array, Array]:
        """Mean and standard deviation at these points."""
        K = _matern(self.x, self.x, self.lengths) + self.noise * np.eye(len(self.x))
        L = cholesky(K, lower=True)
        k = _matern(self.x, x, self.lengths)
        mean = k.T @ cho_solve((L, True), self.y)
        variance = 1.0 - np.sum(solve_triangular(L, k, lower=True) ** 2, axis=0)
        return self.mean + self.scale * mean, self.scale * np.sqrt(np.maximum(variance, 1e-10))


def _matern(a: Array, b: Array, lengths: Array) -> Array:
    square = np.sum(((a[:, None, :] - b[None, :, :]) / lengths) ** 2, axis=2)
    d = np.sqrt(5.0 * square)
    return np.asarray((1.0 + d + d * d / 3.0) * np.exp(-d))
