"""Where results come from: code, packages, machine, command."""

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
    """What one `harness run` was."""

    started: str  # UTC, ISO 8601
    command: str
    folder: str  # the working folder
    file: str
    settings: str  # the file's text
    title: str
    question: str
    git_commit: str | None  # None: the code is in no Git checkout
    git_dirty: bool | None  # files changed since the commit
    packages: str  # JSON: versions by name
    platform: str
    python: str


def provenance(file: Path, title: str, question: str) -> Provenance:
    """Of the run that begins now."""
    commit, changes = _git("rev-parse", "HEAD"), _git("status", "--porcelain")
    return Provenance(
        now(),
        shlex.join(["harness", *sys.argv[1:]]),
        str(Path.cwd()),
        str(file),
        file.read_text(encoding="utf-8-sig"),
        title,
        question,
        commit,
        None if commit is None else bool(changes),
        json.dumps(packages()),
        platform.platform(),
        platform.python_version(),
    )


def now() -> str:
    """UTC, to the second."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def packages() -> dict[str, str]:
    """The versions of the harness and of the libraries that it asks for."""
    asked = [requirement for requirement in requires(DISTRIBUTION) or () if "extra ==" not in requirement]
    names = [DISTRIBUTION, *(re.split(r"[^\w.-]", requirement)[0] for requirement in asked)]
    found = {}
    for name in names:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def _git(*words: str) -> str | None:
    """What Git says of the harness's own checkout; None when it is in none."""
    if not (_HERE / ".git").exists():
        return None
    try:
        done = subprocess.run(["git", "-C", str(_HERE), *words], capture_output=True, text=True, check=True, timeout=10)
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()
