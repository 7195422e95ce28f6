"""Provenance: the command, code, packages and machine that made results."""

import hashlib
import json
import math
import platform
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

_HERE = Path(__file__).parent.parent
DISTRIBUTION = "standoff-harness"
_FLYING = ("jsbsim", "numpy", "scipy", "filterpy")  # the libraries that fly


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
    processor: str | None  # see `processor`; None in journals that did not keep it


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
        processor(),
    )


def now() -> str:
    """The time now: UTC, ISO 8601, to the second."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def requirements() -> list[str]:
    """The packages that the harness requires, as `numpy>=2.2`."""
    return [requirement for requirement in requires(DISTRIBUTION) or () if "extra ==" not in requirement]


def packages() -> dict[str, str]:
    """The versions of the harness and of the libraries that it requires, by name."""
    names = [DISTRIBUTION, *(re.split(r"[^\w.-]", requirement)[0] for requirement in requirements())]
    versions = {}
    for name in names:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "not installed"
    return versions


@cache
def processor() -> str:
    """The kind of processor, and a hash of what it makes of some arithmetic.

    Mathematical functions and matrix products choose their instructions by the processor, and differ in last bits.
    """
    x = [0.0137 * k for k in range(1, 1001)]  # of a hundred numbers too few differ
    functions = (math.sin, math.cos, math.atan, math.exp, math.log)
    made = [f(v) for f in functions for v in x] + [math.atan2(v, 1.7 - v) for v in x] + [v**0.667 for v in x]
    A = np.sin(np.array(x[:144])).reshape(12, 12)
    product = A @ A.T + 12.0 * np.eye(12)
    matrices = np.stack([product, np.linalg.solve(product, A), np.linalg.cholesky(product)])
    digest = hashlib.blake2b(np.array(made).tobytes() + matrices.tobytes(), digest_size=4).hexdigest()
    return f"{platform.machine()} (arithmetic {digest})"


def decides_bits() -> dict[str, str]:
    """The environment that decides the last bits of a flight beside code and settings: equal ones give equal bits."""
    return _decides_bits(processor(), platform.python_version(), packages())


def decided_bits(run: Mapping[str, Any]) -> dict[str, str]:
    """That environment of an earlier run, as far as it is stored, from its `Provenance` as a row of the journal."""
    return _decides_bits(run["processor"], run["python"], json.loads(run["packages"]))


def _decides_bits(processor: str | None, python: str, packages: Mapping[str, str]) -> dict[str, str]:
    known = {name: packages[name] for name in _FLYING if name in packages}
    return {**({"processor": processor} if processor else {}), "Python": python.rpartition(".")[0], **known}


def differences(then: Mapping[str, str], now: Mapping[str, str]) -> Iterator[str]:
    """The changes of that environment, in words; what is unknown of either counts as equal."""
    for name in then:
        if name in now and now[name] != then[name]:
            yield f"{name} {then[name]} there, {now[name]} here"


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
