"""Proof of the verdict's statistics: results whose truth is planted, and how often the words for them are right.

`python -m harness.studies.statistics` writes docs/reference/statistics.md and its figure.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import click
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from harness.drawing import draw
from harness.margins import Assess
from harness.studies.command import run, write
from harness.template import template
from harness.verdict.conditions import Conclusion, conclude
from harness.verdict.judgement import Judgement, judged
from harness.verdict.pairs import Cell, Pairs
from harness.verdict.parts import PARTS
from harness.verdict.statistics import LEAST_SEEDS, Sample
from harness.vocabulary import Verdict
from harness.world.randomness import stream

Array = NDArray[np.float64]
Draw = Callable[[np.random.Generator, tuple[int, ...]], Array]

REPLICATIONS = 2000
SEEDS = (3, 5, 8, 12, 20, 40)
FLOORS: Mapping[int, float] = MappingProxyType({5: 0.90, 8: 0.90, 12: 0.93, 20: 0.93, 40: 0.93})
MOST_WRONG = 0.05  # of the families
LEAST_FOUND = 0.90  # of the clear conditions
COLUMN = "range_error_rms_m"  # the part that is planted: a margin on both sides
MARGIN = Assess().range_error_margin
REFERENCE: Mapping[str, float] = MappingProxyType({COLUMN: 5.0, "chatters": 0.0, "converged": 1.0})  # the baseline's


def _exponential(draws: np.random.Generator, size: tuple[int, ...]) -> Array:
    return draws.exponential(size=size) - 1.0


def _mirrored(draws: np.random.Generator, size: tuple[int, ...]) -> Array:
    return -_exponential(draws, size)


def _lognormal(draws: np.random.Generator, size: tuple[int, ...]) -> Array:
    return (draws.lognormal(0.0, 0.5, size) - math.exp(0.125)) / math.sqrt(math.exp(0.25) * (math.exp(0.25) - 1.0))


def _tied(draws: np.random.Generator, size: tuple[int, ...]) -> Array:
    """Rounded to a third of its deviation."""
    return np.round(3.0 * draws.normal(size=size)) / 3.0


def _censored(draws: np.random.Generator, size: tuple[int, ...]) -> Array:
    """An exponential time, cut off at twice its mean, as a flight's end does."""
    return np.minimum(draws.exponential(size=size), 2.0) - (1.0 - math.exp(-2.0))


SCATTERS: Mapping[str, Draw] = MappingProxyType(  # of mean zero, of deviation about one
    {
        "normal": lambda draws, size: draws.normal(size=size),
        "skewed to the right": _exponential,
        "skewed to the left": _mirrored,
        "log-normal": _lognormal,
        "uniform": lambda draws, size: math.sqrt(12.0) * (draws.random(size) - 0.5),
        "tied": _tied,
        "censored": _censored,
    }
)


class Coverage(NamedTuple):
    """How often the 95 % interval of a mean holds the truth."""

    scatter: str
    seeds: int
    share: float  # NaN below the smallest number of seeds: there is no interval


def coverage(replications: int = REPLICATIONS) -> Iterator[Coverage]:
    """Of each scatter and number of seeds."""
    for name, scatter in SCATTERS.items():
        for seeds in SEEDS:
            means = scatter(stream(seeds, f"coverage {name}"), (replications, seeds))
            intervals = [Sample(row, seeds, drawn=True).interval() for row in means]
            there = [low <= 0.0 <= high for low, high in (interval for interval in intervals if interval)]
            yield Coverage(name, seeds, float(np.mean(there)) if there else math.nan)


class Words(NamedTuple):
    """How often a family of cells had a word that is not true, and how many of its words were decided."""

    scatter: str
    seeds: int
    truth: str
    false_families: float
    decided: float  # of the cells


CELLS = 12


def words(seeds: int, replications: int = REPLICATIONS, scatters: Sequence[str] = tuple(SCATTERS)) -> Iterator[Words]:
    """Families of cells whose true difference lies just outside its margin, just inside, and well inside."""
    for name in scatters:
        scatter = SCATTERS[name]
        for truth, mean, false in (
            ("just outside", 1.001 * MARGIN, Verdict.HOLDS),
            ("just inside", 0.999 * MARGIN, Verdict.FAILS),
            ("well inside", 0.2 * MARGIN, Verdict.FAILS),
        ):
            draws = stream(seeds, f"words {name} {truth}")
            wrong, decided = 0, 0
            for _ in range(replications):
                differences = mean + 0.3 * MARGIN * scatter(draws, (CELLS, seeds))
                judgements = judge(differences, [{"cell": float(i)} for i in range(CELLS)])
                wrong += any(judgement.word == false for judgement in judgements)
                decided += sum(judgement.word != Verdict.UNDECIDED for judgement in judgements)
            yield Words(name, seeds, truth, wrong / replications, decided / (replications * CELLS))


def judge(differences: Array, at: Sequence[Mapping[str, object]], column: str = COLUMN) -> list[Judgement]:
    """The words for one family: a row of differences per cell, a column per seed."""
    cells, seeds = differences.shape
    baseline = REFERENCE[column]
    reference = pd.DataFrame({column: np.full(cells * seeds, baseline), "circles": True})
    other = pd.DataFrame(
        {column: baseline + differences.ravel(), "seed": np.tile(np.arange(seeds), cells), "lost": 0.0, "circles": True}
    )
    rows = np.arange(cells * seeds).reshape(cells, seeds)
    where = [Cell(place, row, drawn=True) for place, row in zip(at, rows, strict=True)]
    return judged(Pairs(reference, other, other[:0]), where, [column], "sixdof", Assess(), assumption=True)


class FalseHolds(NamedTuple):
    """How often a family of cells had a false word for a share of flights, and how many of its words were decided."""

    part: str
    cells: int
    truth: float  # the share; of the flights that converge, how much smaller it is than the baseline's
    seeds: int
    false_families: float
    decided: float  # of the cells


SHARE_SEEDS = (20, 72, 200)
SHARE_MARGIN = Assess().chatter_share  # that of the shares that converge is the same
TRUTHS = (1.001, 0.2)  # times the margin: just outside, and well inside


def shares(
    cells: int, seeds: Sequence[int] = SHARE_SEEDS, replications: int = REPLICATIONS, truths: Sequence[float] = TRUTHS
) -> Iterator[FalseHolds]:
    """Families of cells in which this share of the flights is in a limit cycle, or alone does not converge."""
    at = [{"cell": float(i)} for i in range(cells)]
    for (column, sign), times, n in product((("chatters", 1.0), ("converged", -1.0)), truths, seeds):
        draws, truth = stream(n, f"shares {column} {times} {cells}"), times * SHARE_MARGIN
        false = Verdict.HOLDS if times > 1.0 else Verdict.FAILS
        wrong, decided = 0, 0
        for _ in range(replications):
            judgements = judge(np.where(draws.random((cells, n)) < truth, sign, 0.0), at, column)
            wrong += any(judgement.word == false for judgement in judgements)
            decided += sum(judgement.word != Verdict.UNDECIDED for judgement in judgements)
        yield FalseHolds(PARTS[column].title, cells, truth, n, wrong / replications, decided / (replications * cells))


AXES: Mapping[str, Sequence[object]] = MappingProxyType(
    {"limit": [5.0, 10.0, 20.0], "radius": [100.0, 200.0], "law": ["a", "b"]}
)


class Design(NamedTuple):
    """An effect that depends on some axes, and the condition under which the part then holds."""

    name: str
    holds: Callable[[Mapping[str, object]], bool]
    expected: Mapping[str, tuple[object, ...]] | None  # None: no condition is true
    flown: Callable[[Mapping[str, object]], bool] = lambda at: True


DESIGNS = (
    Design("on one axis", lambda at: float(str(at["limit"])) <= 10.0, {"limit": (5.0, 10.0)}),
    Design("on a word", lambda at: at["law"] == "a", {"law": ("a",)}),
    Design(
        "on two axes",
        lambda at: float(str(at["limit"])) <= 10.0 and at["law"] == "a",
        {"limit": (5.0, 10.0), "law": ("a",)},
    ),
    Design(
        "on one axis, unbalanced",
        lambda at: float(str(at["limit"])) <= 10.0,
        {"limit": (5.0, 10.0)},
        lambda at: at["radius"] == 200.0 or at["limit"] == 20.0,
    ),
    Design("on none, holds", lambda at: True, None),
    Design("on none, fails", lambda at: False, None),
    Design(
        "on two that vary together",
        lambda at: at["law"] == "a",
        None,
        lambda at: (at["law"] == "a") == (at["radius"] == 100.0),
    ),
)


class Conditions(NamedTuple):
    """How often the planted condition was found, and how often one that is not true was named."""

    design: str
    seeds: int
    found: float  # NaN where none is true
    spurious: float
    confounded: float  # said that two axes cannot be told apart


def conditions(
    seeds: int, replications: int = REPLICATIONS, designs: Sequence[Design] = DESIGNS
) -> Iterator[Conditions]:
    """Clear cases: the difference is half of its margin or one and a half, its scatter a fifth of the margin."""
    for design in designs:
        draws = stream(seeds, f"conditions {design.name}")
        at = [dict(zip(AXES, values, strict=True)) for values in product(*AXES.values())]
        at = [place for place in at if design.flown(place)]
        means = np.array([0.5 * MARGIN if design.holds(place) else 1.5 * MARGIN for place in at])
        found = spurious = confounded = 0
        for _ in range(replications):
            differences = means[:, None] + 0.2 * MARGIN * draws.normal(size=(len(at), seeds))
            conclusion = conclude(judge(differences, at), AXES)
            named = conclusion.condition
            if named is not None and named.word is Verdict.HOLDS and dict(named.values) == design.expected:
                found += 1
            elif named is not None and not _is_true(conclusion, design, at):
                spurious += 1
            confounded += bool(conclusion.confounded)
        share = math.nan if design.expected is None else found / replications
        yield Conditions(design.name, seeds, share, spurious / replications, confounded / replications)


def _is_true(conclusion: Conclusion, design: Design, at: Sequence[Mapping[str, object]]) -> bool:
    """Whether the named condition says of every cell what was planted there, and names no axis that is idle."""
    named = conclusion.condition
    if named is None or design.expected is None:
        return named is None
    covered = [place for place in at if named.covers(place)]
    says = all(design.holds(place) == (named.word is Verdict.HOLDS) for place in covered)
    return says and set(named.values) <= set(design.expected)


class Proof(NamedTuple):
    """All of it."""

    coverage: list[Coverage]
    words: list[Words]
    shares: list[FalseHolds]
    conditions: list[Conditions]


def prove(replications: int = REPLICATIONS) -> Proof:
    """Some minutes of computing at 2000 replications."""
    return Proof(
        list(coverage(replications)),
        [word for seeds in (5, 12) for word in words(seeds, replications)],
        [share for cells in (1, CELLS) for share in shares(cells, replications=replications)],
        [condition for seeds in (8, 12) for condition in conditions(seeds, replications)],
    )


def figure(proof: Proof) -> str:
    """Coverage by the number of seeds, as SVG."""

    def paint(figure: Figure) -> None:
        axes = figure.subplots()
        for name in SCATTERS:
            points = [c for c in proof.coverage if c.scatter == name and not math.isnan(c.share)]
            axes.plot([c.seeds for c in points], [100.0 * c.share for c in points], "o-", ms=3, lw=1.0, label=name)
        axes.step(
            list(FLOORS), [100.0 * floor for floor in FLOORS.values()], "k--", where="post", lw=1.0, label="floor"
        )
        axes.axhline(95.0, color="0.6", lw=0.8)
        axes.set_xscale("log")
        axes.set_xticks(list(SEEDS), [str(seeds) for seeds in SEEDS])
        axes.set_xticks([], minor=True)
        axes.set(xlabel="seeds", ylabel="intervals that hold the truth, %", ylim=(86.0, 100.0))
        axes.legend(fontsize=7, ncols=2)

    return draw(paint, width=7.0, height=3.6)


@click.command()
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("docs/reference"),
    show_default=True,
    help="The folder to write to.",
)
def main(out: Path) -> None:
    """Plant the truth in results 2000 times over, and write OUT/statistics.md and its figure. Takes eight minutes."""
    proof = prove()
    page = template("harness.studies", "statistics.md.jinja").render(
        proof=proof, seeds=SEEDS, floors=FLOORS, scatters=list(SCATTERS), replications=REPLICATIONS,
        least_seeds=LEAST_SEEDS, cells=CELLS, most_wrong=MOST_WRONG, least_found=LEAST_FOUND,
        share_margin=SHARE_MARGIN, share_seeds=SHARE_SEEDS,
    )  # fmt: skip
    write(out, {"statistics.svg": figure(proof), "statistics.md": page + "\n"})


if __name__ == "__main__":
    run(main, "harness.studies.statistics")
