"""Whether `harness tune` finds the gains of a fine grid with a tenth of its flights: python -m benchmarks.tuned_gains.

On each airframe the grid is flown wherever it keeps the margin to the limit cycle, and the search begins from several
seeds. Writes docs/answers/tuned_gains.md; the flights are kept in out/tuned_gains, so that it goes on where it stopped.
"""

import math
import os
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

import aircraft
from harness.files import replacing
from harness.limit_cycle.predicted import MARGIN
from harness.pool import computed
from harness.requirement import Requirement, requirement
from harness.runs.run import Options, Progress
from harness.runs.store import Store
from harness.search.dimension import Dimension
from harness.search.flown import Candidate, fly_batches
from harness.search.space import Space
from harness.search.tune import Tuning, tuning
from harness.settings import read_settings
from harness.tables import markdown, number

EXPERIMENT = Path("experiments/tune.toml")
PAGE = Path("docs/answers/tuned_gains.md")
OUT = Path("out/tuned_gains")
GOAL, QUIET, ENOUGH = "range_error_rms_m", "chatters = false", 1.5
RANGES = (Dimension("law.k2", 0.1, 20.0), Dimension("law.k3", 0.01, 10.0))  # 1/s
POINTS, SEEDS = 24, 5  # of the grid along each range; of the search
SHARE = 0.1  # of the grid's flights, for each search
NEAR, NEAR_M = 0.1, 1e-3  # a search finds the best when it comes so near to it


class Found(NamedTuple):
    """The best of the grid and of each search, on one airframe."""

    airframe: str
    grid: Sequence[tuple[Candidate, float]]  # what keeps the margin and is quiet, with its goal
    kept: int  # points of the grid that keep the margin
    searches: Sequence[Tuning]

    @property
    def best(self) -> float:
        return min(reached for _, reached in self.grid)

    @property
    def reached(self) -> list[float]:
        """The best of each search; inf where it found none."""
        return [search.front[0].goals[0] if search.front else math.inf for search in self.searches]

    def is_near(self, reached: float) -> bool:
        """Whether this is as good as the best of the grid: see `NEAR`."""
        return reached <= max((1.0 + NEAR) * self.best, self.best + NEAR_M)


def space_of(airframe: str) -> Space:
    """The gains, in the conditions of the experiment, on an airframe."""
    return Space(read_settings(EXPERIMENT, [f"aircraft={airframe}"]), RANGES)


def point(airframe: str, k2: float, k3: float) -> Candidate:
    """A point of the grid, with its margin."""
    return space_of(airframe).candidate({"law.k2": k2, "law.k3": k3}, [MARGIN])


def found(airframe: str, out: Path, points: int, seeds: int, workers: int) -> Found:
    """Flies the grid and the searches."""
    options = Options(workers=workers)
    sides = [[d.rounded(x) for x in np.geomspace(d.low, d.high, points).tolist()] for d in RANGES]
    jobs = [partial(point, airframe, k2, k3) for k2 in sides[0] for k3 in sides[1]]
    margin = Requirement(MARGIN, ">=", ENOUGH)
    kept = [each for each in computed(jobs, max(1, workers)) if all(map(margin.is_met, each.foreseen))]
    kept.sort(key=lambda each: tuple(each.values.values()))
    with Store(out / airframe / "grid") as store:
        for _ in fly_batches([kept], store, options, Progress(0)):
            pass
    searches = []
    space = space_of(airframe)
    flights = math.floor(SHARE * len(kept) * len(space.conditions))
    for seed in range(seeds):
        search = tuning(space, [GOAL], [requirement(QUIET)], margin=ENOUGH, flights=flights, seed=seed)
        for _ in search.fly(out / airframe / str(seed), options):
            pass
        searches.append(search)
    quiet = requirement(QUIET)
    grid = [
        (each, max(float(facts[GOAL] or 0.0) for facts in each.facts))
        for each in kept
        if all(map(quiet.is_met, each.facts))
    ]
    return Found(airframe, grid, len(kept), searches)


def at_random(of: Found, count: int) -> float:
    """The median of the best of so many points that are drawn at random from the grid."""
    reached = np.sort([value for _, value in of.grid])
    share = 1.0 - 0.5 ** (1.0 / count)  # the best of `count` lies with probability 1/2 in the best share of the grid
    return float(np.quantile(reached, share))


def page(results: Sequence[Found], points: int) -> Iterator[str]:
    """The lines of the page."""
    conditions = len(results[0].searches[0].space.conditions)
    yield "# Tuned gains"
    yield ""
    yield f"Does `harness tune` find the gains that a fine grid finds, with {SHARE:.0%} of its flights?"
    yield ""
    yield "`make tuned_gains` flies and writes this page (a quarter of an hour)."
    yield f"The conditions are those of `experiments/tune.toml`: {conditions} flights for each pair of gains, in still"
    yield "air and in 5 m/s of wind."
    yield "Minimised is the worse settled error (rms) of the two; each flight has to be quiet, and to keep 1.5 times"
    yield "away from the [predicted border](limit_cycle.md) of the limit cycle."
    k2, k3 = RANGES
    yield f"The grid has {points} values of k2 from {k2.low:g} to {k2.high:g} /s and as many of k3 from {k3.low:g} to"
    yield f"{k3.high:g} /s, each a constant factor from the next."
    yield "It is flown only where it keeps that margin, so that a tenth is a tenth of what is worth flying."
    yield ""
    yield from markdown(
        [
            "airframe",
            "pairs flown by the grid",
            "its best, mm",
            "at k2, k3",
            "pairs flown by a search",
            "best of each seed, mm",
            "as many at random, mm",
            "near",
        ],
        map(_row, results),
        "lrrrrrrr",
    )
    yield ""
    near = sum(of.is_near(reached) for of in results for reached in of.reached)
    yield (
        f"*Near* is within {NEAR:.0%} or {1e3 * NEAR_M:g} mm of the grid's best: {near} of "
        f"{sum(len(of.searches) for of in results)} searches are."
    )
    yield f"Of the grid itself {', '.join(_as_good(of) for of in results)} is that near."
    yield "*At random*: the median of the best of as many pairs of the grid, drawn at random."
    yield ""
    yield "## Where the best lies"
    yield ""
    yield "The best of each search, the border's margin at it, and how many pairs it refused before they were flown:"
    yield ""
    yield from markdown(
        ["airframe", "seed", "k2", "k3", "settled error, mm", "margin", "refused"], _bests(results), "lrrrrrr"
    )
    yield ""
    yield "Along the border the error hardly changes; towards lower gains it grows."
    yield "So the margin, and not chatter in the flights, is what ends the search on every airframe."


def _row(of: Found) -> list[str]:
    best, reached = min(of.grid, key=lambda pair: pair[1])
    count = of.searches[0].trials
    return [
        of.airframe,
        str(of.kept),
        number(reached, 1e3),
        ", ".join(f"{value:.3g}" for value in best.values.values()),
        str(count),
        ", ".join(number(value, 1e3) for value in of.reached),
        number(at_random(of, count), 1e3),
        f"{sum(map(of.is_near, of.reached))} of {len(of.searches)}",
    ]


def _as_good(of: Found) -> str:
    return f"{sum(of.is_near(reached) for _, reached in of.grid) / len(of.grid):.0%} ({of.airframe})"


def _bests(results: Sequence[Found]) -> Iterator[list[str]]:
    for of in results:
        for seed, search in enumerate(of.searches):
            best = search.front[0]
            refused = sum(count for count, before in search.refusals.values() if before)
            values = [f"{value:.3g}" for value in best.candidate.values.values()]
            yield [
                of.airframe,
                str(seed),
                *values,
                number(best.goals[0], 1e3),
                number(search.least(best, MARGIN)),
                str(refused),
            ]


def main(
    airframes: Sequence[str] = tuple(aircraft.names()),
    out: Path = OUT,
    page_path: Path = PAGE,
    points: int = POINTS,
    seeds: int = SEEDS,
    workers: int | None = None,
) -> list[Found]:
    """Flies and writes the page."""
    workers = (os.cpu_count() or 1) if workers is None else workers
    results = [found(airframe, out, points, seeds, workers) for airframe in airframes]
    with replacing(page_path) as partial_page:
        partial_page.write_text("\n".join(page(results, points)) + "\n", encoding="utf-8")
    print(page_path)
    return results


if __name__ == "__main__":
    main()
