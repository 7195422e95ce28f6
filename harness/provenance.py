"""Provenance: the command, code, packages and machine that made results."""

import json
import platform
import re
import shlex
import subprocess
import sys
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import NamedTuple

_HERE = Path(__file__).parent.parent
DISTRIBUTION = "standoff-harness"


class Provenance(NamedTuple):
    """The provenance of one `harness run`."""

    started: str  # UTC, ISO 8601
    command: str
    folder: str  # the working folder
    file: str
    settings: str  # the file's text
    title: str
    question: str
    git_commit: str | None  # None if the code is not in a Git checkout
    git_dirty: bool | None  # whether files differ from the commit
    packages: str  # JSON: versions by name
    platform: str
    python: str


def provenance(file: Path, text: str, title: str, question: str) -> Provenance:
    """The provenance of the run of `file`, whose text this is, that begins now."""
    commit, changes = _git("rev-parse", "HEAD"), _git("status", "--porcelain")
    return Provenance(
        now(),
        shlex.join(["harness", *sys.argv[1:]]),
        str(Path.cwd()),
        str(file),
        text,
        title,
        question,
        commit,
        None if commit is None else bool(changes),
        json.dumps(packages()),
        platform.platform(),
        platform.python_version(),
    )


def now() -> str:
    """The time now: UTC, ISO 8601, to the second."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def packages() -> dict[str, str]:
    """The versions of the harness and of the libraries that it requires, by name."""
    asked = [requirement for requirement in requires(DISTRIBUTION) or () if "extra ==" not in requirement]
    names = [DISTRIBUTION, *(re.split(r"[^\w.-]", requirement)[0] for requirement in asked)]
    versions = {}
    for name in names:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "not installed"
    return versions


def _git(*words: str) -> str | None:
    """The output of a Git command in the harness's own checkout; None if there is no checkout, or it fails."""
    if not (_HERE / ".git").exists():
        return None
    try:
        done = subprocess.run(
            ["git", "-C", str(_HERE), *words], capture_output=True, errors="replace", check=True, timeout=10
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()
