"""Compiled flights beside Python's, in one run: `python -m benchmarks.compiled [PAIRS [FLIGHTS]]`.

A flight of 100 s of the paper's law on each closed-form plant, alone and with its metrics, in turn, in processor time;
a matrix of `experiments/monte_carlo.toml` on these plants, target known, with its journal on two workers, so many
flights by kernels and a quarter of them by Python, in processor time of all processes; and the first compiled flight of
a process, from the cache, in wall time.
"""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

from autopilot.laws import law
from benchmarks.measured import busy, keep
from benchmarks.runs import used
from harness import loop
from harness.compiled import engine
from harness.flight import Flight
from harness.log import FlightLog
from harness.log.metric import measure
from harness.runs.engine import engine_for
from harness.runs.matrix import read_matrix
from harness.runs.run import Options, run
from harness.runs.survey import survey
from harness.settings import read_settings
from harness.tables import markdown

PLANTS = ("kinematic", "lagged", "coordinated")
FLIGHT = Flight(plant="kinematic", law=law("nftsm"))
MATRIX = Path("experiments/monte_carlo.toml")
PAGE = Path("docs/guide/many_flights.md")
_FIRST = """
import time
from benchmarks.compiled import FLIGHT, engine
begin = time.perf_counter()
assert not engine.why_plain(FLIGHT)
print(time.perf_counter() - begin)
"""


class Sped(NamedTuple):
    """How many times as fast a flight is compiled, in each pair, and what it takes then, ms."""

    ratios: list[float]
    compiled: float


def seconds(work: Callable[[], object]) -> float:
    """Processor time of one call."""
    begin = time.process_time()
    work()
    return time.process_time() - begin


def with_metrics(simulate: Callable[[Flight], FlightLog], flight: Flight) -> None:
    """Flies and judges."""
    measure(simulate(flight))


def cost(folder: Path, flights: int, *, compiled: bool) -> float:
    """Processor time of a flight of the matrix, ms: of the run and of its two workers, from their start on."""
    settings = ("plant=" + str(list(PLANTS)), "estimator.kind=truth")
    matrix = read_matrix(read_settings(MATRIX, settings))
    *_, size = survey(matrix, flights)
    if compiled:
        assert engine_for(size, "compiled").compiled
    begin = used()
    for _ in run(matrix, folder, Options(workers=2, log="none", limit=flights, compiled=compiled)):
        pass
    return 1e3 * (used() - begin) / flights


def shown(values: list[float]) -> str:
    """Median and range."""
    return f"{statistics.median(values):.1f} ({min(values):.1f} to {max(values):.1f})"


def sped_up(flight: Flight, pairs: int, of: Callable[[Callable[[Flight], FlightLog], Flight], object]) -> Sped:
    """A flight by both engines, in turn."""
    ratios, quick = [], []
    for _ in range(pairs):
        plain = seconds(partial(of, loop.simulate, flight))
        quick.append(1e3 * statistics.median(seconds(partial(of, engine.simulate, flight)) for _ in range(5)))
        ratios.append(1e3 * plain / quick[-1])
    return Sped(ratios, statistics.median(quick))


def block(pairs: int, flights: int) -> Iterator[str]:
    """What was measured, in Markdown."""
    yield (
        f"`nftsm`, 100 s, 20 Hz, {os.cpu_count()} processors, {busy()}; times as fast, medians of {pairs} pairs and "
        "range:"
    )
    yield ""
    rows = {"alone": ["a flight", "45 to 80"], "metrics": ["a flight with its metrics", "20"]}
    times = ["a compiled flight, ms", ""]
    for plant in PLANTS:
        flight = replace(FLIGHT, plant=plant)
        assert not engine.why_plain(flight)
        alone, judged = sped_up(flight, pairs, lambda fly, one: fly(one)), sped_up(flight, pairs, with_metrics)
        rows["alone"].append(shown(alone.ratios))
        rows["metrics"].append(shown(judged.ratios))
        times.append(f"{alone.compiled:.2f}")
    yield from markdown(["", "asked", *(f"`{plant}`" for plant in PLANTS)], [*rows.values(), times])
    yield ""
    with tempfile.TemporaryDirectory() as folder:
        plain = cost(Path(folder) / "python", flights // 4, compiled=False)
        low = cost(Path(folder) / "compiled", flights, compiled=True)
    words = [sys.executable, "-c", _FIRST]
    first = [float(subprocess.run(words, capture_output=True, text=True, check=True).stdout) for _ in range(pairs)]
    yield (
        f"- A flight of `{MATRIX.name}` on these plants, target known, with journal, two workers: {low:.1f} ms of "
        f"{flights} flights, in Python {plain:.1f} ms of {flights // 4}: {plain / low:.1f} times as fast (asked: 10)."
    )
    yield (
        f"- The first compiled flight of a process, from the cache: {statistics.median(first):.2f} s, "
        f"{min(first):.2f} s at least (asked: 0.5 s)."
    )


def main(pairs: int = 10, flights: int = 1200, *, page: Path | None = None) -> None:
    """Print what was measured, and write it into the page."""
    text = "\n".join(block(pairs, flights)) + "\n"
    print(text, end="")
    if page:
        keep(page, "benchmarks.compiled", text)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]), page=PAGE)
