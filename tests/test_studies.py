"""The studies as commands: what each says of itself, and how it answers a mistake."""

import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

from harness.pool import computed
from tests.builders import ROOT

STUDIES = sorted(
    path.stem
    for path in (ROOT / "harness" / "studies").glob("*.py")
    if "@click.command" in path.read_text(encoding="utf-8")  # the others are what they share
)


def study_command(study: str, *words: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", f"harness.studies.{study}", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)


def test_each_study_is_a_command_that_says_what_it_does() -> None:
    known = {
        "chatter",
        "does_it_hold",
        "estimator",
        "fitted",
        "floor",
        "limit_cycle",
        "statistics",
        "turbulence",
        "which_law",
    }
    assert known <= set(STUDIES)
    for study in STUDIES:
        done = study_command(study, "--help")
        assert (done.returncode, done.stderr) == (0, "")
        assert "OUT/" in done.stdout
        assert "--out" in done.stdout


@pytest.mark.parametrize("study", STUDIES)
def test_a_mistyped_study_is_one_line_and_exit_code_2(study: str) -> None:
    done = study_command(study, "--outt", "here")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"python -m harness.studies.{study}: ")
    assert done.stderr.count("\n") == 1


def test_runs_that_are_not_there_are_one_line_and_exit_code_2(tmp_path: Path) -> None:
    done = study_command("turbulence", tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == f"{tmp_path}: holds no results of `harness run` (there is no journal.sqlite)\n"


def _square(x: int) -> int:
    return x * x


def _broken(x: int) -> int:
    raise ValueError(f"{x} is broken")


@pytest.mark.parametrize("workers", [1, 2])
def test_jobs_give_the_same_for_any_number_of_workers(workers: int) -> None:
    assert sorted(computed([partial(_square, x) for x in range(9)], workers)) == [x * x for x in range(9)]


@pytest.mark.parametrize("workers", [1, 2])
def test_what_a_job_raises_is_raised_here(workers: int) -> None:
    with pytest.raises(ValueError, match="2 is broken"):
        list(computed([partial(_broken, 2)], workers))
