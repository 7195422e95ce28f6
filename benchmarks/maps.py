"""What `harness map` finds with how many flights: python -m benchmarks.maps [--flights].

Planted borders are held against their full grids, and against a quadtree that divides every square to the last step.
With --flights a map of the kinematic aircraft is held against its grid, and one on 6-DOF is timed
(ten minutes), and docs/answers/maps.md is written.
"""

import argparse
import itertools
import math
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from scipy.ndimage import distance_transform_cdt

import harness
from harness.files import write_text
from harness.log.metric import measure
from harness.runs.engine import engine_for
from harness.runs.run import Options
from harness.runs.survey import survey
from harness.search.border import Answer, BorderSearch
from harness.search.dimension import dimension
from harness.search.map import Map, map_of, question
from harness.search.picture import drawn
from harness.search.space import Space
from harness.settings import read_settings

PAGE = Path("docs/answers/maps.md")
SIDE = 200
EVERY = 4  # th point of a full grid that is flown
_BASIN = Path("experiments/basin.toml")
_GAINS = Path("experiments/gains.toml")
Planted = Callable[[float, float], bool]


def disc(x: float, y: float, radius: float) -> Planted:
    """A round island."""
    return lambda u, v: math.hypot(u - x, v - y) < radius


def tongues(half: float) -> Planted:
    """Four tongues that end in points, each so wide at its root."""
    return lambda u, v: v < 0.1 or any(abs(u - c) < half * (0.9 - v) / 0.8 for c in (0.17, 0.39, 0.61, 0.83))


PLANTED: dict[str, Planted] = {
    "a straight line": lambda u, v: v > 0.31 + 0.2 * u,
    "a wave": lambda u, v: v > 0.5 + 0.3 * math.sin(5.0 * u),
    "a closed border, 0.6 wide": disc(0.52, 0.47, 0.3),
    "a ring, 0.06 wide": lambda u, v: 0.2 < math.hypot(u - 0.5, v - 0.5) < 0.26,
    "three islands, 0.1 wide": lambda u, v: any(
        disc(*at, 0.05)(u, v) for at in ((0.2, 0.3), (0.613, 0.377), (0.7, 0.8))
    ),
    "four tongues, 0.12 wide": tongues(0.06),
    "four tongues, 0.04 wide": tongues(0.02),
    "two spirals": lambda u, v: math.sin(math.atan2(v - 0.5, u - 0.5) + 12.0 * math.hypot(u - 0.5, v - 0.5)) > 0.0,
}


def searched(planted: Planted) -> BorderSearch:
    """The border found."""
    border = BorderSearch.of(SIDE)
    while asked := border.asked():
        for x, y in asked:
            border.answers[x, y] = planted(x / border.side, y / border.side)
    return border


def quadtree(planted: Planted) -> int:
    """The flights of a quadtree on the same coarse points, which divides each square whose corners differ."""
    border = BorderSearch.of(SIDE)
    answers: dict[tuple[int, int], bool] = {}

    def visit(x: int, y: int, side: int) -> None:
        corners = [(x, y), (x + side, y), (x, y + side), (x + side, y + side)]
        for at in corners:
            answers.setdefault(at, planted(at[0] / border.side, at[1] / border.side))
        if side > 1 and len({answers[at] for at in corners}) > 1:
            for i, j in ((0, 0), (1, 0), (0, 1), (1, 1)):
                visit(x + i * side // 2, y + j * side // 2, side // 2)

    for x, y in border.first:
        if x < border.side and y < border.side:
            visit(x, y, border.coarse)
    return len(answers)


def grid(planted: Planted, side: int) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """The full grid."""
    return np.array([[planted(x / side, y / side) for x in range(side + 1)] for y in range(side + 1)], dtype=bool)


def planted_lines() -> Iterator[str]:
    """A row for each planted border."""
    for name, planted in PLANTED.items():
        border = searched(planted)
        full, found = grid(planted, border.side), border.filled().astype(bool)
        away = np.where(found, distance_transform_cdt(~full, "chessboard"), distance_transform_cdt(full, "chessboard"))
        wrong = found != full
        beyond = int((wrong & (away > 1)).sum())
        flights = len(border.answers)
        yield (
            f"| {name} | {flights} | 1/{full.size / flights:.0f} | {quadtree(planted)} | {100 * wrong.mean():.2f} % | "
            f"{100 * beyond / full.size:.2f} % |"
        )


def missed_lines(trials: int) -> Iterator[str]:
    """The share of islands and tongues of some widths that is found, anywhere."""
    random = np.random.default_rng(0)
    for width in (0.06, 0.05, 0.04, 0.03, 0.02, 0.01):
        islands = sum(
            any(searched(disc(u, v, width / 2)).answers.values()) for u, v in random.uniform(0.1, 0.9, (trials, 2))
        )
        reach = []
        for u, slope in random.uniform((0.2, -0.2), (0.8, 0.2), (trials, 2)):
            border = searched(_tongue(u, slope, width))
            reach.append(max(y for (_, y), answer in border.answers.items() if answer) / border.side)
        followed = sum(each > 0.88 for each in reach)
        yield f"| {width:g} | {100 * islands / trials:.0f} % | {100 * followed / trials:.0f} % |"


def _tongue(at: float, slope: float, width: float) -> Planted:
    return lambda u, v: v < 0.2 or (v < 0.9 and abs(u - at - slope * (v - 0.2)) < width / 2)


def flown_lines(workers: int) -> Iterator[str]:
    """A map of the kinematic aircraft and one on 6-DOF; then the first held against every fourth point of its grid."""
    basin, seconds = _flown(
        _BASIN, ["start.position_m.east=-400:400", "start.heading_deg=0:360"], "converged", ["plant=kinematic"], workers
    )
    yield _line("start position and heading, kinematic", basin, seconds)
    over = ["law.k2=0.5:20", "law.k3=0:10"]
    yield _line("k2 and k3, 6-DOF", *_flown(_GAINS, over, "chatters", ["plant=sixdof", "duration_s=100"], workers))
    (panel,) = basin.panels
    filled, side = panel.border.filled(), panel.border.side
    at = range(0, side + 1, EVERY)
    wrong = off = 0
    for x, y in itertools.product(at, at):
        (flight,) = basin.space.candidate(basin.values(panel, (x, y)), (), panel.conditions).flights
        answer: Answer = measure(harness.simulate(flight))["convergence_time_s"] is not None
        wrong += answer is not filled[y, x]
        off += answer not in filled[max(0, y - 1) : y + 2, max(0, x - 1) : x + 2]
    yield ""
    yield f"Of {len(at) ** 2} points of the first map's full grid, every fourth each way, {wrong} have another answer"
    yield f"than the map, {off} of them by more than a step."


def _line(name: str, found: Map, seconds: float) -> str:
    flights = sum(panel.flights for panel in found.panels)
    return f"| {name} | {flights} | 1/{found.full / flights:.0f} | {seconds:.0f} s |"


def _flown(file: Path, over: list[str], of: str, overrides: list[str], workers: int) -> tuple[Map, float]:
    space = Space(read_settings(file, overrides), [dimension(text) for text in over])
    found = map_of(space, question(of), resolution=SIDE)
    folder = Path("out/maps") / file.stem / str(time.time_ns())
    folder.mkdir(parents=True)
    begin = time.monotonic()
    (*_, middle) = survey(space.tried[1])
    engine = engine_for(middle, None, found.flights / middle.flights)  # as the command does
    for _ in found.fly(folder, Options(workers=workers, compiled=engine.compiled)):
        pass
    seconds = time.monotonic() - begin
    drawn(found).savefig(folder / "map.png", dpi=200)
    return found, seconds


HEAD = """\
# Maps

What `harness map` finds with how many flights, measured by `python -m benchmarks.maps --flights`.
[Map two settings](../guide/map.md) says how it looks for a border.

## Planted borders

Each is held against its full grid of 201 x 201 points.
*Wrong* is the share of these points whose answer is another than the map's; *off* the share of those that are wrong by
more than one step of 1/200.
The quadtree starts from the same coarse points and divides every square whose corners differ, to the last step.

| border | flights | of the full grid | quadtree | wrong | off |
|---|--:|--:|--:|--:|--:|
"""
MISSED = """
## What is missed

The coarse lattice has 26 x 26 points, 0.04 of the range apart.
An island between them is not seen; one that is wider than 0.057, the diagonal of a square, always holds a point.
A tongue is followed from where an edge that is flown shows it.
Of {trials} islands and as many tongues of one width at random places these were found, the tongues to their end:

| width over the range | islands | tongues |
|--:|--:|--:|
"""
FLOWN = """
## Flights

Wall times with {workers} workers, on a machine whose two processors had {load:.0f} other processes waiting for them.

| map | flights | of the full grid | wall time |
|---|--:|--:|--:|
"""


def main(trials: int = 100, *, workers: int = 2, flights: bool = False) -> None:
    """Prints what it measures; with `flights` it writes the page."""
    parts = [(HEAD, planted_lines()), (MISSED.format(trials=trials), missed_lines(trials))]
    if flights:
        parts.append((FLOWN.format(workers=workers, load=os.getloadavg()[2]), flown_lines(workers)))
    said = ""
    for head, found in parts:
        print(head, end="", flush=True)
        said += head
        for line in found:
            print(line, flush=True)
            said += f"{line}\n"
    if flights:
        write_text(PAGE, said)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", action="store_true", help="fly, too")
    main(flights=parser.parse_args().flights)
