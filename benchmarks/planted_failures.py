"""Whether `harness falsify` finds failures that were planted: python -m benchmarks.planted_failures.

Functions stand for flights: each has a region of known volume in which it fails. Writes
docs/answers/planted_failures.md.
"""

import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from harness.files import replacing
from harness.pool import computed
from harness.search.model import Array
from harness.search.prober import Prober
from harness.search.tune import AT_ONCE
from harness.tables import markdown

PAGE = Path("docs/answers/planted_failures.md")
SHARES = (0.01, 0.001)  # of the volume that fails
DIMENSIONS = (2, 3, 4, 5, 6)
SEEDS = 20
MOST = 300  # flights
FOUND = 0.95  # of the seeds, at least
DRAWN = 200_000  # points, by which the border of the region is put where it has its volume
STEPS = 4  # of a staircase, down to the middle of the values
Function = Callable[[Array], Array]  # a number for each row, a point of the unit cube: the lower, the worse


class Kind(NamedTuple):
    """A kind of landscape."""

    meaning: str
    is_smooth: bool
    make: Callable[[int, np.random.Generator], Function]
    is_stepped: bool = False


def _bowl(d: int, of: np.random.Generator) -> Function:
    c, w = of.random(d), of.uniform(0.5, 2.0, d)
    return lambda x: np.asarray((w * (x - c) ** 2).sum(axis=1))


def _valley(d: int, of: np.random.Generator) -> Function:
    c = of.random(d)
    w = np.where(np.arange(d) == 0, 0.3, 3.0) * of.uniform(0.5, 2.0, d)

    def function(x: Array) -> Array:
        y = x - c
        y[:, 1:] -= y[:, :1] ** 2
        return np.asarray((w * y**2).sum(axis=1))

    return function


def _dips(d: int, of: np.random.Generator) -> Function:
    c, depth, width = of.random((4, d)), np.array([1.0, 0.75, 0.7, 0.65]), 0.25 * math.sqrt(d)

    def function(x: Array) -> Array:
        square = ((x[:, None] - c) ** 2).sum(axis=2)
        return np.asarray(-(depth * np.exp(-0.5 * square / width**2)).max(axis=1))

    return function


def _kink(d: int, of: np.random.Generator) -> Function:
    c, w = of.random(d), of.uniform(0.5, 2.0, d)
    return lambda x: np.asarray((w * np.abs(x - c)).max(axis=1))


def _ripple(d: int, of: np.random.Generator) -> Function:
    c, bowl = of.random(d), _bowl(d, of)
    return lambda x: bowl(x) + 0.1 * (1.0 - np.cos(6.0 * math.pi * (x - c))).sum(axis=1) / math.sqrt(d)


KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        "bowl": Kind("a paraboloid", True, _bowl),
        "valley": Kind("a bent valley, shallow along its bed", True, _valley),
        "dips": Kind("four dips, of which the deepest fails", True, _dips),
        "kink": Kind("a pyramid, kinked along all its edges", False, _kink),
        "ripple": Kind("a paraboloid with ripples: many local minima", False, _ripple),
        "stairs": Kind("flat steps, and a jump in the midst of the lowest", False, _bowl, is_stepped=True),
        "needle": Kind("the same everywhere but where it fails", False, _bowl),
    }
)


def planted(kind: str, dimensions: int, share: float, seed: int) -> Function:
    """A robustness that is below 0 in this share of the volume."""
    of = np.random.default_rng([seed, dimensions])
    function = KINDS[kind].make(dimensions, of)
    border, middle = np.quantile(function(of.random((DRAWN, dimensions))), [share, 0.5]).tolist()

    def robustness(x: Array) -> Array:
        room = (function(x) - border) / (middle - border)
        if kind == "needle":
            return np.where(room < 0.0, -1.0, 1.0)
        if KINDS[kind].is_stepped:
            return np.where(room < 0.0, -1.0, (1.0 + np.floor(STEPS * room)) / STEPS)
        return np.asarray(room)

    return robustness


def flights_needed(kind: str, dimensions: int, share: float, seed: int, most: int = MOST) -> float:
    """How many flights the search takes until one fails; inf when none of `most` does."""
    robustness, prober = planted(kind, dimensions, share, seed), Prober(dimensions, seed)
    for begin in range(0, most, AT_ONCE):
        batch = [prober.ask(prober.is_uniform(i)) for i in range(begin, min(begin + AT_ONCE, most))]
        reached = robustness(np.array([probe.at for probe in batch])).tolist()
        for i, (probe, value) in enumerate(zip(batch, reached, strict=True)):
            if value < 0.0:
                return begin + i + 1
            prober.tell(probe, value)
    return math.inf


def needed_at_random(share: float, found: float) -> int:
    """How many uniform draws find it in this share of the seeds."""
    return math.ceil(math.log(1.0 - found) / math.log(1.0 - share))


class Cell(NamedTuple):
    """One landscape, over the seeds."""

    kind: str
    dimensions: int
    share: float
    needed: Sequence[float]

    @property
    def found(self) -> int:
        return sum(map(math.isfinite, self.needed))

    @property
    def median(self) -> float:
        return float(np.quantile(self.needed, 0.5, method="lower"))

    @property
    def most(self) -> float:
        """What finds it in `FOUND` of the seeds."""
        return float(np.quantile(self.needed, FOUND, method="inverted_cdf"))

    @property
    def is_met(self) -> bool:
        """Whether it is found as often as is asked, by half of what random search needs."""
        random = [needed_at_random(self.share, of) for of in (0.5, FOUND)]
        return self.most <= MOST and self.median <= 0.5 * random[0] and self.most <= 0.5 * random[1]


def page(cells: Sequence[Cell]) -> Iterator[str]:
    """The lines of the page."""
    seeds = len(cells[0].needed)
    sloped = [cell for cell in cells if cell.kind != "needle"]
    yield "# Planted failures"
    yield ""
    yield f"Does `harness falsify` find a failure within {MOST} flights, and with half of what random search needs?"
    yield ""
    yield "`python -m benchmarks.planted_failures` computes and writes this page (a few minutes)."
    yield "Functions stand for flights: each is below zero in a region of known volume, at a place drawn from the seed."
    yield f"{AT_ONCE} points are asked for at once, as the command does; {seeds} seeds each."
    yield ""
    yield from (f"- *{name}*: {kind.meaning}." for name, kind in KINDS.items())
    yield ""
    for share in SHARES:
        half, most = (needed_at_random(share, of) for of in (0.5, FOUND))
        yield f"## {share:.1%} of the volume fails"
        yield ""
        yield f"Flights until the first failure: the median of the seeds, in brackets what finds it in {FOUND:.0%} of"
        yield f"them; random search needs {half} ({most})."
        yield ""
        rows = [
            [name, "yes" if KINDS[name].is_smooth else "no", *map(_text, of)]
            for name in KINDS
            if (of := [cell for cell in sloped if cell.kind == name and cell.share == share])
        ]
        numbers = [f"{d} settings" for d in dict.fromkeys(cell.dimensions for cell in sloped)]
        yield from markdown(["landscape", "smooth", *numbers], rows, "llr")
        yield ""
    met, found = sum(cell.is_met for cell in sloped), sum(cell.found for cell in sloped)
    yield (
        f"{found} of {sum(len(cell.needed) for cell in sloped)} searches found it within {MOST} flights; {met} of "
        f"{len(sloped)} landscapes meet both aims."
    )
    yield ""
    yield "## Without a slope"
    yield ""
    for cell in cells:
        if cell.kind == "needle":
            yield (
                f"A needle of {cell.share:.1%} among {cell.dimensions} settings was found by {cell.found} of {seeds} "
                f"searches within {MOST} flights, the median with {_number(cell.median)}; uniform draws find it in "
                f"{1.0 - (1.0 - cell.share) ** MOST:.0%}."
            )
    yield (
        "Where nothing near a failure is worse than anywhere else, a model has nothing to go by: the points are spread "
        "evenly instead, as good as uniform draws."
    )
    yield "That is so for an outcome and for a truth value; a number tells more."


def _text(cell: Cell) -> str:
    return f"{_number(cell.median)} ({_number(cell.most)})" + ("" if cell.is_met else " missed")


def _number(flights: float) -> str:
    return f"{flights:.0f}" if math.isfinite(flights) else f"> {MOST}"


def main(
    kinds: Sequence[str] = tuple(KINDS),
    dimensions: Sequence[int] = DIMENSIONS,
    seeds: int = SEEDS,
    page_path: Path = PAGE,
    workers: int | None = None,
) -> list[Cell]:
    """Searches, and writes the page."""
    wanted = [
        (kind, d, share)
        for share in SHARES
        for kind in kinds
        for d in dimensions
        if kind != "needle" or (share == SHARES[0] and d == dimensions[0])
    ]
    jobs = [partial(_cell, *one, seeds) for one in wanted]
    done = {cell[:3]: cell for cell in computed(jobs, (os.cpu_count() or 1) if workers is None else workers)}
    cells = [done[one] for one in wanted]
    with replacing(page_path) as partial_page:
        partial_page.write_text("\n".join(page(cells)) + "\n", encoding="utf-8")
    print(page_path)
    return cells


def _cell(kind: str, dimensions: int, share: float, seeds: int) -> Cell:
    return Cell(kind, dimensions, share, [flights_needed(kind, dimensions, share, seed) for seed in range(seeds)])


if __name__ == "__main__":
    main()
