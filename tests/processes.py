"""Runs in processes of their own, and what is alive and kept of them."""

import subprocess
import time
from collections.abc import Callable
from pathlib import Path

from harness.runs.journal import StoreError, reading
from tests.builders import words_of, write

KINEMATIC = """\
[flight]
plant = "kinematic"
duration_s = {duration}
[flight.law]
name = "nftsm"
gains = "paper_1"
[matrix]
"start.heading_deg" = {{ uniform = [0.0, 360.0] }}
seed = {{ start = 0, count = {count} }}
"""


def settings(folder: Path, count: int, duration: float = 2.0, plant: str = "kinematic") -> Path:
    text = KINEMATIC.format(count=count, duration=duration).replace('"kinematic"', f'"{plant}"')
    return write(folder / "matrix.toml", text)


def words(file: Path, out: Path, *more: object) -> list[object]:
    return ["run", file, "--out", out, "--workers", 2, "--log", "none", *more]


def started(file: Path, out: Path, *more: object) -> subprocess.Popen[str]:
    """The command in a session of its own: all processes that it starts can be found by it."""
    return subprocess.Popen(
        words_of(*words(file, out, *more)),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def session(leader: int) -> dict[int, str]:
    """The command lines of the session's processes that are alive."""
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            state, _, _, of = (folder / "stat").read_text().rpartition(")")[2].split()[:4]
            if int(of) == leader and state != "Z":
                found[int(folder.name)] = (folder / "cmdline").read_text()
        except OSError:
            continue  # ended meanwhile
    return found


def ended(leader: int, within: float) -> bool:
    """Whether no process of the session is left after so many seconds."""
    until = time.monotonic() + within
    while session(leader) and time.monotonic() < until:
        time.sleep(0.02)
    return not session(leader)


def runs_of(out: Path) -> dict[str, int]:
    """Which run flew each flight that is kept."""
    try:
        with reading(out) as journal:
            return dict(journal.execute("SELECT key, run FROM flights"))
    except StoreError:
        return {}  # killed before there was a journal


def until(condition: Callable[[], object], process: subprocess.Popen[str], within: float = 60.0) -> None:
    """Waits until `condition()` holds."""
    end = time.monotonic() + within
    while not condition():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < end
        time.sleep(0.02)
