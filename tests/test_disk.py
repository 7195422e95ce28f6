"""Full, read-only and damaged disks and files, really so, while many flights are flown."""

import errno
import os
import random
import sqlite3
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

import harness
from harness.review.reading import read_logs
from harness.runs.journal import JOURNAL, StoreError
from harness.runs.recordings import recording_path
from harness.runs.results import export
from harness.runs.store import Store
from tests.builders import command, digests, fly_matrix, invoke
from tests.processes import runs_of, settings, words


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.EOPNOTSUPP])
def test_a_file_system_without_locks_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    def without_locks(*_: object) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr("fcntl.lockf", without_locks)
    with pytest.raises(StoreError, match=r"its file system cannot lock a file \(.*\): use a folder on another one"):
        Store(tmp_path / "out")


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 2 MB."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=2m", "tmpfs", str(disk)], capture_output=True, text=True, check=False
    )
    if mounted.returncode:
        pytest.skip(f"no file system can be mounted here: {mounted.stderr.strip()}")
    yield disk
    subprocess.run(["umount", str(disk)], check=True)


def remount(disk: Path, options: str) -> None:
    subprocess.run(["mount", "-o", f"remount,{options}", str(disk)], check=True)


def test_a_full_disk_is_told_and_the_run_goes_on_when_there_is_room(tmp_path: Path, small_disk: Path) -> None:
    file = settings(tmp_path, count=900, duration=20.0)
    done = command(*words(file, small_disk / "out"))
    assert done.returncode == 2
    assert "disk is full" in done.stderr.splitlines()[-1]
    assert "Traceback" not in done.stderr
    kept = runs_of(small_disk / "out")
    assert 0 < len(kept) < 900
    table, rest = small_disk / "table.csv", small_disk / "rest"
    with pytest.raises(OSError, match="No space left"):
        rest.write_bytes(bytes(2_000_000))
    done = command("export", f"{small_disk / 'out'}:{next(iter(kept))}", "--to", "csv", "--out", table)
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1] == f"{table}: No space left on device"
    assert {path.name for path in small_disk.iterdir()} == {"out", "rest"}
    rest.unlink()
    remount(small_disk, "size=50m")
    again = command(*words(file, small_disk / "out"))
    assert again.returncode == 0, again.stderr
    assert kept.items() <= runs_of(small_disk / "out").items()
    assert len(digests(small_disk / "out")) == 900


def test_recordings_that_a_full_disk_prevented_are_counted_and_made_up(tmp_path: Path, small_disk: Path) -> None:
    out = small_disk / "out"
    run = ["run", settings(tmp_path, count=8, duration=20.0), "--out", out, "--workers", 0]
    done = command(*run)
    assert done.returncode == 1
    missing = 8 - len(list((out / "flights").glob("*.rrd")))
    assert 0 < missing < 8
    assert f"\n{missing} recordings missing; the same command makes them up\n" in done.stdout
    assert done.stdout.splitlines()[-2].startswith("8 flown, 0 earlier, 0 failed")
    assert "cannot be written: No space left on device" in done.stderr
    remount(small_disk, "size=50m")
    before = digests(out)
    again = command(*run)
    assert again.returncode == 0, again.stderr
    assert f"\n{missing} earlier flights flown again for a recording that was missing\n" in again.stdout
    assert again.stdout.splitlines()[-2].startswith("0 flown, 8 earlier, 0 failed")
    assert digests(out) == before
    for key, digest in before.items():
        (log,) = read_logs(recording_path(out, key)).values()
        assert log.digest == digest


def test_a_directory_that_can_only_be_read_is_told_and_still_read(tmp_path: Path, small_disk: Path) -> None:
    file = settings(tmp_path, count=5)
    fly_matrix(file, small_disk / "out")
    remount(small_disk, "ro")
    for out in (small_disk / "out", small_disk / "new"):
        done = command(*words(file, out))
        assert done.returncode == 2
        assert "cannot be written" in done.stderr.splitlines()[-1]
        assert "Traceback" not in done.stderr
    assert len(harness.load_results(small_disk / "out")) == 5


def damage(path: Path, how: str) -> None:
    content = bytearray(path.read_bytes())
    if how == "no database":
        content[:] = b"no database " * 1000
    elif how == "cut":
        del content[len(content) // 2 :]
    elif how == "overwritten":
        middle = len(content) // 2
        content[middle : middle + 6000] = random.Random(1).randbytes(6000)
    path.write_bytes(content)


@pytest.mark.parametrize("how", ["no database", "cut", "overwritten", "of another program"])
def test_a_damaged_journal_is_told_and_left_as_it_is(tmp_path: Path, how: str) -> None:
    file, out = settings(tmp_path, count=30), tmp_path / "out"
    fly_matrix(file, out)
    if how == "of another program":
        (out / JOURNAL).unlink()
        with sqlite3.connect(out / JOURNAL) as other:
            other.execute("CREATE TABLE mine (x)")
        other.close()
    else:
        damage(out / JOURNAL, how)
    before = (out / JOURNAL).read_bytes()
    file.write_text(file.read_text().replace("count = 30", "count = 31"))
    done = command(*words(file, out))
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].startswith(f"{out / JOURNAL}: is ")
    assert "nothing was changed" in done.stderr
    assert "Traceback" not in done.stderr
    assert (out / JOURNAL).read_bytes() == before


@pytest.mark.parametrize("how", ["cut", "overwritten"])
def test_a_damaged_journal_is_told_by_what_only_reads(tmp_path: Path, how: str) -> None:
    out = tmp_path / "out"
    fly_matrix(settings(tmp_path, count=30), out)
    export(out)  # so that the flights themselves are read elsewhere
    damage(out / JOURNAL, how)
    for call in (["show"], ["compare", "--by", "seed"], ["report"], ["export", "--to", "csv", "--out", tmp_path / "a"]):
        done = invoke(call[0], out, *call[1:])
        assert done.exit_code == 2
        (line,) = done.stderr.splitlines()
        assert line.startswith(f"{out / JOURNAL}: is damaged")
