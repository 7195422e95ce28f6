"""The scorecard of one airframe: each part of the assumption holds, holds if …, or does not hold.

A *cell* is one combination of all that was set to several values; its pairs differ by the seed. A part holds in a cell
when the mean difference is shown to lie within the bounds: two one-sided tests, Holm over all of the scorecard. Where
the seeds change nothing the one difference itself has to. A cell in which more flights than `lost_share` end early
passes no part.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from harness.margins import Assess
from harness.verdict.pairs import REFERENCE, Pairs, axes, is_ordered, joined, spread
from harness.verdict.parts import PARTS, Part
from harness.verdict.statistics import Effect, Share, effect, equivalence, holm, mcnemar, share

HOLDS, IF, NOT, UNSHOWN, UNMEASURED = "holds", "holds if", "does not hold", "not shown", "not measured"


@dataclass(frozen=True, slots=True)
class Cell:
    """One part in one cell."""

    at: Mapping[str, object]  # axis -> value
    pairs: int
    mean: float  # difference
    bounds: tuple[float | None, float | None]
    p: float | None  # of equivalence, adjusted; None: there is no variation, or it is a share
    lost: int
    too_many_lost: bool = False
    passes: bool = False

    @property
    def fails(self) -> bool:
        """It is shown not to hold, or not to last; what neither passes nor fails is undecided."""
        return self.beyond or self.too_many_lost

    @property
    def beyond(self) -> bool:
        """The difference itself is out of bounds."""
        low, high = self.bounds
        return (low is not None and self.mean < low) or (high is not None and self.mean > high)

    @property
    def use(self) -> float:
        """How much of its bound the difference takes: 1 at the bound."""
        low, high = self.bounds
        if high is not None and high < 0:  # a reserve is asked: 0 is its lack
            return math.inf if self.mean >= 0 else high / self.mean
        used = [self.mean / bound for bound in (low, high) if bound]
        return max(used) if used else (0.0 if self.mean == 0 else math.inf)


@dataclass(frozen=True, slots=True)
class Finding:
    """What was found of one part."""

    part: Part
    verdict: str
    condition: str  # of `holds if`
    effect: Effect
    cells: tuple[Cell, ...]
    tested: bool  # at least one cell had variation to test

    @property
    def passed(self) -> int:
        return sum(cell.passes for cell in self.cells)

    @property
    def failed(self) -> int:
        return sum(cell.fails for cell in self.cells)

    @property
    def worst(self) -> Cell | None:
        """The cell nearest to, or furthest beyond, its bounds."""
        return max(self.cells, key=lambda cell: cell.use) if self.cells else None


@dataclass(frozen=True, slots=True)
class Scorecard:
    """One airframe under one plant beside the baseline."""

    aircraft: str
    plant: str
    baseline: str
    pairs: int
    seeds: int
    lost: Share  # of the plant's flights
    converged: tuple[Share, Share]  # of the baseline's, of the plant's
    alone: tuple[int, int]  # pairs in which only the baseline's, only the plant's converges
    convergence_p: float  # McNemar's
    axes: Mapping[str, Sequence[object]]
    findings: tuple[Finding, ...]

    def finding(self, name: str) -> Finding:
        """By the part's name."""
        return next(finding for finding in self.findings if finding.part.name == name)


def scorecards(pairs: Pairs, assess: Assess, baseline: str) -> Iterator[Scorecard]:
    """One per airframe and plant, in their order. The pairs' tables are `with_quantities`."""
    kinds = pairs.other[["aircraft", "plant"]].drop_duplicates().sort_values(["aircraft", "plant"])
    for name, plant in kinds.itertuples(index=False):
        chosen = (pairs.other["aircraft"] == name) & (pairs.other["plant"] == plant)
        yield scorecard(pairs.where(chosen), assess, baseline)


def scorecard(pairs: Pairs, assess: Assess, baseline: str) -> Scorecard:
    """Of pairs of one airframe and one plant."""
    other = spread(pairs.other)
    across = axes(other)
    groups = _groups(other, list(across))
    found = [
        Finding(part, "", "", _effect(part, pairs), tuple(_cells(part, pairs, groups, assess)), False) for part in PARTS
    ]
    first, second = pairs.reference["converged"].to_numpy(), pairs.other["converged"].to_numpy()
    alone = int((first & ~second).sum()), int((second & ~first).sum())
    n = len(pairs)
    return Scorecard(
        aircraft=str(other["aircraft"].iloc[0]),
        plant=str(other["plant"].iloc[0]),
        baseline=baseline,
        pairs=n,
        seeds=other["seed"].nunique(),
        lost=share(int(pairs.other["lost"].sum()), n),
        converged=(share(int(first.sum()), n), share(int(second.sum()), n)),
        alone=alone,
        convergence_p=mcnemar(*alone),
        axes=across,
        findings=tuple(_judged(found, across, assess)),
    )


Groups = list[tuple[dict[str, object], NDArray[np.intp]]]


def _groups(table: pd.DataFrame, columns: list[str]) -> Groups:
    """The cells: what is set in each, and its rows."""
    if not columns:
        return [({}, np.arange(len(table)))]
    of: dict[str, list[int]] = {}
    for row, text in enumerate(joined(table, columns)):
        of.setdefault(text, []).append(row)
    rows = [np.asarray(indices) for indices in of.values()]
    return [({c: table[c].iloc[indices[0]] for c in columns}, indices) for indices in rows]


def _effect(part: Part, pairs: Pairs) -> Effect:
    return effect(part.difference(pairs), pairs.other["seed"].to_numpy(), part.column)


def _cells(part: Part, pairs: Pairs, groups: Groups, assess: Assess) -> Iterator[Cell]:
    """The cells that say something of the part; `p` not adjusted yet."""
    values = part.difference(pairs)
    lost, several = pairs.other["lost"].to_numpy(), pairs.other["seed"].nunique() > 1
    converges = pairs.reference["converged"].to_numpy(bool) | pairs.other["converged"].to_numpy(bool)
    low, high = part.bounds(assess)
    scale = pairs.reference[part.column].to_numpy(float) if part.relative else np.ones(len(values))
    for at, rows in groups:
        rows = rows[~np.isnan(values[rows])]
        if not len(rows) or (part.name == "convergence" and not converges[rows].any()):
            continue
        d, s = values[rows], scale[rows]
        above = d - low * s if low is not None else d[:0]
        below = d - high * s if high is not None else d[:0]
        bounds = (None if low is None else float(low * s.mean()), None if high is None else float(high * s.mean()))
        p = equivalence(above, below) if part.tested else None
        if part.tested and len(rows) == 1 and several:
            p = 1.0  # of a population that varies one draw shows nothing
        gone = int(lost[rows].sum())
        too_many = gone > assess.lost_share * len(rows) and part.name != "reach"
        yield Cell(at, len(rows), float(d.mean()), bounds, p, gone, too_many)


def _judged(found: Sequence[Finding], across: Mapping[str, Sequence[object]], assess: Assess) -> Iterator[Finding]:
    """With Holm's adjustment over all tests of the scorecard, and the verdict that follows."""
    tested = [cell.p for finding in found for cell in finding.cells if cell.p is not None]
    adjusted = iter(holm(tested))
    for finding in found:
        cells = []
        for cell in finding.cells:
            p = None if cell.p is None else next(adjusted)
            is_shown = p is None or p <= assess.significance
            cells.append(replace(cell, p=p, passes=is_shown and not cell.fails))
        verdict, condition = conclusion(cells, across)
        yield replace(
            finding,
            cells=tuple(cells),
            verdict=verdict,
            condition=condition,
            tested=any(c.p is not None for c in cells),
        )


def conclusion(cells: Sequence[Cell], across: Mapping[str, Sequence[object]]) -> tuple[str, str]:
    """The verdict, and under what condition.

    *Holds if*: of all axes the interval (of words: the set) that covers most cells, all of which pass; and at what
    other settings alone those were flown, where the rest was flown at more. *Not shown*: no cell's difference is out of
    bounds and no flight is lost too many, the draws are too few or scatter too much.
    """
    if not cells:
        return UNMEASURED, ""
    if all(cell.passes for cell in cells):
        return HOLDS, ""
    best: list[Cell] = []
    condition = ""
    for axis, values in across.items():
        passing = [value for value in values if _passes(cells, axis, value)]
        measured = [value for value in values if any(cell.at[axis] == value for cell in cells)]
        for run in _runs(measured, passing) if is_ordered(values) else [passing]:
            covered = [cell for cell in cells if cell.at[axis] in run]
            if len(covered) > len(best):
                best, condition = covered, _said(axis, run, measured) + _only(covered, cells, axis)
    if best:
        return IF, condition
    return (NOT if any(cell.fails for cell in cells) else UNSHOWN), ""


def _passes(cells: Sequence[Cell], axis: str, value: object) -> bool:
    there = [cell for cell in cells if cell.at[axis] == value]
    return bool(there) and all(cell.passes for cell in there)


def _runs(values: Sequence[object], passing: Sequence[object]) -> Iterator[list[object]]:
    """The longest stretches of neighbours that pass."""
    run: list[object] = []
    for value in values:
        if value in passing:
            run.append(value)
        elif run:
            yield run
            run = []
    if run:
        yield run


def _said(axis: str, run: Sequence[object], values: Sequence[object]) -> str:
    if not is_ordered(values) or run == ["none"]:
        return f"{axis} is {' or '.join(map(str, run))}"
    least, most = shown(run[0]), shown(run[-1])
    if run[0] == values[0]:
        return f"{axis} <= {most}"
    if run[-1] == values[-1]:
        return f"{axis} >= {least}"
    return f"{axis} = {least}" if len(run) == 1 else f"{least} <= {axis} <= {most}"


def _only(covered: Sequence[Cell], cells: Sequence[Cell], axis: str) -> str:
    """On the other axes, the values that alone were flown there, though the rest of the cells has more."""
    said = []
    for other in (other for other in cells[0].at if other != axis):
        there, all_of = ({str(cell.at[other]): cell.at[other] for cell in some} for some in (covered, cells))
        if len(there) < len(all_of):
            is_reference = list(there.values()) == [REFERENCE.get(other)]
            said.append("undisturbed" if is_reference else f"{other} = {' or '.join(map(shown, there.values()))}")
    return f", flown only at {', '.join(dict.fromkeys(said))}" if said else ""


def shown(value: object) -> str:
    """A setting's value, short."""
    return f"{value:g}" if isinstance(value, float | np.floating) else str(value)
