"""How many 6-DOF flights do cheaper plants save? `python -m harness.studies.variance_reduction RUN` writes the page.

RUN holds the flights of an experiment on the highest plant, and on cheaper ones with the same seeds and further ones.
`make variance` flies such a run first.
"""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import click
import numpy as np
import pandas as pd

from harness.error import HarnessError
from harness.log.metric import METRICS
from harness.margins import Assess
from harness.runs.results import load_results
from harness.studies.command import out_option, run, write
from harness.template import template
from harness.verdict.control_variates import LEAST_SAVED, Controlled, reductions
from harness.verdict.pairs import FAILED, SHARES, axes, cells, entered, ordered, pairs, shown, spread

TOGETHER = 20  # seeds on both plants, as in one use of the command
MOST_LISTED = 12


class StudyError(HarnessError):
    """The run cannot answer the question."""


class Saving(NamedTuple):
    """One mean or share in one cell with one cheaper plant, over the groups of seeds."""

    metric: str
    cell: str
    control: str
    of: Sequence[Controlled]  # of each group
    costs: Sequence[float]  # time of all the flights over that of the highest plant's own
    truth: float  # the mean of all seeds

    @property
    def factor(self) -> float:
        """How many times the flights would make the plain interval as narrow: the median of the groups."""
        return float(np.median([_factor(each) for each in self.of]))

    @property
    def factor_of_time(self) -> float:
        """The same in time."""
        return float(np.median([_factor(each) / cost for each, cost in zip(self.of, self.costs, strict=True)]))


def _factor(of: Controlled) -> float:
    return (of.plain.width / of.reduced.width) ** 2 if of.reduced.width else math.inf


class Paired(NamedTuple):
    """A metric whose difference between two plants is asked, with other seeds on each, or with the same ones."""

    metric: str
    factors: Sequence[float]  # of each cell: how many times the flights other seeds need


class Findings(NamedTuple):
    """What the flights say."""

    plant: str
    seeds: int
    groups: int
    further: int
    savings: Sequence[Saving]
    paired: Sequence[Paired]
    lowest: str  # the cheapest plant


def found(flights: pd.DataFrame) -> Findings:
    """What cheaper plants save in this run. Raises `StudyError` and `CompareError`."""
    *cheap, plant = map(str, ordered(flights["plant"]))
    own = sorted(set(flights["seed"][flights["plant"] == plant]))
    rest = set(flights["seed"]) - set(own)
    groups = [own[i : i + TOGETHER] for i in range(0, len(own) - TOGETHER + 1, TOGETHER)]
    if len(groups) < 2 or not rest:
        raise StudyError(
            f"{plant} has {len(own)} seeds and cheaper plants {len(rest)} further ones: {2 * TOGETHER} seeds are "
            "needed, and further ones"
        )
    savings = []
    for control in cheap:
        pair = flights[flights["plant"].isin([plant, control])]
        told = [_told(pair, plant, seeds, rest) for seeds in groups]
        every = _told(pair, plant, own, rest)
        for key, (whole, _) in every.items():
            parts = [of[key] for of in told if key in of]
            if len(parts) == len(groups):
                of, costs = zip(*parts, strict=True)
                savings.append(Saving(*key, control, of, costs, whole.plain.mean))
    return Findings(plant, len(own), len(groups), len(rest), savings, list(_paired(flights, cheap[0], plant)), cheap[0])


def _told(
    flights: pd.DataFrame, plant: str, seeds: Sequence[int], rest: set[int]
) -> dict[tuple[str, str], tuple[Controlled, float]]:
    """By metric and cell, what `harness compare --variance-reduction` tells with these seeds on both plants."""
    here = flights[flights["seed"].isin([*seeds, *rest])]
    return {
        (of.metric, ", ".join(f"{axis} = {shown(value)}" for axis, value in of.at.items())): (of.of, of.cost)
        for of in reductions(entered(here, Assess().circling_error))
        if of.of is not None and of.plant == plant
    }


def _paired(flights: pd.DataFrame, low: str, high: str) -> Iterator[Paired]:
    """Each metric's difference between the cheapest plant and the highest."""
    table = entered(flights[flights["plant"].isin([low, high])], Assess().circling_error)
    table = table[~table["outcome"].isin(FAILED)].reset_index(drop=True)
    both = pairs(table, ["plant"], table["plant"] == low)
    found = cells(both, axes(spread(both.other), ("plant", "aircraft")))
    for metric in [*(name for name, each in METRICS.items() if each.compared), *SHARES]:
        values = np.array([rows[metric].to_numpy(float) for rows in (both.reference, both.other)])
        factors = []
        for cell in found:
            of = values[:, cell.rows]
            of = of[:, ~np.isnan(of).any(axis=0)]
            if of.shape[1] >= TOGETHER and (apart := float(np.var(of[1] - of[0], ddof=1))) > 0.0:
                factors.append(float(np.var(of, axis=1, ddof=1).sum()) / apart)
        if factors:
            yield Paired(metric, factors)


def page(of: Findings, command: str) -> str:
    """The page."""
    best: dict[tuple[str, str], Saving] = {}
    for saving in of.savings:
        key = saving.metric, saving.cell
        if key not in best or saving.factor > best[key].factor:
            best[key] = saving
    ranked = sorted(best.values(), key=lambda saving: -saving.factor)
    told = [(each, s) for s in of.savings for each in s.of]
    return (
        template("harness.studies", "variance_reduction.md.jinja").render(
            found=of,
            command=command,
            together=TOGETHER,
            least=LEAST_SAVED,
            saving=[saving for saving in ranked if saving.factor >= LEAST_SAVED],
            means=len(best),
            listed=ranked[:MOST_LISTED],
            controls=list(_by_control(of.savings)),
            plain=_share([each.plain.low <= s.truth <= each.plain.high for each, s in told]),
            reduced=_share([each.reduced.low <= s.truth <= each.reduced.high for each, s in told]),
            narrow=_share(
                [each.reduced.low <= s.truth <= each.reduced.high for each, s in told if _factor(each) >= LEAST_SAVED]
            ),
            paired=[(each.metric, float(np.median(each.factors)), min(each.factors)) for each in of.paired],
        )
        + "\n"
    )


def _by_control(savings: Sequence[Saving]) -> Iterator[tuple[str, int, int, float, float, float]]:
    """Each cheaper plant: how many means it saves flights of, of how many, and by how much; and in time."""
    for control in dict.fromkeys(saving.control for saving in savings):
        of = [saving for saving in savings if saving.control == control]
        factors = [saving.factor for saving in of]
        yield (
            control, sum(f >= LEAST_SAVED for f in factors), len(of), float(np.median(factors)), max(factors),
            max(saving.factor_of_time for saving in of),
        )  # fmt: skip


def _share(held: Sequence[bool]) -> str:
    return f"{100 * sum(held) / len(held):.0f} % of {len(held)}" if held else "none"


@click.command()
@click.argument("directory", metavar="RUN", type=click.Path(exists=True, path_type=Path))
@out_option
def main(directory: Path, out: Path) -> None:
    """Write OUT/variance_reduction.md, how many 6-DOF flights cheaper plants save, from a run.

    \b
    Example:
        python -m harness.studies.variance_reduction out/variance
    """
    write(out, {"variance_reduction.md": page(found(load_results(directory)), "make variance")})


if __name__ == "__main__":
    run(main, "harness.studies.variance_reduction")
