"""Compiled flights beside Python's, in one run: `python -m benchmarks.compiled [PAIRS [FLIGHTS]]`.

A flight of 100 s of the paper's law on each closed-form plant, alone and with its metrics, in turn, in processor time;
a matrix of `experiments/monte_carlo.toml` on these plants, target known, with its journal on two workers, so many
flights by kernels and a quarter of them by Python, in processor time of all processes; and the first compiled flight of
a process, from the cache, in wall time.
"""

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

from autopilot.laws import law
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

PLANTS = ("kinematic", "lagged", "coordinated")
FLIGHT = Flight(plant="kinematic", law=law("nftsm"))
MATRIX = Path("experiments/monte_carlo.toml")
_FIRST = """
import time
from benchmarks.compiled import FLIGHT, engine
begin = time.perf_counter()
assert not engine.why_plain(FLIGHT)
print(time.perf_counter() - begin)
"""


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


def main(pairs: int = 10, flights: int = 1200) -> None:
    """Print the ratios."""
    for plant in PLANTS:
        flight = replace(FLIGHT, plant=plant)
        assert not engine.why_plain(flight)
        for what, of in (("alone", lambda fly, one: fly(one)), ("with metrics", with_metrics)):
            ratios, quick = [], []
            for _ in range(pairs):
                plain = seconds(partial(of, loop.simulate, flight))
                quick.append(1e3 * statistics.median(seconds(partial(of, engine.simulate, flight)) for _ in range(5)))
                ratios.append(1e3 * plain / quick[-1])
            print(f"{plant}, {what}: {shown(ratios)} times as fast; compiled {statistics.median(quick):.2f} ms")
    with tempfile.TemporaryDirectory() as folder:
        plain = cost(Path(folder) / "python", flights // 4, compiled=False)
        low = cost(Path(folder) / "compiled", flights, compiled=True)
    print(
        f"a flight of {MATRIX.stem} on two workers with journal: {low:.1f} ms (of {flights}), Python {plain:.1f} ms "
        f"(of {flights // 4}): {plain / low:.1f} times as fast"
    )
    words = [sys.executable, "-c", _FIRST]
    first = [float(subprocess.run(words, capture_output=True, text=True, check=True).stdout) for _ in range(pairs)]
    print(f"the first compiled flight of a process: {statistics.median(first):.2f} s ({min(first):.2f} s at least)")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
