"""What a cheaper plant saves as a guide to a search for failures: `python -m benchmarks.guided_falsify`.

First on 6-DOF flights, with and without the guide; then on functions, whose guide is wrong by as much as is wanted.
Writes docs/answers/guided_falsify.md.
"""

import math
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from benchmarks.planted_failures import needed_at_random, planted
from harness.compiled import engine
from harness.files import replacing
from harness.loop import simulate
from harness.pool import computed
from harness.requirement import OUTCOME, Requirement
from harness.search.dimension import dimension
from harness.search.falsify import GUIDING, Falsification, falsification, guide_to
from harness.search.flown import Candidate
from harness.search.model import Array
from harness.search.prober import Prober
from harness.search.space import Space
from harness.search.tune import AT_ONCE
from harness.settings import read_settings
from harness.tables import markdown

PAGE = Path("docs/answers/guided_falsify.md")
FILE = Path("experiments/falsify.toml")
SHARE = 0.01  # of the ranges, in which flights break what is asked
DRAWN = 150  # flights, from which it is known what that is
SEEDS = 6
TIMED = 5  # flights
MOST = 80  # flights
LANDSCAPES = ("bowl", "dips")
DIMENSIONS = 4
GUIDES: Mapping[str, float | None] = MappingProxyType(
    {"the same function": 0.0, "moved by 0.1": 0.1, "moved by 0.3": 0.3, "another function": None}
)


class Weakness(NamedTuple):
    """What 6-DOF flights are to break, and over which settings."""

    over: Sequence[str]
    metric: str
    meaning: str

    def space(self) -> Space:
        """Where it is searched."""
        return Space(read_settings(FILE, []), [dimension(text) for text in self.over])


_TARGET = ("start.heading_deg=0:360", "target.speed_mps=0:4", "target.heading_deg=0:360")
_WIND = ("start.heading_deg=0:360", "wind.steady_mps.north=-6:6", "wind.steady_mps.east=-6:6")
_GAINS = ("law.k2=0.5:20", "law.k3=0.1:10", "start.heading_deg=0:360")
WEAKNESSES: Mapping[str, Weakness] = MappingProxyType(
    {
        "target": Weakness(_TARGET, "range_error_peak_m", "a moving target, by the largest range error"),
        "wind": Weakness(_WIND, "range_error_rms_m", "wind, by the settled range error"),
        "gains": Weakness(_GAINS, "command_activity_deg_s2", "the gains, by the activity of the command"),
        "airspeed": Weakness(_WIND, "airspeed_deviation_rms_mps", "wind, by the deviation of the airspeed"),
    }
)


class Needed(NamedTuple):
    """The flights until the first failure, of each seed: inf where none of `MOST` failed."""

    what: str
    how: str  # without a guide, or which one
    of: Sequence[float]

    @property
    def median(self) -> str:
        return _number(float(np.quantile(self.of, 0.5, method="lower")))

    def __str__(self) -> str:
        return f"{self.median} ({_number(max(self.of))})"


def _number(flights: float) -> str:
    return f"{flights:.0f}" if math.isfinite(flights) else f"> {MOST}"


def fly(candidate: Candidate) -> None:
    """Flies it in this process."""
    logs = [simulate(flight) for flight in candidate.flights]
    candidate.facts = [{**log.metrics, OUTCOME: str(log.outcome)} for log in logs]


def drawn(weakness: str, seed: int, flights: int) -> list[float]:
    """The metric in 6-DOF flights that are drawn uniformly."""
    of = WEAKNESSES[weakness]
    space, found = of.space(), []
    for at in np.random.default_rng([seed, 7]).random((flights, len(of.over))).tolist():
        candidate = space.candidate({d.key: d.value(x) for d, x in zip(space.dimensions, at, strict=True)})
        fly(candidate)
        found.append(float(candidate.facts[0].get(of.metric) or 0.0))
    return found


def shares_of_time() -> tuple[float, float]:
    """The processor time of a trial of the guide over that of a 6-DOF flight, by Python and compiled."""
    space = WEAKNESSES["target"].space()
    guide = guide_to(space, None)
    assert guide
    (own,), (cheap,) = (of.middle.flights for of in (space, guide))
    took = []
    for flight, by in ((own, simulate), (cheap, simulate), (cheap, engine.simulate)):
        by(flight)  # loads and compiles
        begin = time.process_time()
        for _ in range(TIMED):
            assert by(flight).metrics
        took.append(time.process_time() - begin)
    return took[1] / took[0], took[2] / took[0]


def searched(weakness: str, border: float, guided: bool, seed: int, most: int) -> tuple[str, bool, float]:
    """How many 6-DOF flights a search takes until one breaks what is asked."""
    of = WEAKNESSES[weakness]
    space = of.space()
    guide = guide_to(space, None) if guided else None
    search = falsification(space, Requirement(of.metric, "<", border), flights=most, seed=seed, guide=guide)
    return weakness, guided, _first(search)


def _first(search: Falsification) -> float:
    for batch in search.batches():
        if search.first_broken:
            break
        for candidate in batch:
            fly(candidate)
    return search.first_broken or math.inf


def probed(kind: str, guide: str, seed: int, most: int) -> tuple[str, str, float]:
    """How many points a search of a function takes, whose guide is another one."""
    robustness = planted(kind, DIMENSIONS, SHARE, seed)
    known = None
    if guide:
        cheap, _ = _probed(_cheap(kind, guide, seed), Prober(DIMENSIONS, seed), GUIDING, stops=False)
        known = cheap.guide
    _, first = _probed(robustness, Prober(DIMENSIONS, seed, known), most, stops=True)
    return kind, guide, first


def _probed(function: Callable[[Array], Array], prober: Prober, most: int, *, stops: bool) -> tuple[Prober, float]:
    """A search, as the command makes it, and the number of its first failure."""
    first = math.inf
    for begin in range(0, most, AT_ONCE):
        batch = [prober.ask(prober.is_uniform(i)) for i in range(begin, min(begin + AT_ONCE, most))]
        for i, (probe, value) in enumerate(zip(batch, function(np.array([p.at for p in batch])).tolist(), strict=True)):
            prober.tell(probe, value)
            if value < 0.0:
                first = min(first, begin + i + 1)
        if stops and math.isfinite(first):
            break
    return prober, first


def _cheap(kind: str, guide: str, seed: int) -> Callable[[Array], Array]:
    moved = GUIDES[guide]
    if moved is None:
        return planted(kind, DIMENSIONS, SHARE, seed + 1000)
    way = np.random.default_rng([seed, 5]).standard_normal(DIMENSIONS)
    function = planted(kind, DIMENSIONS, SHARE, seed)
    return lambda x: function(x - moved * way / np.linalg.norm(way))


def page(
    flights: Sequence[Needed], functions: Sequence[Needed], borders: Mapping[str, float], times: tuple[float, float]
) -> Iterator[str]:
    """The lines of the page."""
    seeds = len(flights[0].of)
    yield "# A cheaper plant as a guide"
    yield ""
    yield "How many 6-DOF flights does `harness falsify` save by searching on a cheaper plant first?"
    yield ""
    without, guided = (", ".join(each.median for each in flights if bool(each.how) is how) for how in (False, True))
    yield f"**With it a failure takes {guided} flights on `sixdof`, without it {without} (medians, case by case).**"
    yield ""
    yield "`python -m benchmarks.guided_falsify` flies and writes this page (ten minutes on two processors)."
    yield f"Flights until the first failure: the median of {seeds} seeds, in brackets the most."
    yield f"{AT_ONCE} are flown at once, as the command does."
    yield ""
    yield "## 6-DOF flights"
    yield ""
    yield f"`experiments/falsify.toml`; what is asked is broken in {SHARE:.0%} of the ranges, by {DRAWN} flights drawn"
    yield f"uniformly. The guide are {GUIDING} trials on `coordinated`, which do not count."
    yield f"Random search needs {needed_at_random(SHARE, 0.5)} flights for one seed in two."
    yield ""
    rows = [
        [of.meaning, f"`{of.metric} < {borders[name]:.4g}`", *(str(each) for each in flights if each.what == name)]
        for name, of in WEAKNESSES.items()
        if name in borders
    ]
    yield from markdown(["over", "to be broken", "without a guide", "with the guide"], rows, "llrr")
    yield ""
    python, compiled = (f"{GUIDING * share:.2g}" for share in times)
    yield f"In time the {GUIDING} trials cost as much as {python} flights on `sixdof`, compiled as much as {compiled}."
    yield "The airspeed of a cheaper plant deviates elsewhere than that of the aircraft: of it the guide knows nothing."
    yield "`--guide none` searches without a guide; of a metric that the cheaper plant does not have there is none."
    yield ""
    yield "## How wrong a guide may be"
    yield ""
    yield f"Functions of {DIMENSIONS} settings from [Planted failures](planted_failures.md), guided by {GUIDING} points"
    yield "of the same function, of the function moved by a share of the range, or of another one of its kind."
    yield f"{SHARE:.0%} of the volume fails."
    yield ""
    hows = list(dict.fromkeys(each.how for each in functions))
    rows = [
        [what, *(str(each) for how in hows for each in functions if (each.what, each.how) == (what, how))]
        for what in dict.fromkeys(each.what for each in functions)
    ]
    yield from markdown(["landscape", *(how or "without a guide" for how in hows)], rows, "lr")


def main(
    weaknesses: Sequence[str] = tuple(WEAKNESSES),
    landscapes: Sequence[str] = LANDSCAPES,
    seeds: int = SEEDS,
    most: int = MOST,
    drawing: int = DRAWN,
    page_path: Path = PAGE,
    workers: int | None = None,
) -> tuple[list[Needed], list[Needed]]:
    """Searches, and writes the page."""
    workers = (os.cpu_count() or 1) if workers is None else workers
    parts = 10
    borders = {}
    for name in weaknesses:
        found = computed([partial(drawn, name, part, drawing // parts) for part in range(parts)], workers)
        borders[name] = float(np.quantile([x for part in found for x in part], 1.0 - SHARE))
    wanted = list(product(weaknesses, (False, True)))
    jobs = [partial(searched, name, borders[name], how, seed, most) for seed in range(seeds) for name, how in wanted]
    done = list(computed(jobs, workers))
    flights = [Needed(n, "guide" if how else "", [x for a, b, x in done if (a, b) == (n, how)]) for n, how in wanted]
    asked = list(product(landscapes, ("", *GUIDES)))
    tries = [partial(probed, *one, seed, most) for seed in range(seeds) for one in asked]
    known = list(computed(tries, workers))
    functions = [Needed(kind, how, [x for *other, x in known if tuple(other) == (kind, how)]) for kind, how in asked]
    with replacing(page_path) as partial_page:
        partial_page.write_text("\n".join(page(flights, functions, borders, shares_of_time())) + "\n", encoding="utf-8")
    print(page_path, *flights, *functions, sep="\n")
    return flights, functions


if __name__ == "__main__":
    main()
