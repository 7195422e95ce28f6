"""Where a search for failures looks next: a Gaussian process of the robustness, asked and told.

Until a point fails, the next one is where a failure is most likely; afterwards where the expected improvement on the
worst is largest. Uniform draws are among them: they owe nothing to the answers, so they say how much of the space
fails, and they reach what the model does not expect. The same seed and answers give the same questions.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.special import log_ndtr

from harness.search.model import Array, Model, log_improvement, most_promising

_ONE_OF = 4  # points is drawn uniformly
_MOST = 150  # points that a model rests on: the worst and the latest


class Probe(NamedTuple):
    """A point of the unit cube that is asked for."""

    number: int
    at: Array


class Prober:
    """Asks for points and learns how robust each is: below 0 it fails."""

    def __init__(self, dimensions: int, seed: int) -> None:
        self._dimensions = dimensions
        self._uniform, self._noise = (np.random.default_rng([seed, i]) for i in range(2))
        self._at: list[Array] = []
        self._robustness: list[float] = []  # NaN of what is not told
        self._model: Model | None = None
        self._told = self._modelled = 0  # points

    def is_uniform(self, position: int) -> bool:
        """Whether the trial at this position has to be a uniform draw, whatever the answers are."""
        return position <= 2 * self._dimensions or position % _ONE_OF == 0

    def ask(self, uniform: bool) -> Probe:
        """A point, to be told later: a uniform draw, or the most promising one."""
        if uniform or not self._told:
            at = (self._uniform if uniform else self._noise).random(self._dimensions)
        else:
            at = self._most_promising()
        self._at.append(at)
        self._robustness.append(math.nan)
        return Probe(len(self._at) - 1, at)

    def tell(self, probe: Probe, robustness: float) -> None:
        """How robust a point is; those far from the border count by their logarithm."""
        self._robustness[probe.number] = math.asinh(robustness)
        self._told += 1

    def _most_promising(self) -> Array:
        at, robustness = np.array(self._at), np.array(self._robustness)
        out = np.isnan(robustness)
        known = np.flatnonzero(~out)
        if len(known) > _MOST:
            worst = known[np.argsort(robustness[known], kind="stable")[: _MOST // 2]]
            known = np.union1d(worst, known[-(_MOST // 2) :])
        if self._model is None or self._modelled < self._told:
            self._model, self._modelled = Model.of(at[known], robustness[known], self._model), self._told
        model = self._model.with_believed(at[out])
        least = float(robustness[known].min())

        def promise(x: Array) -> Array:
            mean, deviation = model.at(x)
            return np.asarray(log_ndtr(-mean / deviation)) if least >= 0.0 else log_improvement(mean, deviation, least)

        return most_promising(promise, at[known[int(np.argmin(robustness[known]))]], self._noise)
