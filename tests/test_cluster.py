"""Runs on a real Dask cluster: a scheduler and two workers on loopback, each a process that the tests kill."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

import psutil
import pytest

import harness
from harness.key import identity
from harness.runs import cluster as clusters
from harness.runs.cluster import _unfit, connected
from harness.runs.far import Report, versions
from harness.runs.journal import StoreError, reading
from harness.runs.wall_time import WallTime
from harness.runs.workers import Task, WorkersError
from tests.builders import ROOT, command, copied_airframe, digests, fly_matrix, invoke, words_of, write

LAW = '''
import os, signal
from dataclasses import dataclass
from autopilot.guidance import Context, LawStep
from autopilot.laws import law
from lying_beside import STANDOFF

@dataclass(frozen=True)
class Mine:
    """The paper's law, which may end its process and the worker above it."""

    standoff: float = STANDOFF
    max_heading_rate: float = 0.3
    deadly: bool = False
    command = "heading_rate"

    def start(self, context: Context) -> LawStep:
        if self.deadly:
            os.kill(os.getppid(), signal.SIGKILL)
            os.kill(os.getpid(), signal.SIGKILL)
        return law("nftsm", "paper_1").start(context)

    def broken_conditions(self, speed_ratio: float) -> list[str]:
        return []
'''
MATRIX = """\
[flight]
duration_s = 5.0
aircraft = "mine/my_wing"
[flight.law]
name = "mine/law.py:Mine"
[flight.target]
track = "mine/track.csv"
[matrix]
plant = ["kinematic", "sixdof"]
"start.heading_deg" = { uniform = [0.0, 360.0] }
seed = { start = 0, count = 2 }
"""
MANY = """\
[flight]
plant = "kinematic"
duration_s = 100.0
[flight.law]
name = "nftsm"
[matrix]
"start.heading_deg" = { uniform = [0.0, 360.0] }
seed = { start = 0, count = 160 }
"""

IMPATIENT = """\
from harness.cli.main import main
from harness.runs import cluster
cluster._CONNECTING = cluster._WITHOUT_WORKERS = 2.0
main()
"""


class Cluster(NamedTuple):
    scheduler: str  # its file
    process: int  # of the scheduler
    workers: list[int]  # the processes that start them again


def _started(folder: Path, *words: str) -> subprocess.Popen[bytes]:
    env = {**os.environ, "PYTHONPATH": str(ROOT), "FAR_AWAY": "1", "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0"}
    with (folder / "cluster.log").open("ab") as log:
        return subprocess.Popen(
            [sys.executable, "-m", *words, "--no-dashboard", "--host", "127.0.0.1"],
            stdout=log, stderr=log, env=env, cwd=folder,
        )  # fmt: skip


def _until(true: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 60.0
    while not true():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def _worker(folder: Path, file: Path, *words: str) -> subprocess.Popen[bytes]:
    given = ("--scheduler-file", str(file), "--local-directory", str(folder / "local"), *words)
    return _started(folder, "distributed.cli.dask_worker", *given)


@contextmanager
def _running(folder: Path, workers: int) -> Iterator[Cluster]:
    file = folder / "scheduler.json"
    processes = [_started(folder, "distributed.cli.dask_scheduler", "--port", "0", "--scheduler-file", str(file))]
    processes += [_worker(folder, file, "--nthreads", "1") for _ in range(workers)]
    _until(lambda: (folder / "cluster.log").read_text().count("Registered to:") == workers)
    nannies = [psutil.Process(process.pid) for process in processes[1:]]
    below = [child for nanny in nannies for child in nanny.children(recursive=True)]
    try:
        yield Cluster(str(file), processes[0].pid, [nanny.pid for nanny in nannies])
    finally:
        _end(processes, below)


def _end(processes: list[subprocess.Popen[bytes]], below: list[psutil.Process]) -> None:
    for process in reversed(processes):
        with suppress(psutil.NoSuchProcess):
            for child in psutil.Process(process.pid).children(recursive=True):
                child.kill()
        process.kill()
        process.wait()
    for child in below:  # of a nanny that a test killed
        with suppress(psutil.NoSuchProcess):
            child.kill()


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    with _running(tmp_path_factory.mktemp("cluster"), workers=2) as running:
        yield running


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A matrix whose law, airframe and track are the user's own."""
    mine = tmp_path / "mine"
    mine.mkdir()
    copied_airframe("aerosonde", mine / "my_wing")
    write(mine / "law.py", LAW)
    write(mine / "lying_beside.py", "STANDOFF = 200.0\n")
    write(mine / "track.csv", "time_s,north_m,east_m\n" + "".join(f"{t},{t},0\n" for t in range(62)))
    return write(tmp_path / "many.toml", MATRIX)


def _rows(out: Path) -> int:
    with suppress(StoreError), reading(out) as journal:
        ((count,),) = journal.execute("SELECT count(*) FROM flights")
        return int(count)
    return 0


def _until_more_than(rows: int, out: Path) -> None:
    _until(lambda: _rows(out) > rows)


def test_client_and_worker_are_killed_and_the_rows_are_those_of_a_run_at_home(cluster: Cluster, tmp_path: Path) -> None:
    file, far, home = write(tmp_path / "many.toml", MANY), tmp_path / "far", tmp_path / "home"
    words = words_of("run", file, "--out", far, "--engine", "python", "--dask", cluster.scheduler)
    for ended_by, code in ((signal.SIGKILL, -signal.SIGKILL), (signal.SIGINT, 130)):
        before = _rows(far)
        client = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        _until_more_than(before, far)
        client.send_signal(ended_by)
        assert client.wait(20) == code
    kept = _rows(far)
    assert 0 < kept < 160
    resumed = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    _until_more_than(kept, far)
    for process in psutil.Process(cluster.workers[0]).children(recursive=True):
        process.kill()
    said, _ = resumed.communicate(timeout=100)
    assert resumed.returncode == 0
    assert f"{160 - kept} flown, {kept} earlier, 0 failed" in said
    fly_matrix(file, home)
    assert digests(far) == digests(home)


def test_law_airframe_and_track_travel_and_recordings_come_home(cluster: Cluster, file: Path, tmp_path: Path) -> None:
    far, home, seeds = tmp_path / "far", tmp_path / "home", "seed=[1, 2]"
    done = command("run", file, "--out", far, "--dask", cluster.scheduler, "--set", seeds)
    assert done.returncode == 0, done.stderr
    fly_matrix(file, home, seeds)
    assert digests(far) == digests(home)
    assert {path.stem for path in (far / "flights").iterdir()} == {*digests(home)}
    assert set(harness.load_results(far)["law.name"]) == {f"{tmp_path}/mine/law.py:Mine"}


def test_a_flight_that_ends_every_worker_is_one_row(cluster: Cluster, file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    axes = ["law.deadly=[false, true]", "seed=[1]", "plant=kinematic", "aircraft=aerosonde"]
    sets = [word for axis in axes for word in ("--set", axis)]
    done = command("run", file, "--out", out, "--log", "none", "--dask", cluster.scheduler, *sets)
    assert done.returncode == 1, done.stderr
    results = harness.load_results(out).set_index("law.deadly")
    assert results["outcome"][True] == "worker_died"
    assert "the last one was tcp://127.0.0.1:" in results["reason"][True]
    assert results["outcome"][False] == "completed"


@pytest.mark.parametrize(
    ("what", "said"), [("scheduler", "the scheduler is gone"), ("workers", "all workers are gone")]
)
def test_a_scheduler_or_all_workers_that_end_are_one_line_and_rows_are_kept(
    what: str, said: str, tmp_path: Path
) -> None:
    file, out = write(tmp_path / "many.toml", MANY.replace("count = 160", "count = 2000")), tmp_path / "out"
    with _running(tmp_path, workers=1) as mine:
        words = words_of("run", file, "--out", out, "--engine", "python", "--log", "none", "--dask", mine.scheduler)
        client = subprocess.Popen(
            [sys.executable, "-c", IMPATIENT, *words[words.index("run") :]], stderr=subprocess.PIPE, text=True
        )
        _until_more_than(0, out)
        if what == "scheduler":
            psutil.Process(mine.process).kill()
        else:
            nanny = psutil.Process(mine.workers[0])
            below = nanny.children(recursive=True)
            for process in (nanny, *below):  # first the one that would start it again
                with suppress(psutil.NoSuchProcess):
                    process.kill()
        _, told = client.communicate(timeout=30)
    assert client.returncode == 2
    assert f"{mine.scheduler}: {said}; what was flown is kept, and the same command resumes the run" in told
    assert "distributed" not in told
    assert 0 < _rows(out) < 2000


def test_a_scheduler_that_ends_while_no_flight_is_out_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As between two batches of a search, or before the first flight."""
    monkeypatch.setattr(clusters, "_CONNECTING", 2.0)
    flight = harness.Flight(plant="kinematic", law=harness.law("nftsm"), duration=1.0)
    this = identity(flight)
    tasks = [Task(this.key, 0, flight, this.version.number, "none", compiled=False)]
    with _running(tmp_path, workers=1) as mine, connected(mine.scheduler) as cluster:
        psutil.Process(mine.process).kill()
        _until(lambda: cluster.client.status != "running")
        flying = cluster.fly_all(iter(tasks), tmp_path, wall_time=WallTime(), timeout=60.0, seconds=0.0)
        with pytest.raises(WorkersError, match="the scheduler is gone; what was flown is kept"):
            list(flying)


def test_in_python_a_matrix_is_flown_on_a_cluster(cluster: Cluster, tmp_path: Path) -> None:
    file = write(tmp_path / "many.toml", MANY.replace("count = 160", "count = 8"))
    far = harness.run(file, tmp_path / "far", dask=cluster.scheduler)
    home = harness.run(file, tmp_path / "home", workers=0)
    assert list(far["digest"]) == list(home["digest"])
    with pytest.raises(harness.ArgumentError, match="dask has workers of its own: leave one out"):
        harness.run(file, tmp_path / "far", dask=cluster.scheduler, workers=2)
    with pytest.raises(harness.HarnessError, match=r"nowhere\.json: there is no such file"):
        harness.run(file, tmp_path / "far", dask="nowhere.json")


def test_falsify_map_and_tune_fly_on_a_cluster_what_they_fly_at_home(cluster: Cluster, tmp_path: Path) -> None:
    file = write(tmp_path / "one.toml", MANY.partition("[matrix]")[0].replace("100.0", "5.0"))
    calls = {
        "falsify": ["--over", "law.k2=1:9", "--requirement", "range_error_peak_m<5", "--flights", 6],
        "map": ["--x", "law.k2=1:9", "--y", "start.heading_deg=0:90", "--resolution", 10, "--flights", 130],
        "tune": ["--over", "law.k2=1:9", "--minimise", "range_error_peak_m", "--flights", 6],
    }
    for name, words in calls.items():
        far, home = tmp_path / f"{name}_far", tmp_path / f"{name}_home"
        done = [
            invoke(name, file, "--out", out, *words, *how)
            for out, how in ((far, ["--dask", cluster.scheduler]), (home, ["--workers", 0]))
        ]
        assert done[0].exit_code == done[1].exit_code, done[0].output
        assert "2 workers at" in done[0].output
        assert digests(far)
        assert digests(far) == digests(home)


def test_a_law_that_cannot_be_loaded_on_a_worker_is_told_and_no_row(
    cluster: Cluster, file: Path, tmp_path: Path
) -> None:
    write(file.parent / "mine" / "law.py", 'import os\nif "FAR_AWAY" in os.environ:\n    import not_there\n' + LAW)
    plain = ("--set", "plant=kinematic", "--set", "aircraft=aerosonde")
    done = command("run", file, "--out", tmp_path / "out", "--dask", cluster.scheduler, *plain)
    assert done.returncode == 2
    assert "a law cannot be loaded there" in done.stderr
    assert "No module named 'not_there'" in done.stderr
    assert _rows(tmp_path / "out") == 0


def test_a_worker_with_two_threads_is_refused_before_anything_is_flown(
    cluster: Cluster, file: Path, tmp_path: Path
) -> None:
    worker = _worker(tmp_path, Path(cluster.scheduler), "--nthreads", "2", "--no-nanny")
    try:
        _until(lambda: "Registered to:" in (tmp_path / "cluster.log").read_text())
        done = command("run", file, "--out", tmp_path / "out", "--dask", cluster.scheduler)
    finally:
        worker.kill()
        worker.wait()
    assert done.returncode == 2
    assert "has 2 threads, must have 1: start it with --nthreads 1" in done.stderr.splitlines()[-1]


def test_a_worker_that_differs_is_told_with_what_to_install() -> None:
    mine = versions()
    other = {**mine, "numpy": "1.0", "Python": "2.7", "harness source": "0000"}
    reports: dict[str, Report | BaseException] = {
        "tcp://a:1": Report(mine, 1, ("a", 1)),
        "tcp://b:1": Report(other, 1, ("b", 1)),
        "tcp://c:1": ModuleNotFoundError("No module named 'harness'"),
        "tcp://d:1": Report({**mine, "processor": "another"}, 1, ("d", 1)),
        "tcp://d:2": Report(mine, 1, ("d", 1)),
    }
    b, c, d = _unfit(reports)
    assert b.startswith("tcp://b:1: harness source 0000 there, ")
    assert (
        f"install there Python {mine['Python']}, the harness from this source, pip install numpy=={mine['numpy']}" in b
    )
    assert c == "tcp://c:1: No module named 'harness': install this standoff-harness there, with [dask]"
    assert d == "tcp://d:2: is in one process with tcp://d:1, must have its own"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["somewhere"], "must be HOST:PORT"),
        (["tls://127.0.0.1:8786"], "TLS needs certificates: set DASK_DISTRIBUTED__COMM__TLS__CA_FILE"),
        (["gone.json"], "gone.json: there is no such file"),
        (["127.0.0.1:8786", "--workers", "2"], "leave one out"),
    ],
)
def test_a_cluster_that_is_none_is_one_line(words: list[str], said: str, file: Path, tmp_path: Path) -> None:
    done = invoke("run", file, "--out", tmp_path / "out", "--dask", *words, "--set", "seed=1")
    assert done.exit_code != 0
    assert said in done.output + str(done.exception)


def test_without_the_package_a_line_says_what_to_install(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    done = invoke("run", file, "--out", tmp_path / "out", "--dask", "127.0.0.1:8786")
    assert done.exit_code != 0
    assert "pip install 'standoff-harness[dask]'" in done.output + str(done.exception)
