"""What may go wrong while many flights are flown, really done: killed processes, full disks, damaged files."""

import contextlib
import ctypes
import gc
import itertools
import os
import random
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pandas as pd
import psutil
import pytest
from pebble.pool.channel import WorkerChannel

import harness
from autopilot.guidance import Guidance, LawStep, Observation
from harness.runs.workers import Task, WorkerResult, fly_task
from tests.builders import WORKERS, OwnLaw, command, digests, fly_matrix, invoke, python, turning, words_of, write
from tests.processes import KINEMATIC, ended, runs_of, session, settings, started, until, words


def busy(parent: subprocess.Popen[str]) -> list[psutil.Process]:
    """The workers that have used some processor time: they fly."""
    found = []
    for child in psutil.Process(parent.pid).children():
        with contextlib.suppress(psutil.Error):  # ended meanwhile
            if "spawn_main" in " ".join(child.cmdline()) and sum(child.cpu_times()[:2]) > 1.3:
                found.append(child)
    return found


def test_a_parent_killed_at_ten_moments_loses_no_flight_and_flies_none_twice(tmp_path: Path) -> None:
    file = settings(tmp_path, count=250, duration=160.0)
    fly_matrix(file, tmp_path / "undisturbed")
    out, moments = tmp_path / "out", random.Random(4)
    kept: dict[str, int] = {}
    killed = 0
    for i in range(10):
        process = started(file, out)
        while i % 2 and process.poll() is None and len(runs_of(out)) == len(kept):
            time.sleep(0.02)  # every other one is killed in flight, the others perhaps while they start
        time.sleep(moments.uniform(0.0, 0.3 if i % 2 else 1.2))
        process.kill()
        process.communicate()
        killed += process.returncode == -signal.SIGKILL
        assert ended(process.pid, within=3.0), session(process.pid)
        now = runs_of(out)
        assert kept.items() <= now.items()  # not lost, and not flown again
        kept = now
    assert killed >= 5
    assert kept
    done = command(*words(file, out))
    assert done.returncode == 0, done.stderr
    assert kept.items() <= runs_of(out).items()
    assert digests(out) == digests(tmp_path / "undisturbed")


def die(task: Task, folder: Path) -> WorkerResult:
    """Flies, but for two flights, where it is killed."""
    if task.position in (3, 17):
        os.kill(os.getpid(), signal.SIGKILL)
    return fly_task(task, folder)


def test_a_flight_that_kills_its_worker_is_one_row_and_costs_no_other(tmp_path: Path) -> None:
    file = settings(tmp_path, count=40)
    fly_matrix(file, tmp_path / "undisturbed")
    progress = fly_matrix(file, tmp_path / "out", options=replace(WORKERS, fly=die))
    assert (progress.done, progress.failed) == (40, 2)
    results = harness.load_results(tmp_path / "out").set_index("seed")
    assert results.index[results["outcome"] == "worker_died"].tolist() == [3, 17]
    assert "its worker was ended by SIGKILL" in results["reason"][3]
    alone = harness.load_results(tmp_path / "undisturbed").set_index("seed")
    others = results["outcome"] == "completed"
    assert others.sum() == 38
    assert (results["digest"][others] == alone["digest"][others]).all()
    # The machine may have killed it: the same command flies it again.
    assert fly_matrix(file, tmp_path / "out", options=WORKERS).done == 2
    assert digests(tmp_path / "out") == digests(tmp_path / "undisturbed")


def test_a_worker_that_is_killed_from_outside_is_one_row(tmp_path: Path) -> None:
    file = settings(tmp_path, count=3, duration=1000.0, plant="sixdof")
    process = started(file, tmp_path / "out")

    until(lambda: busy(process), process)
    busy(process)[0].kill()
    _, errors = process.communicate(timeout=120)
    assert process.returncode == 1, errors
    assert Counter(harness.load_results(tmp_path / "out")["outcome"]) == {"completed": 2, "worker_died": 1}


def die_with_the_lock(task: Task, folder: Path) -> WorkerResult:
    """Flies, but for one flight, where the worker is killed while it has the lock that it shares with the others."""
    if task.position == 3:
        (channel,) = (each for each in gc.get_objects() if isinstance(each, WorkerChannel))
        channel.mutex.reader_mutex.acquire()
        os.kill(os.getpid(), signal.SIGKILL)
    return fly_task(task, folder)


def test_workers_that_wait_for_a_lock_of_a_dead_one_are_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("harness.runs.workers._STALLED", 1.0)
    file = settings(tmp_path, count=200)
    progress = fly_matrix(file, tmp_path / "out", options=replace(WORKERS, fly=die_with_the_lock))
    assert (progress.done, progress.failed) == (200, 1)
    outcomes = harness.load_results(tmp_path / "out")["outcome"].tolist()
    assert outcomes == ["worker_died" if i == 3 else "completed" for i in range(200)]


def hang(task: Task, folder: Path) -> WorkerResult:
    """Flies, but for three flights, whose law does not come back: it computes, sleeps, or lets no signal through."""
    endless: dict[int, Callable[[], object]] = {
        2: lambda: deque(itertools.count(), maxlen=0),
        5: lambda: time.sleep(1000.0),
        7: lambda: ctypes.PyDLL(None).sleep(1000),
    }

    def start() -> LawStep:
        calls = itertools.count()

        def step(_: Observation) -> Guidance:
            if next(calls):
                endless[task.position]()
            return turning(0.05)

        return step

    hanging = replace(task.flight, law=OwnLaw(start)) if task.position in endless else task.flight
    return fly_task(task._replace(flight=hanging), folder)


def test_a_law_that_hangs_is_ended_and_costs_no_other_flight(tmp_path: Path) -> None:
    begin, file = time.monotonic(), settings(tmp_path, count=12)
    progress = fly_matrix(file, tmp_path / "out", options=replace(WORKERS, fly=hang, timeout=1.0))
    assert time.monotonic() - begin < 25.0
    assert progress.failed == 3
    results = harness.load_results(tmp_path / "out")
    assert results["outcome"].tolist() == ["timeout" if i in (2, 5, 7) else "completed" for i in range(12)]
    assert results["reason"][2].startswith("at 0 s the simulated time did not advance during 1")
    # The machine may have been to blame: the same command flies them again.
    progress = fly_matrix(file, tmp_path / "out")
    assert (progress.done, progress.earlier, progress.failed) == (3, 9, 0)


@pytest.mark.parametrize("how", ["starved", "stopped"])
def test_a_machine_without_time_for_the_workers_changes_no_result(how: str, tmp_path: Path) -> None:
    file = settings(tmp_path, count=6, duration=400.0, plant="sixdof")
    fly_matrix(file, tmp_path / "undisturbed")
    process = started(file, tmp_path / "out", "--flight-timeout", 0.5)  # a flight takes longer
    until(lambda: busy(process), process)
    others = []
    try:
        if how == "stopped":
            for worker in busy(process):
                worker.suspend()
            time.sleep(3.0)
            for worker in busy(process):
                worker.resume()
        else:
            for worker in busy(process):
                worker.nice(19)
            others = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(os.cpu_count() or 1)]
            time.sleep(3.0)
    finally:
        for other in others:
            other.kill()
            other.wait()
    _, errors = process.communicate(timeout=300)
    assert process.returncode == 0, errors
    assert digests(tmp_path / "out") == digests(tmp_path / "undisturbed")


def killed_before_a_file_is_whole(*words: object) -> None:
    """Runs the command and kills it when it has written a file's content, before that has its name."""
    code = (
        "import os, pathlib, sys\n"
        "from harness.cli.main import main\n"
        "pathlib.Path.replace = lambda *_: os.kill(os.getpid(), 9)\n"
        f"sys.argv = {['harness', *map(str, words)]!r}\n"
        "main()\n"
    )
    assert python(code).returncode == -signal.SIGKILL


def test_a_parent_killed_while_it_writes_the_table_or_the_report_leaves_none_that_is_half(tmp_path: Path) -> None:
    text = settings(tmp_path, count=4).read_text().replace("[matrix]", '[matrix]\nplant = ["kinematic", "lagged"]')
    file, out = write(tmp_path / "matrix.toml", text), tmp_path / "out"
    fly_matrix(file, tmp_path / "undisturbed")
    run = ["run", file, "--out", out, "--workers", 0, "--log", "none"]
    killed_before_a_file_is_whole(*run)
    assert not (out / "flights.parquet").exists()
    kept = digests(out)
    assert kept == digests(tmp_path / "undisturbed")
    done = invoke(*run)
    assert done.exit_code == 0
    assert "0 flown, 8 earlier, 0 failed" in done.stdout
    assert len(pd.read_parquet(out / "flights.parquet")) == 8
    assert digests(out) == kept
    killed_before_a_file_is_whole("report", out)
    assert not (out / "report.html").exists()
    assert invoke("report", out).exit_code == 0
    whole = (out / "report.html").read_text(encoding="utf-8")
    assert whole.rstrip().endswith("</html>")
    killed_before_a_file_is_whole("report", out)
    assert (out / "report.html").read_text(encoding="utf-8") == whole


def test_ctrl_c_ends_within_two_seconds_with_130_and_no_process_left(tmp_path: Path) -> None:
    file = settings(tmp_path, count=500, duration=1000.0)
    process = started(file, tmp_path / "out")
    until(lambda: runs_of(tmp_path / "out"), process)
    begin = time.monotonic()
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to every process
    _, errors = process.communicate(timeout=20)
    assert time.monotonic() - begin < 2.0
    assert process.returncode == 130, errors
    assert ended(process.pid, within=0.2), session(process.pid)
    assert "the same command resumes the run" in errors
    assert errors.splitlines()[-1] == "interrupted"
    assert "Traceback" not in errors
    assert len(harness.load_results(tmp_path / "out")) > 0


def test_a_run_that_is_terminated_keeps_its_flights_and_leaves_nothing_behind(tmp_path: Path) -> None:
    process = started(settings(tmp_path, count=500, duration=1000.0), tmp_path / "out")
    until(lambda: runs_of(tmp_path / "out"), process)
    process.terminate()
    _, errors = process.communicate(timeout=20)
    assert process.returncode == 128 + signal.SIGTERM
    assert "semaphore" not in errors
    assert "Traceback" not in errors
    assert ended(process.pid, within=2.0), session(process.pid)
    assert len(harness.load_results(tmp_path / "out")) > 0


SLOW = """
import time
from dataclasses import dataclass
from pathlib import Path

from autopilot.guidance import Guidance


@dataclass(frozen=True)
class Slow:
    standoff: float = 200.0
    max_heading_rate: float = 0.1
    command: str = "heading_rate"

    def start(self):
        def step(o):
            if o.time > 0.5:
                Path(__file__).with_name("flying").touch()
                time.sleep(60.0)
            return Guidance(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

        return step

    def broken_conditions(self, speed_ratio):
        return []
"""


def test_a_command_that_is_terminated_within_a_law_takes_that_for_no_fault_of_the_law(tmp_path: Path) -> None:
    write(tmp_path / "slow.py", SLOW)
    text = KINEMATIC.format(count=1, duration=2.0).replace('"nftsm"\ngains = "paper_1"', '"slow.py:Slow"')
    file = write(tmp_path / "matrix.toml", text)
    process = started(file, tmp_path / "out", "--workers", 0)
    until((tmp_path / "flying").exists, process)
    process.terminate()
    told, errors = process.communicate(timeout=20)
    assert process.returncode == 128 + signal.SIGTERM, told + errors
    assert not runs_of(tmp_path / "out")


@pytest.mark.parametrize("errors", ["2>&-", "2>/dev/full"])
def test_a_standard_error_that_nobody_can_write_to_loses_no_run(tmp_path: Path, errors: str) -> None:
    line = shlex.join(words_of(*words(settings(tmp_path, count=4), tmp_path / "out")))
    done = subprocess.run(["sh", "-c", f"{line} {errors}"], stdout=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 0
    assert "4 flown, 0 earlier, 0 failed" in done.stdout


def test_a_second_run_in_a_directory_in_use_is_refused(tmp_path: Path) -> None:
    file = settings(tmp_path, count=500, duration=1000.0)
    first = started(file, tmp_path / "out")
    try:
        until(lambda: runs_of(tmp_path / "out"), first)
        second = command(*words(file, tmp_path / "out"))
        assert second.returncode == 2
        assert "another run writes to it" in second.stderr.splitlines()[-1]
        assert str(first.pid) in second.stderr
    finally:
        first.send_signal(signal.SIGINT)
        first.communicate(timeout=20)


def test_a_flight_for_which_there_is_too_little_memory_is_a_row_and_is_flown_again(tmp_path: Path) -> None:
    """20 000 s at 200 Hz: a log of 1.7 GB, where a process may have 2 GB."""
    text = KINEMATIC.format(count=1, duration=10.0).replace("[flight]", "[flight]\nguidance_period_s = 0.005")
    file = write(tmp_path / "matrix.toml", f"{text}duration_s = [10.0, 20000.0]\n")
    line = shlex.join(words_of(*words(file, tmp_path / "out")))
    done = subprocess.run(["sh", "-c", f"ulimit -v 2000000; {line}"], capture_output=True, text=True, check=False)
    assert done.returncode == 1, done.stderr
    assert "failed: 1 x worker_died: the machine had too little memory for it" in done.stdout
    assert "the same command flies them again" in done.stdout
    outcomes = harness.load_results(tmp_path / "out").set_index("duration_s")["outcome"]
    assert outcomes.to_dict() == {10.0: "completed", 20000.0: "worker_died"}


def test_without_workers_a_limit_for_a_flight_that_hangs_is_refused(tmp_path: Path) -> None:
    file = settings(tmp_path, count=1)
    done = invoke("run", file, "--out", tmp_path / "out", "--workers", 0, "--flight-timeout", 5)
    assert done.exit_code == 2
    (line,) = done.stderr.splitlines()
    assert "--flight-timeout" in line
    assert "--workers" in line
    assert not (tmp_path / "out").exists()


def test_settings_changed_in_between_are_new_flights_and_the_old_stay(tmp_path: Path) -> None:
    file, out = settings(tmp_path, count=4), tmp_path / "out"
    fly_matrix(file, out)
    old = digests(out)
    file.write_text(file.read_text().replace("paper_1", "paper").replace("count = 4", "count = 6"))
    progress = fly_matrix(file, out)
    assert (progress.done, progress.earlier) == (6, 0)
    assert len(digests(out)) == 10
    assert old.items() <= digests(out).items()


def test_the_hundredth_flight_of_a_worker_is_its_first(tmp_path: Path) -> None:
    file = settings(tmp_path, count=101, duration=1.0, plant="sixdof")
    fly_matrix(file, tmp_path / "out", options=replace(WORKERS, workers=1))
    shutil.copy(file, tmp_path / "last.toml")
    last = tmp_path / "last.toml"
    last.write_text(file.read_text().replace("start = 0, count = 101", "start = 100, count = 1"))
    fly_matrix(last, tmp_path / "last", options=replace(WORKERS, workers=1))
    assert digests(tmp_path / "last").items() <= digests(tmp_path / "out").items()


def test_a_worker_has_one_numeric_thread(tmp_path: Path) -> None:
    fly_matrix(settings(tmp_path, count=1), tmp_path / "out", options=replace(WORKERS, fly=threads))
    (reason,) = harness.load_results(tmp_path / "out")["reason"]
    assert reason == "it could not be flown: RuntimeError: 1 1 1"


def threads(task: Task, folder: Path) -> WorkerResult:
    """Fails, and tells how many threads the numeric libraries would use."""
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    raise RuntimeError(" ".join(os.environ.get(name, "many") for name in names))
