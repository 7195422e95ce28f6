"""Compiled flights beside Python's, in one run: `python -m benchmarks.compiled [PAIRS [SEEDS]]`.

A flight of 100 s of the paper's law on each closed-form plant, alone and with its metrics, in turn, in processor time,
and the functions of `math` that it calls; a matrix of `experiments/monte_carlo.toml` on these plants, target
known, with its journal on two workers, 100 800 flights by kernels and a hundredth of them by Python, in processor
time of all processes; and the first compiled flight of a process, from the cache, in wall time.
"""

import dis
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from types import CodeType
from typing import Any, NamedTuple

import numpy as np

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
_LIBRARY = ("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sqrt", "hypot", "remainder")
_OF_TWO = ("atan2", "hypot", "remainder", "power")
_POWER = next(
    bytes([i.opcode, i.arg or 0])
    for i in dis.get_instructions(compile("x ** y", "", "eval"))
    if i.opname == "BINARY_OP"
)
_FIRST = """
import time
from benchmarks.compiled import FLIGHT, engine
begin = time.perf_counter()
assert not engine.why_plain(FLIGHT)
print(time.perf_counter() - begin)
"""


class Sped(NamedTuple):
    """How many times as fast a flight is compiled, in each pair, and the medians of what it takes, ms."""

    ratios: list[float]
    compiled: float
    python: float


def seconds(work: Callable[[], object]) -> float:
    """Processor time of one call."""
    begin = time.process_time()
    work()
    return time.process_time() - begin


def with_metrics(simulate: Callable[[Flight], FlightLog], flight: Flight) -> None:
    """Flies and judges."""
    measure(simulate(flight))


class Run(NamedTuple):
    """A run of so many flights, and the processor time of a flight, ms: of all processes, from the first check on."""

    flights: int
    cost: float


def run_of(folder: Path, seeds: int, *, compiled: bool) -> Run:
    """A run of the matrix with so many seeds, by two workers."""
    begin = used()
    settings = ("plant=" + str(list(PLANTS)), "estimator.kind=truth", f"seed={{start=0, count={seeds}}}")
    matrix = read_matrix(read_settings(MATRIX, settings))
    *_, size = survey(matrix)
    if compiled:
        assert engine_for(size, "compiled").compiled
    *_, progress = run(matrix, folder, Options(workers=2, log="none", compiled=compiled))
    assert progress.done == len(matrix)
    return Run(progress.done, 1e3 * (used() - begin) / progress.done)


def shown(values: list[float]) -> str:
    """Median and range."""
    return f"{statistics.median(values):.1f} ({min(values):.1f} to {max(values):.1f})"


def sped_up(flight: Flight, pairs: int, of: Callable[[Callable[[Flight], FlightLog], Flight], object]) -> Sped:
    """A flight by both engines, in turn."""
    plain, quick = [], []
    for _ in range(pairs):
        plain.append(1e3 * seconds(partial(of, loop.simulate, flight)))
        quick.append(1e3 * statistics.median(seconds(partial(of, engine.simulate, flight)) for _ in range(5)))
    ratios = [p / q for p, q in zip(plain, quick, strict=True)]
    return Sped(ratios, statistics.median(quick), statistics.median(plain))


@cache
def _powers(code: CodeType) -> frozenset[int]:
    """Where a code has x ** y, which calls `pow`."""
    text = code.co_code
    return frozenset(k for k in range(0, len(text), 2) if text[k : k + 2] == _POWER)


def called(flight: Flight) -> Counter[str]:
    """How often a flight calls each function of `math`, and `pow`."""
    found: Counter[str] = Counter()

    def note(frame: Any, event: str, function: Any) -> None:
        if event == "c_call" and function.__module__ == "math" and function.__name__ in _LIBRARY:
            found[function.__name__] += 1

    def trace(frame: Any, event: str, value: Any) -> Any:
        frame.f_trace_opcodes, frame.f_trace_lines = True, False
        if event == "opcode" and frame.f_lasti in _powers(frame.f_code):
            found["power"] += 1
        return trace

    for watch, noted in ((sys.setprofile, note), (sys.settrace, trace)):
        watch(noted)
        try:
            loop.simulate(flight)
        finally:
            watch(None)
    return found


def library_alone(flight: Flight) -> float:
    """What these functions take, ms, called in compiled code as often as in the flight, and nothing else."""
    from numba import njit

    from harness.compiled import arithmetic

    def of_one(function: Any) -> Any:
        def work(numbers: Any) -> float:
            total = 0.0
            for x in numbers:
                total += function(x)
            return total

        return njit(work)

    def of_two(function: Any) -> Any:
        def work(numbers: Any) -> float:
            total = 0.0
            for x in numbers:
                total += function(x, 0.7)
            return total

        return njit(work)

    took = 0.0
    for name, count in called(flight).items():
        work = (of_two if name in _OF_TWO else of_one)(getattr(arithmetic, name))
        numbers = np.random.default_rng(0).uniform(0.01, 1.0, count)
        work(numbers)
        took += 1e3 * min(seconds(partial(work, numbers)) for _ in range(20))
    return took


def metrics_alone(flight: Flight) -> float:
    """What the metrics of a flight take, ms."""
    log = engine.simulate(flight)
    return 1e3 * min(seconds(partial(measure, log)) for _ in range(50))


def block(pairs: int, seeds: int) -> Iterator[str]:
    """What was measured, in Markdown."""
    yield (
        f"`nftsm`, 100 s, 20 Hz, {os.cpu_count()} processors, {busy()}; times as fast, medians of {pairs} pairs and "
        "range:"
    )
    yield ""
    flown, judged = ["a flight", ""], ["a flight with its metrics", "20"]
    bound, judged_bound = ["functions of `math` alone", ""], ["these and the metrics alone", ""]
    took, library, measuring = (
        ["a compiled flight, ms", ""],
        ["of it functions of `math`, ms", ""],
        ["metrics, ms", ""],
    )
    for plant in PLANTS:
        flight = replace(FLIGHT, plant=plant)
        assert not engine.why_plain(flight)
        alone, both = sped_up(flight, pairs, lambda fly, one: fly(one)), sped_up(flight, pairs, with_metrics)
        flown.append(shown(alone.ratios))
        judged.append(shown(both.ratios))
        least, metrics, python = library_alone(flight), metrics_alone(flight), alone.python
        bound.append(f"{python / least:.0f}")
        judged_bound.append(f"{(python + metrics) / (least + metrics):.1f}")
        took.append(f"{alone.compiled:.2f}")
        library.append(f"{least:.2f}")
        measuring.append(f"{metrics:.2f}")
    rows = [flown, bound, judged, judged_bound, took, library, measuring]
    yield from markdown(["", "asked", *(f"`{plant}`" for plant in PLANTS)], rows)
    yield ""
    with tempfile.TemporaryDirectory() as folder:
        plain = run_of(Path(folder) / "python", max(1, seeds // 100), compiled=False)
        quick = run_of(Path(folder) / "compiled", seeds, compiled=True)
    words = [sys.executable, "-c", _FIRST]
    first = [float(subprocess.run(words, capture_output=True, text=True, check=True).stdout) for _ in range(pairs)]
    yield (
        f"- A flight of `{MATRIX.name}` on these plants, target known, with journal, two workers: "
        f"{quick.cost:.1f} ms of {quick.flights} flights, in Python {plain.cost:.1f} ms of {plain.flights}: "
        f"{plain.cost / quick.cost:.1f} times as fast (asked: 10)."
    )
    yield (
        f"- The first compiled flight of a process, from the cache: {statistics.median(first):.2f} s, "
        f"{min(first):.2f} s at least (asked: 0.5 s)."
    )


def main(pairs: int = 10, seeds: int = 5600, *, page: Path | None = None) -> None:
    """Print what was measured, and write it into the page."""
    text = "\n".join(block(pairs, seeds)) + "\n"
    print(text, end="")
    if page:
        keep(page, "benchmarks.compiled", text)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]), page=PAGE)
