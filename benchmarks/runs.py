"""The cost of running many flights: `python -m benchmarks.runs [PAIRS [ROWS [SECONDS]]]`.

One worker against two, kinematic and 6-DOF, in turn; what a flight costs beside its simulation; and a directory with
ROWS finished flights, 100 000 if not said otherwise: how long until the next one flies, and the memory of the parent.
"""

import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from harness.key import files, identity, version_of
from harness.loop import simulate
from harness.provenance import provenance
from harness.runs.matrix import Matrix, read_matrix
from harness.runs.results import export, load_results
from harness.runs.row import result_of, row, simulate_safely
from harness.runs.run import Options, positions_done, run
from harness.runs.store import Store
from harness.runs.survey import survey
from harness.runs.workers import Task, WorkerResult, fly_task
from harness.settings import read_settings

SETTINGS = """\
[flight]
plant = "{plant}"
duration_s = {duration}
[flight.law]
name = "nftsm"
gains = "paper_1"
[matrix]
"start.heading_deg" = {{ uniform = [0.0, 360.0] }}
seed = {{ start = 0, count = {count} }}
"""


def matrix(folder: Path, plant: str, duration: float, count: int) -> Matrix:
    """So many flights of a plant."""
    file = folder / f"{plant}-{count}.toml"
    file.write_text(SETTINGS.format(plant=plant, duration=duration, count=count), encoding="utf-8")
    return read_matrix(read_settings(file))


def rate(of: Matrix, folder: Path, workers: int) -> float:
    """Flights per second from the first answers on, without the start of the processes."""
    first = first_done = 0.0
    for progress in run(of, folder, Options(workers=workers, log="none")):
        if progress.done and not first:
            first, first_done = time.monotonic(), progress.done
        last, last_done = time.monotonic(), progress.done
        if last_done == progress.total:
            break
    return (last_done - first_done) / (last - first)


def timed(task: Task, folder: Path) -> WorkerResult:
    """As a worker does it, with the processor time of the simulation in place of its wall time."""
    begin = time.process_time()
    log = simulate_safely(task.flight)
    result = result_of(log, time.process_time() - begin)
    return WorkerResult(result, version_of(task.flight).number)


def overhead(few: Matrix, many: Matrix, folder: Path) -> float:
    """Processor seconds of one more flight beside its simulation: of the parent and of its one worker together."""
    costs = []
    for of in (few, many):
        begin = used()
        for _ in run(of, folder / str(len(of)), Options(workers=1, log="none", fly=timed)):
            pass
        costs.append(used() - begin - float(load_results(folder / str(len(of)))["seconds"].sum()))
    return (costs[1] - costs[0]) / (len(many) - len(few))


def used() -> float:
    """Processor seconds of this process and of those that it started and that have ended."""
    usages = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


def fill(of: Matrix, folder: Path, count: int) -> None:
    """The store as after `count` flights: real settings and keys, each with the result of the first."""
    with Store(folder) as store:
        store.begin(provenance(of.file.path, of.file.text, "", ""))
        result = None
        for combination in of.combinations():
            if combination.position == count:
                break
            flight = of.flight(combination)
            result = result or result_of(simulate(flight), 0.01)
            one = identity(flight)
            store.add_version(one.version, files(flight))
            store.place(of.identifier, combination.position, one.key)
            store.add(row(flight, one, result), result, one.version.number, combination.position)


def began(task: Task, folder: Path) -> WorkerResult:
    """In a worker: tells that it flies."""
    (folder / "began").touch()
    return fly_task(task, folder)


def resume(file: Path, folder: Path) -> None:
    """What `harness run` does in a process of its own; prints seconds to the first flight, and the largest memory."""
    begin = time.monotonic()
    of = read_matrix(read_settings(file))
    for _ in survey(of, None, positions_done(of, folder, retry_failed=False)):
        pass
    for progress in run(of, folder, Options(workers=1, log="none", fly=began)):
        assert progress
    first = (folder / "began").stat().st_mtime - time.time() + time.monotonic() - begin
    export(folder)
    print(first, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)


def shown(values: list[float]) -> str:
    """Median and range."""
    return f"{statistics.median(values):.2f} ({min(values):.2f} to {max(values):.2f})"


def main(pairs: int = 5, rows: int = 100_000, duration: float = 100.0) -> None:
    """Print the numbers."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for plant, count in (("kinematic", 300), ("sixdof", 40)):
            of, ratios = matrix(folder, plant, duration, count), []
            for i in range(pairs):
                one, two = (rate(of, folder / f"{plant}-{i}-{workers}", workers) for workers in (1, 2))
                ratios.append(two / one)
            print(f"{plant}: two workers / one worker {shown(ratios)}")
        few, many = (matrix(folder, "kinematic", duration, count) for count in (20, 420))
        costs = [1e3 * overhead(few, many, folder / f"overhead-{i}") for i in range(pairs + 1)]
        print(f"a kinematic flight of {duration:g} s beside its simulation: {shown(costs[1:])} ms")
        of = matrix(folder, "kinematic", 1.0, rows + 5)
        fill(of, folder / "full", rows)
        words = [sys.executable, "-m", "benchmarks.runs", "resume", str(of.file.path), str(folder / "full")]
        done = subprocess.run(words, capture_output=True, text=True, check=True)
        seconds, memory = map(float, done.stdout.split())
        print(f"{rows} rows: {seconds:.2f} s to the next flight, {memory:.0f} MB in the parent with the export")


if __name__ == "__main__":
    if sys.argv[1:2] == ["resume"]:
        resume(Path(sys.argv[2]), Path(sys.argv[3]))
    else:
        main(*map(int, sys.argv[1:4]))
