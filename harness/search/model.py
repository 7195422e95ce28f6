"""What a search believes of a function that it knows at some points: a Gaussian process, and where to look next."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve, cholesky, solve_triangular
from scipy.optimize import minimize
from scipy.special import ndtr
from scipy.stats import qmc

Array = NDArray[np.float64]

_LOOKED_AT = 512  # points, of which the best is asked for; as many again nearer and nearer to it
_NEARER = (0.1, 0.03, 0.01)  # of the range
LENGTH = 0.5  # of the range: over which values are expected to be alike
NOISE = 1e-3  # variance, of standardised values, that is expected
_NOISE = 1e-6  # the least


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
            prior = np.sum((logs[:-1] - math.log(LENGTH)) ** 2) / 2.0 + (logs[-1] - math.log(NOISE)) ** 2 / 8.0
            return float(0.5 * a @ a + np.log(np.diag(L)).sum() + prior)

        lengths, noise = (like.lengths, like.noise) if like else (np.full(x.shape[1], LENGTH), NOISE)
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
        if not len(self.x):
            return np.full(len(x), self.mean), np.full(len(x), self.scale)
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


def log_improvement(mean: Array, deviation: Array, best: float) -> Array:
    """The logarithm of the expected improvement on `best`."""
    z = (best - mean) / deviation
    improvement = z * ndtr(z) + np.exp(-0.5 * z * z) / math.sqrt(math.tau)
    return np.asarray(np.log(np.maximum(improvement, 1e-300)) + np.log(deviation))


def most_promising(promise: Callable[[Array], Array], centres: Array, noise: np.random.Generator) -> Array:
    """The point of the unit cube where this is largest: sought everywhere, at `centres`, and around the best of them.

    `centres`: one point, or several in rows.
    """
    x = np.vstack([qmc.Halton(centres.shape[-1], rng=noise).random(_LOOKED_AT), centres])
    for scale in (*_NEARER, 0.0):
        centre: Array = x[int(np.argmax(promise(x)))]
        x = np.clip(centre + scale * noise.standard_normal((_LOOKED_AT, len(centre))), 0.0, 1.0)
        x = np.vstack([x, centre])
    return centre
