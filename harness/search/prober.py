"""Where a search for failures looks next: a Gaussian process of the robustness, asked and told.

Until a point fails, the next one is where a failure is most likely; afterwards where the expected improvement on the
worst is largest. Uniform draws are among them: they owe nothing to the answers, so they say how much of the space
fails, and they reach what the model does not expect. The same seed and answers give the same questions.

A smooth process through the steps of a stepped answer (a count, a truth value, a saturated metric) swings below them
beside each jump, and so looks along the rim of the lowest step again and again. Where several points are equally the
lowest, every other point is sought inside what they enclose instead; where all are, the points are spread evenly.

A cheaper function may guide it: what that lets expect is subtracted, as far as the answers bear it out, and the process
models the rest (Kennedy and O'Hagan, *Predicting the output from a complex computer code when fast approximations are
available*, Biometrika 87, 2000).
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist
from scipy.special import log_ndtr
from scipy.stats import qmc

from harness.search.model import LENGTH, NOISE, Array, Model, log_improvement, most_promising

_ONE_OF = 4  # points is drawn uniformly
_MOST = 150  # points that a model rests on: the worst and the latest
_WORST = 8  # points of a guide that are looked at
_RIGHT = 1.0  # answers, as so many of which the belief counts that a guide is right
_ALIKE = 1e-9  # robustness


class Probe(NamedTuple):
    """A point of the unit cube that is asked for."""

    number: int
    at: Array


class Guide(NamedTuple):
    """What is known of a cheaper function."""

    model: Model
    worst: Array  # points, in rows

    def expected(self, x: Array) -> Array:
        """What it lets expect at these points."""
        return self.model.at(x)[0]


class Prober:
    """Asks for points and learns how robust each is: below 0 it fails."""

    def __init__(self, dimensions: int, seed: int, guide: Guide | None = None) -> None:
        self._dimensions, self._guide = dimensions, guide
        self._uniform, self._noise, even = (np.random.default_rng([seed, i]) for i in range(3))
        self._even = qmc.Halton(dimensions, rng=even)
        self._at: list[Array] = []
        self._robustness: list[float] = []  # NaN of what is not told
        self._model: Model | None = None
        self._told = self._modelled = 0  # points

    def is_uniform(self, position: int) -> bool:
        """Whether the trial at this position has to be a uniform draw, whatever the answers are."""
        return position % _ONE_OF == 0 or (self._guide is None and position <= 2 * self._dimensions)

    def ask(self, uniform: bool) -> Probe:
        """A point, to be told later: a uniform draw, or the most promising one, or one among equals."""
        if uniform or not (self._told or self._guide):
            at = (self._uniform if uniform else self._noise).random(self._dimensions)
        else:
            equals = self._among_equals()
            at = self._most_promising() if equals is None else equals
        self._at.append(at)
        self._robustness.append(math.nan)
        return Probe(len(self._at) - 1, at)

    def tell(self, probe: Probe, robustness: float) -> None:
        """How robust a point is; those far from the border count by their logarithm."""
        self._robustness[probe.number] = math.asinh(robustness)
        self._told += 1

    @property
    def guide(self) -> Guide | None:
        """What is known so far, as a guide to another prober; None where it is the same everywhere."""
        robustness, known = np.array(self._robustness), self._known()
        if len(known) < 2 or np.ptp(robustness[known]) < _ALIKE:
            return None
        at = np.array(self._at)
        worst = known[np.argsort(robustness[known], kind="stable")[:_WORST]]
        return Guide(Model.of(at[known], robustness[known], self._model), at[worst])

    def _known(self) -> NDArray[np.intp]:
        """The numbers of the points that a model rests on."""
        robustness = np.array(self._robustness)
        known = np.flatnonzero(~np.isnan(robustness))
        if len(known) > _MOST:
            worst = known[np.argsort(robustness[known], kind="stable")[: _MOST // 2]]
            known = np.union1d(worst, known[-(_MOST // 2) :])
        return known

    def _among_equals(self) -> Array | None:
        """A point sought without the model, where several are equally the lowest; None where it is not its turn."""
        if not self._told:
            return None
        at, robustness = np.array(self._at), np.array(self._robustness)
        least = np.nanmin(robustness)
        lowest = np.unique(at[robustness == least], axis=0)  # a point that is asked for twice has no equal
        higher, untold = at[robustness > least], at[np.isnan(robustness)]
        is_informed = bool(len(higher) or self._guide)  # the model knows more than nothing
        if len(lowest) < 2 or (is_informed and len(at) % 2 == 0):
            return None
        return _inside(lowest, higher, untold, self._noise) if len(higher) else self._even.random(1)[0]

    def _most_promising(self) -> Array:
        if not self._at and self._guide:
            return np.asarray(self._guide.worst[0])
        at, robustness, known, guide = np.array(self._at), np.array(self._robustness), self._known(), self._guide
        least, centres, rest, share = 0.0, at[:0], robustness[known], 1.0
        if len(known):
            least = float(robustness[known].min())
            centres = at[known[[int(np.argmin(robustness[known]))]]]
        if guide:
            centres = np.vstack([guide.worst, centres])
            expected = guide.expected(at[known])
            share = _borne_out(expected, rest, _RIGHT * guide.model.scale**2)
            rest = rest - share * expected
        if guide and not len(known):
            lengths = np.full(self._dimensions, LENGTH)
            model = Model(at[:0], rest, 0.0, 0.5 * guide.model.scale, lengths, NOISE)
        elif self._model is None or self._modelled < self._told:
            model = self._model = Model.of(at[known], rest, self._model)
            self._modelled = self._told
        else:
            model = self._model
        model = model.with_believed(at[np.isnan(robustness)])

        def promise(x: Array) -> Array:
            mean, deviation = model.at(x)
            if guide:
                mean = mean + share * guide.expected(x)
            return np.asarray(log_ndtr(-mean / deviation)) if least >= 0.0 else log_improvement(mean, deviation, least)

        return most_promising(promise, centres, self._noise)


def _inside(lowest: Array, higher: Array, untold: Array, noise: np.random.Generator) -> Array:
    """The point that is nearer to the lowest than to the higher ones, and farthest from both: by the product."""
    tried = np.vstack([lowest, untold])

    def depth(x: Array) -> Array:
        within, without = (cdist(x, points).min(axis=1) for points in (lowest, higher))
        return np.where(within < without, cdist(x, tried).min(axis=1) * without, -1.0)

    return most_promising(depth, lowest, noise)


def _borne_out(expected: Array, answers: Array, prior: float) -> float:
    """How many times the differences that were expected the answers show: 1 where nothing is known, by so much."""
    if not len(answers):
        return 1.0
    apart = expected - expected.mean()
    return float((apart @ (answers - answers.mean()) + prior) / (apart @ apart + prior))
