"""The code in a worker of a Dask cluster: it flies chunks of flights in a separate process.

That process is the local pool with one worker, so a flight that hangs or ends its process gives the same row as on one
machine, and the Dask worker lives on.
"""

import hashlib
import multiprocessing
import pickle
import zlib
from collections import deque
from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import aircraft
import autopilot
from harness.compiled.kernel import is_installed
from harness.files import read
from harness.provenance import decides_bits, differences
from harness.runs.parcels import Packed, Parcel, keep, unpacked
from harness.runs.recordings import recording_path
from harness.runs.wall_time import WallTime
from harness.runs.workers import Done, Task, WorkerResult, WorkersError, fly_all, fly_task
from harness.settings.law_source import LawError

SOURCE = "harness source"
_PROCESSOR = "processor"


class FarFlight(NamedTuple):
    """A flight to be flown far away: a `Task` whose flight is packed."""

    key: str
    position: int
    flight: Packed
    version: str
    record: str
    compiled: bool


class Brief(NamedTuple):
    """The data common to all chunks of a run."""

    versions: Mapping[str, str]  # of the client: see `versions`
    folder: Path  # of the run, on the client's machine
    timeout: float


class Answer(NamedTuple):
    """A worker's answer to a chunk: results in its order, or what it lacks, or why it cannot fly it at all."""

    results: Sequence[tuple[WorkerResult, bytes]] = ()  # each with its recording, empty without one
    lacks: frozenset[str] = frozenset()  # numbers of parcels
    refusal: str = ""


class Report(NamedTuple):
    """The versions and threads of a process of the cluster."""

    versions: Mapping[str, str]
    threads: int  # in which it would fly at the same time
    process: tuple[str, int]  # its machine and number


@cache
def versions() -> dict[str, str]:
    """The versions that decide a flight beside its settings and files, as imported by this process."""
    digest = hashlib.blake2b(digest_size=4)
    packages = (Path(aircraft.__file__), Path(autopilot.__file__), Path(__file__).parent)
    for folder in (path.parent for path in packages):
        for path in sorted(folder.rglob("*.py")):
            digest.update(f"{path.relative_to(folder.parent).as_posix()}\n".encode() + read(path) + b"\0")
    return {SOURCE: digest.hexdigest(), **decides_bits()}


def unlike(here: Mapping[str, str], there: Mapping[str, str]) -> list[str]:
    """The differences that forbid flying there, in words; another processor only changes last bits and is allowed."""
    known = {name: text for name, text in there.items() if name != _PROCESSOR}
    return list(differences(known, here))


def report(dask_worker: Any = None) -> Report:
    """Asked of each worker and of the scheduler before anything is flown."""
    import os
    import socket

    state = getattr(dask_worker, "state", None)  # a scheduler has none, and flies nothing
    threads = state.nthreads if state else 1
    return Report(versions(), threads, (socket.gethostname(), os.getpid()))


def fly_chunk(message: bytes, parcels: Mapping[str, Parcel], brief: Brief) -> Answer:
    """Flies the orders of a message; the parcels are those that a worker lacked before."""
    from distributed import get_worker

    worker = get_worker()
    if different := unlike(brief.versions, versions()):
        return Answer(refusal="; ".join(different))
    folder = Path(worker.local_directory) / "standoff-harness"
    folder.mkdir(exist_ok=True)
    keep(parcels, folder)
    orders: list[FarFlight] = pickle.loads(zlib.decompress(message))
    needed = frozenset(number for order in orders for number in order.flight.parcels)
    if lacks := frozenset(number for number in needed if not (folder / number).exists()):
        return Answer(lacks=lacks)
    try:
        tasks = [
            Task(o.key, o.position, unpacked(o.flight, folder), o.version, o.record, o.compiled and is_installed())
            for o in orders
        ]
    except LawError as error:
        return Answer(refusal=f"a law cannot be loaded there: {error}")
    try:
        results = _pool(brief, folder).flown(tasks)
    except WorkersError as error:
        _POOLS.clear()
        return Answer(refusal=str(error))
    except BaseException:
        _POOLS.clear()
        raise
    return Answer([(results[task.key], _recording(folder, task.key)) for task in tasks])


@dataclass(slots=True)
class _Pool:
    """The one process that flies, kept between chunks."""

    flying: Generator[Done | None] = field(init=False)
    waiting: deque[Task] = field(default_factory=deque)

    def flown(self, tasks: Sequence[Task]) -> dict[str, WorkerResult]:
        """The results by key."""
        self.waiting.extend(tasks)
        results: dict[str, WorkerResult] = {}
        while len(results) < len(tasks):
            if done := next(self.flying):
                results[done.task.key] = done.result
        return results

    def tasks(self) -> Iterator[Task | None]:
        while True:
            yield self.waiting.popleft() if self.waiting else None


_POOLS: dict[tuple[Path, float], _Pool] = {}  # at most one


def _pool(brief: Brief, folder: Path) -> _Pool:
    key = brief.folder, brief.timeout
    if key not in _POOLS:
        for old in _POOLS.values():
            old.flying.close()
        _POOLS.clear()
        # Dask's supervisor of a worker makes it a daemon, which may have no child; the child ends with the worker.
        multiprocessing.current_process().daemon = False
        pool = _Pool()
        fly = partial(fly_task, home=brief.folder)
        pool.flying = fly_all(pool.tasks(), folder, workers=1, wall_time=WallTime(), timeout=brief.timeout, fly=fly)
        _POOLS[key] = pool
    return _POOLS[key]


def _recording(folder: Path, key: str) -> bytes:
    """The recording of a flight, which is then no longer here; empty where there is none."""
    path = recording_path(folder, key)
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return b""
    path.unlink()
    return content
