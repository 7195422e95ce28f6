"""Where a search looks next: Bayesian optimisation with Gaussian processes, asked and told.

One process models the goal, one by how much the settings miss what is required; the next trial is where the expected
improvement times the probability that the requirements are met is largest (Gardner et al., ICML 2014). Of several goals
each trial weighs them at random (ParEGO: Knowles, IEEE TEC 10, 2006). The same seed and answers give the same
questions. Optuna has such a sampler that needs PyTorch; its default one was hardly better than chance here.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import log_ndtr
from scipy.stats import qmc

from harness.search.dimension import Dimension
from harness.search.model import Array, Model, log_improvement, most_promising

_FARTHEST = 1.0  # by how much requirements are missed: more tells nothing more
_MOST = 150  # trials that a model rests on: the latest


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
                value = value + log_improvement(*better.at(x), best)
            return value

        return most_promising(promise, centre, self._noise)

    def _weighed(self, reached: Sequence[Sequence[float]]) -> Array:
        """One number of the goals of each trial: their logarithms, and of several the worst when weighed."""
        goals = np.array(reached)
        goals = np.log(goals + 1e-3 * np.median(goals, axis=0) + 1e-12)
        if self._goals == 1:
            return np.asarray(goals[:, 0])
        weights = self._noise.dirichlet(np.ones(self._goals))
        scaled = weights * (goals - goals.min(axis=0)) / np.maximum(np.ptp(goals, axis=0), 1e-12)
        return np.asarray(scaled.max(axis=1) + 0.05 * scaled.sum(axis=1))
