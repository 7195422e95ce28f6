"""Falsify beside CMA-ES and Optuna, on planted failures: `python -m benchmarks.planted_peers`.

Needs the packages cma and optuna, which the harness does not: `pip install cma optuna`. Writes
docs/answers/planted_peers.md.
"""

import importlib.util
import math
import os
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from types import MappingProxyType

import numpy as np

from benchmarks.planted_failures import KINDS, MOST, SHARES, Cell, flights_needed, needed_at_random, planted
from harness.files import replacing
from harness.pool import computed
from harness.search.tune import AT_ONCE
from harness.tables import markdown

PAGE = Path("docs/answers/planted_peers.md")
DIMENSIONS = (2, 4, 6)
SEEDS = 10


def by_cma(kind: str, dimensions: int, share: float, seed: int) -> float:
    """Flights until the first failure by CMA-ES, started anew at random where it has converged; inf for none."""
    import cma

    robustness, draws, flown = planted(kind, dimensions, share, seed), np.random.default_rng([seed, 9]), 0
    options = {"bounds": [0, 1], "verbose": -9}
    while True:
        start, own = draws.random(dimensions), int(draws.integers(1, 2**31))
        strategy = cma.CMAEvolutionStrategy(start, 0.3, {**options, "seed": own})
        while not strategy.stop():
            points = strategy.ask()
            values = robustness(np.array(points)).tolist()
            for value in values:
                flown += 1
                if flown > MOST:
                    return math.inf
                if value < 0.0:
                    return flown
            strategy.tell(points, values)


def by_tpe(kind: str, dimensions: int, share: float, seed: int, at_once: int = 1) -> float:
    """Flights until the first failure by Optuna's multivariate TPE, which asks for so many at once; inf for none."""
    import optuna

    warnings.simplefilter("ignore")  # its options are called experimental
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    robustness = planted(kind, dimensions, share, seed)
    sampler = optuna.samplers.TPESampler(seed=seed, multivariate=True, constant_liar=at_once > 1)
    study = optuna.create_study(sampler=sampler)
    for begin in range(0, MOST, at_once):
        trials = [study.ask() for _ in range(min(at_once, MOST - begin))]
        points = [[trial.suggest_float(str(i), 0.0, 1.0) for i in range(dimensions)] for trial in trials]
        values = robustness(np.array(points)).tolist()
        for i, value in enumerate(values):
            if value < 0.0:
                return begin + i + 1
        for trial, value in zip(trials, values, strict=True):
            study.tell(trial, value)
    return math.inf


SEARCHES: Mapping[str, Callable[[str, int, float, int], float]] = MappingProxyType(
    {
        f"harness falsify, {AT_ONCE} at once": flights_needed,
        f"TPE, {AT_ONCE} at once": partial(by_tpe, at_once=AT_ONCE),
        "TPE, one at a time": by_tpe,
        "CMA-ES": by_cma,
    }
)


def searched(search: str, kind: str, dimensions: int, share: float) -> tuple[str, Cell]:
    """A landscape over the seeds, by one search."""
    needed = [SEARCHES[search](kind, dimensions, share, seed) for seed in range(SEEDS)]
    return search, Cell(kind, dimensions, share, needed)


def page(results: list[tuple[str, Cell]]) -> Iterator[str]:
    """The page, in Markdown."""

    def number(x: float) -> str:
        return f"{x:.0f}" if math.isfinite(x) else f"> {MOST}"

    yield "# Planted failures: other searches"
    yield "\nDoes a search that is made elsewhere find planted failures with fewer flights than `harness falsify`?\n"
    yield "`python -m benchmarks.planted_peers` writes this page (a minute or two); it needs cma and optuna."
    yield "The landscapes are those of [planted failures](planted_failures.md), without the needle, which has no slope."
    yield f"{SEEDS} seeds each. TPE is Optuna's, multivariate; CMA-ES begins anew at random where it has converged."
    yield "A search that asks for several flights at once keeps several workers busy, and knows less when it asks."
    for share in SHARES:
        yield f"\n## {100 * share:.1f}% of the volume fails\n"
        yield "Flights until the first failure: the median of the seeds, and in brackets how many seeds found it within"
        yield f"{MOST}; the median of random search is {needed_at_random(share, 0.5)}.\n"
        rows = []
        for kind in KINDS:
            for dimensions in DIMENSIONS:
                cells = {
                    search: cell
                    for search, cell in results
                    if (cell.kind, cell.dimensions, cell.share) == (kind, dimensions, share)
                }
                if cells:
                    told = (f"{number(cells[s].median)} ({cells[s].found})" for s in SEARCHES)
                    rows.append((kind, str(dimensions), *told))
        yield from markdown(("landscape", "settings", *SEARCHES), rows, "lr")
    yield ""
    for search in SEARCHES:
        needed = [x for name, cell in results if name == search for x in cell.needed]
        found = sum(map(math.isfinite, needed))
        median = number(float(np.median(needed)))
        yield f"- {search}: {found} of {len(needed)} searches found it; the median took {median}."


def main() -> None:
    """Searches everywhere by each, and writes the page."""
    if missing := [name for name in ("cma", "optuna") if importlib.util.find_spec(name) is None]:
        print(f"{' and '.join(missing)} not installed, which this needs: pip install cma optuna", file=sys.stderr)
        sys.exit(2)
    jobs = [
        partial(searched, search, kind, dimensions, share)
        for share in SHARES
        for kind in KINDS
        if kind != "needle"
        for dimensions in DIMENSIONS
        for search in SEARCHES
    ]
    results = []
    for result in computed(jobs, os.cpu_count() or 1):
        print(result[0], *result[1][:3], result[1].median, result[1].found, flush=True)
        results.append(result)
    with replacing(PAGE) as partial_page:
        partial_page.write_text("\n".join(page(results)) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
