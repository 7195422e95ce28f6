"""The judgement of one quantity in one cell: a word, and the evidence for it.

A cell is one combination of all that was set to several values. Its pairs differ in what is drawn from the seed.
*Holds*: the mean difference is shown to lie within its bounds. *Fails*: it is shown to lie outside. *Undecided*:
neither is shown. Tests are two-sided, and Holm's adjustment keeps the error of a family of them: all parts and cells of
one airframe under one value of what is compared. A share of flights is in it like a number, also where no flight has
what it is a share of. Without a margin a difference is *lower* or *higher* where its 95 % interval excludes zero.

A flight that ended early counts against its cell and never as data: no part *holds* in a cell that loses a larger share
of its flights than `lost_share`.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from harness.margins import Assess
from harness.tables import number
from harness.verdict.pairs import Cell, Pairs, is_share
from harness.verdict.parts import PARTS, Bounds, Part, margins_of
from harness.verdict.statistics import (
    ANYWHERE,
    LEAST_SEEDS,
    Array,
    Evidence,
    Sample,
    evidence,
    holm,
    sample,
    seeds_to_decide,
)
from harness.vocabulary import Verdict

LOWER, HIGHER = "lower", "higher"  # without a margin


@dataclass(frozen=True, slots=True)
class Judgement:
    """A difference in one cell, and the word for it."""

    column: str
    value: str  # of what is compared, as in plant = sixdof
    at: Mapping[str, object]  # the cell: axis -> value
    pairs: int
    seeds: int
    lost: int  # pairs of the cell in which a flight ended early
    reference: float  # mean over the same pairs; NaN where the reference has no such thing
    other: float
    difference: float  # from the reference, or from what the assumption says
    low: float  # 95 % interval; NaN without one, equal where the difference is exact
    high: float
    bounds: Bounds = (None, None)
    word: str = Verdict.UNDECIDED
    why: str = ""  # it is undecided
    seeds_needed: int | None = None  # that would decide, in all; None: it is decided, or more seeds would not help

    @property
    def has_margin(self) -> bool:
        return self.bounds != (None, None)

    @property
    def use(self) -> float:
        """How much of its bound the difference takes: 1 at the bound, more beyond."""
        low, high = self.bounds
        if low is not None and high is None:  # a reserve is asked
            return low / self.difference if self.difference > 0 else np.inf
        used = [self.difference / bound for bound in (low, high) if bound]
        if used:
            return max(used)
        is_within = self.difference <= 0.0 and (low is None or self.difference >= 0.0)  # a bound of 0 is all or nothing
        return 0.0 if is_within else np.inf


@dataclass(frozen=True, slots=True)
class _Tested:
    """A judgement before the adjustment over its family."""

    judgement: Judgement
    sample: Sample
    evidence: Evidence
    barred: str = ""  # why it must not hold, whatever the data say


def judged(
    pairs: Pairs, cells: Sequence[Cell], columns: Sequence[str], value: str, assess: Assess, *, assumption: bool
) -> list[Judgement]:
    """Every column in every cell: one family.

    Of the `assumption` its own parts are judged too, not only their consequences.
    """
    margins = margins_of(assess)
    tested: list[_Tested] = []
    plain: list[Judgement] = []
    for column in columns:
        part = PARTS.get(column)
        if part and part.assumed is not None and not assumption:
            part = None
        differences = pairs.difference(column, part.assumed if part else None)
        if np.isnan(differences).all():
            continue
        for cell in cells:
            here = differences[cell.rows]
            if np.isnan(here).all():
                continue
            drawn = cell.drawn and (part is None or part.drawn)
            of = sample(here, pairs.seeds[cell.rows], drawn=drawn, reach=_reach(column, part))
            if part:
                tested.append(_tested(part, pairs, cell, value, of, here, margins))
            else:
                plain.append(_without_margin(_judgement(column, pairs, cell, value, of, here, (None, None)), of))
    return [*_decided(tested, margins), *plain]


def _reach(column: str, part: Part | None) -> tuple[float, float]:
    """From where to where a flight may change a share of flights; a number may change to anywhere.

    A flight has it or not; beside one of the baseline it may have it in addition, or lack it.
    """
    if not is_share(column):
        return ANYWHERE
    return (-1.0, 1.0) if part is None or part.assumed is None else (0.0 - part.assumed, 1.0 - part.assumed)


def _tested(
    part: Part, pairs: Pairs, cell: Cell, value: str, of: Sample, differences: Array, margins: Mapping[str, float]
) -> _Tested:
    lost = pairs.lost[cell.rows]
    low, high = part.bounds(margins)
    scale: Array | float = 1.0
    if part.relative:
        reference = pairs.reference[part.column].to_numpy(float)[cell.rows]
        scale = _by_seed(reference, differences, pairs.seeds[cell.rows])
    lows, highs = (None if bound is None else bound * scale for bound in (low, high))
    bounds: Bounds = (None if lows is None else float(np.mean(lows)), None if highs is None else float(np.mean(highs)))
    barred = ""
    if part.column == "lost":
        lost = pairs.reference["lost"].to_numpy(bool)[cell.rows]
    if lost.mean() > margins["lost_share"]:
        of_which = "of the baseline " if part.column == "lost" else ""
        barred = f"{int(lost.sum())} of {len(lost)} flights {of_which}ended early"
    elif part.column == "convergence_time_s":
        first, second = pairs.converged_alone(cell.rows)
        if first or second:
            barred = f"in {first} pairs only the reference converges, in {second} only the other"
    judgement = _judgement(part.column, pairs, cell, value, of, differences, bounds)
    return _Tested(judgement, of, evidence(of, lows, highs), barred)


def _by_seed(reference: Array, differences: Array, seeds: NDArray[np.generic]) -> Array:
    """The reference's values of the pairs that say something, as means of seeds."""
    return sample(np.where(np.isnan(differences), np.nan, reference), seeds, drawn=True).means


def _without_margin(judgement: Judgement, of: Sample) -> Judgement:
    interval = of.interval()
    if interval is None:
        return replace(judgement, why=of.why_not)
    if interval[0] > 0.0 or interval[1] < 0.0:
        return replace(judgement, word=HIGHER if interval[0] > 0.0 else LOWER)
    return replace(judgement, why="the interval includes zero" if of.varies or of.mean else "no difference")


def _judgement(
    column: str, pairs: Pairs, cell: Cell, value: str, of: Sample, differences: Array, bounds: Bounds
) -> Judgement:
    known = ~np.isnan(differences)
    low, high = of.interval() or (np.nan, np.nan)
    return Judgement(
        column=column,
        value=value,
        at=cell.at,
        pairs=of.pairs,
        seeds=of.seeds,
        lost=int(pairs.lost[cell.rows].sum()),
        reference=_mean(pairs.reference[column].to_numpy(float)[cell.rows][known]),
        other=_mean(pairs.other[column].to_numpy(float)[cell.rows][known]),
        difference=of.mean,
        low=low,
        high=high,
        bounds=bounds,
    )


def words(family: Sequence[Evidence], significance: float) -> list[Verdict]:
    """The words of a family of tests, with Holm's adjustment over those that can err."""
    adjusted = iter(holm([each.strongest for each in family if each.can_err]))
    return [
        Verdict.UNDECIDED
        if (next(adjusted) if each.can_err else each.strongest) > significance
        else (Verdict.HOLDS if each.holds <= each.fails else Verdict.FAILS)
        for each in family
    ]


def _decided(tested: Sequence[_Tested], margins: Mapping[str, float]) -> Iterator[Judgement]:
    """The words, with Holm's adjustment over the family."""
    significance = margins["significance"]
    family = sum(each.evidence.can_err for each in tested)
    for each, word in zip(tested, words([each.evidence for each in tested], significance), strict=True):
        if word is not Verdict.UNDECIDED and not (word is Verdict.HOLDS and each.barred):
            yield replace(each.judgement, word=word)
            continue
        why, needed = each.barred or each.sample.why_not, None
        if not each.barred:
            needed = _needed(each, significance / max(1, family))
            why = why or (
                _open(each.sample)
                if each.evidence.strongest > significance
                else f"shown as the only test, not as one of this airframe's {family}"
            )
        yield replace(each.judgement, why=why, seeds_needed=needed)


def _open(of: Sample) -> str:
    """Why a test shows neither word, were it the only one."""
    low, high = of.interval() or (np.nan, np.nan)
    if not of.is_unanimous:
        return "the interval crosses the margin"
    if of.mean:
        return f"all {of.seeds} seeds agree: {number(low, 100.0)} to {number(high, 100.0)} %"
    differ = " differ" if low < 0.0 else ""
    return f"0 of {of.seeds} seeds{differ}: at most {number(high, 100.0)} %"


def _needed(each: _Tested, level: float) -> int | None:
    if not each.sample.is_judged and each.sample.seeds < LEAST_SEEDS and each.sample.varies:
        return LEAST_SEEDS
    return seeds_to_decide(each.sample, *each.judgement.bounds, level)


def _mean(values: Array) -> float:
    there = values[~np.isnan(values)]
    return float(there.mean()) if len(there) else np.nan


def frame(judgements: Sequence[Judgement], axes: Sequence[str]) -> pd.DataFrame:
    """The judgements as a table: one row per metric, value of what is compared and cell."""
    columns = ("metric", "value", *axes, "pairs", "seeds", "lost", "reference", "other", "difference", "low", "high",
               "verdict", "why", "seeds_needed")  # fmt: skip
    rows = [
        (j.column, j.value, *(j.at.get(axis) for axis in axes), j.pairs, j.seeds, j.lost, j.reference, j.other,
         j.difference, j.low, j.high, j.word, j.why, j.seeds_needed)
        for j in judgements
    ]  # fmt: skip
    return pd.DataFrame(rows, columns=list(columns)).astype({"seeds_needed": "Int64"})
