"""Flies the flights of a run on a Dask cluster: this process sends chunks out and is the only one that keeps results.

A few chunks per worker are out at a time, so neither this process nor the scheduler holds the whole matrix. A worker
that is killed loses nothing: Dask sends its chunks to another one. A chunk that Dask gives up, because too many workers
ended with it, is taken apart, and each of its flights is flown alone: so the one that is to blame is known.
"""

import logging
import pickle
import re
import time
import zlib
from collections import deque
from collections.abc import Generator, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from harness.error import HarnessError
from harness.files import make_folder, replacing
from harness.plants.plant import Outcome
from harness.runs.far import SOURCE, Answer, Brief, FarFlight, Report, fly_chunk, report, unlike, versions
from harness.runs.parcels import Parcel, Parcels
from harness.runs.recordings import recording_path
from harness.runs.row import failed_result
from harness.runs.wall_time import WallTime
from harness.runs.workers import Done, Task, WorkerResult, WorkersError

CHUNK = 2.0  # s: duration of the flights in one message
_SHORTEST_CHUNK = 0.3  # s: least duration of the flights in one message
_CHUNKS_EACH = 4  # least number of chunks per worker, if there are enough flights
_MOST_TASKS = 1000  # largest number of flights in a chunk
_AHEAD = 2  # chunks that are out per worker: one is flown, one waits
_CONNECTING = 10.0  # s: time limit of the connection to the scheduler
_WITHOUT_WORKERS = 30.0  # s: time limit without any worker
_LOOK_EVERY = 1.0  # s between two checks for workers that came or went
_POLL = 0.02  # s between two checks for results
_ADDRESS = re.compile(r"((tcp|tls|ws|wss)://)?(\[[0-9a-fA-F:]+\]|[\w.-]+):[0-9]{1,5}")
_MOST_TOLD = 3  # largest number of workers named in a message


class ClusterError(HarnessError):
    """The cluster cannot be used; the message says why in one line, and what to do."""


@contextmanager
def connected(where: str) -> Iterator["Cluster"]:
    """The cluster of a scheduler, by its address or its file, after a look at every worker. Raises `ClusterError`."""
    try:
        distributed: Any = import_module("distributed")
    except ImportError:
        raise ClusterError(
            "a Dask cluster needs the package distributed, here and on every worker: "
            "pip install 'standoff-harness[dask]'"
        ) from None
    for name in ("distributed", "distributed.client"):  # each has a level of its own
        logging.getLogger(name).setLevel(logging.CRITICAL)  # failures are reported in one line
    if where.endswith(".json"):
        if not Path(where).is_file():
            raise ClusterError(f"{where}: there is no such file, as `dask scheduler --scheduler-file` writes")
        how: dict[str, str] = {"scheduler_file": where}
        address = Path(where).read_text(errors="replace")
    elif _ADDRESS.fullmatch(where):
        how = {"address": where}
        address = where
    else:
        raise ClusterError(
            f"the Dask scheduler is {where!r}, must be HOST:PORT, tcp://HOST:PORT, tls://HOST:PORT or FILE.json"
        )
    if "tls://" in address and distributed.Security().get_connection_args("client")["ssl_context"] is None:
        # a client that finds this out itself waits 20 s at the end, and shows a traceback
        raise ClusterError(
            f"{where}: TLS needs certificates: set DASK_DISTRIBUTED__COMM__TLS__CA_FILE, ..__CLIENT__CERT and "
            "..__CLIENT__KEY to their files"
        )
    try:
        client = distributed.Client(**how, timeout=_CONNECTING, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        why = str(error) or type(error).__name__
        raise ClusterError(f"{where}: there is no Dask scheduler that answers: {' '.join(why.split())}") from None
    try:
        cluster = Cluster(client, where)
        cluster.examine()
        yield cluster
    finally:
        client.close(timeout=2)


class _Chunk(NamedTuple):
    tasks: Sequence[Task]
    parcels: frozenset[str] = frozenset()  # that go with it
    is_alone: bool = False  # one flight, and nothing else was out with it


@dataclass(slots=True)
class Cluster:
    """A cluster whose workers are fit to fly."""

    client: Any  # distributed.Client, a package that is not always installed
    where: str
    workers: int = 0

    def examine(self) -> None:
        """Asks every worker and the scheduler for what decides a flight there. Raises `ClusterError`."""
        deadline = time.monotonic() + _WITHOUT_WORKERS
        while not (reports := self.client.run(report, on_error="return")):
            if time.monotonic() > deadline:
                start = f"dask worker {self.where} --nthreads 1"
                raise ClusterError(f"{self.where}: the scheduler has no worker: start some with `{start}`")
            time.sleep(_POLL)
        try:
            scheduler: Report | Exception = self.client.run_on_scheduler(report)
        except Exception as error:
            scheduler = error
        wrong = _unfit({"the scheduler": scheduler, **reports})
        if wrong:
            more = f"; and {len(wrong) - _MOST_TOLD} more like these" if len(wrong) > _MOST_TOLD else ""
            raise ClusterError("; ".join(wrong[:_MOST_TOLD]) + more)
        self.workers = len(reports)

    def fly_all(
        self, tasks: Iterator[Task | None], folder: Path, *, wall_time: WallTime, timeout: float, seconds: float
    ) -> Generator[Done | None]:
        """Like `harness.runs.workers.fly_all`, with the workers of the cluster.

        `seconds` is the wall time that all flights typically take; zero where that is not known.
        """
        yield from _Flying(self, tasks, folder, wall_time, timeout, seconds).results()


class _Flying:
    """The state of `Cluster.fly_all`."""

    def __init__(
        self,
        cluster: Cluster,
        tasks: Iterator[Task | None],
        folder: Path,
        wall_time: WallTime,
        timeout: float,
        seconds: float,
    ) -> None:
        self.cluster, self.client, self.tasks, self.folder, self.wall_time = (
            cluster, cluster.client, tasks, folder, wall_time
        )  # fmt: skip
        self.brief = Brief(versions(), folder.absolute(), timeout)
        share = seconds / (_CHUNKS_EACH * cluster.workers)
        self.chunk = min(CHUNK, max(_SHORTEST_CHUNK, share)) if seconds else CHUNK
        self.parcels = Parcels()
        self.again: deque[_Chunk] = deque()  # to be flown again
        self.suspects: deque[_Chunk] = deque()  # to be flown alone, at the end: workers ended that had them or others
        self.out: dict[Any, _Chunk] = {}  # by future
        # distributed is not always installed, and not typed
        self.completed: Any = import_module("distributed").as_completed(
            loop=self.client.loop, with_results=True, raise_errors=False
        )
        self.looked = self.staffed = time.monotonic()

    def results(self) -> Iterator[Done | None]:
        try:
            while self._send() or self.out:
                batch = self.completed.next_batch(block=False)
                if not batch:
                    self._look()
                    time.sleep(_POLL)
                    yield None
                for future, answer in batch:
                    yield from self._received(self.out.pop(future), answer)
                    future.release()
        finally:
            if self.out and self.client.status == "running":
                self.client.cancel(list(self.out), force=True)

    def _send(self) -> bool:
        """Sends chunks until every worker has enough; returns whether there is one that was or will be sent."""
        sent = False
        while len(self.out) < _AHEAD * max(1, self.cluster.workers):
            chunk = self.again.popleft() if self.again else self._next_chunk()
            if chunk is None and self.suspects and not self.out:
                chunk = self.suspects.popleft()
            if chunk is None:
                break
            if self.client.status != "running":  # it waits for the scheduler, and the run is not over
                self.again.appendleft(chunk)
                return True
            self._submit(chunk)
            sent = True
            if chunk.is_alone:
                break
        return sent

    def _submit(self, chunk: _Chunk) -> None:
        orders = [
            FarFlight(t.key, t.position, self.parcels.packed(t.flight), t.version, t.record, t.compiled)
            for t in chunk.tasks
        ]
        message = zlib.compress(pickle.dumps(orders), 1)
        parcels: dict[str, Parcel] = {number: self.parcels.content[number] for number in chunk.parcels}
        future = self.client.submit(fly_chunk, message, parcels, self.brief, pure=False)
        self.out[future] = chunk
        self.completed.add(future)

    def _next_chunk(self) -> _Chunk | None:
        tasks: list[Task] = []
        seconds = 0.0
        while seconds < self.chunk and len(tasks) < _MOST_TASKS and (task := next(self.tasks, None)) is not None:
            tasks.append(task)
            seconds += self.wall_time.seconds(task.flight)
        return _Chunk(tasks) if tasks else None

    def _received(self, chunk: _Chunk, answer: Any) -> Iterator[Done]:
        if isinstance(answer, CancelledError):  # the scheduler was restarted
            self.again.append(chunk)
            return
        if not isinstance(answer, Answer):  # kind, error and its traceback
            yield from self._failed(chunk, answer[1])
            return
        if answer.refusal:
            raise WorkersError(f"a worker of {self.cluster.where} cannot fly: {answer.refusal}")
        if answer.lacks:
            self.again.append(chunk._replace(parcels=chunk.parcels | answer.lacks))
            return
        for task, (result, recording) in zip(chunk.tasks, answer.results, strict=True):
            if result.result.seconds is not None:
                self.wall_time.learn(task.flight, result.result.seconds)
            yield Done(task, self._with_recording(task, result, recording))

    def _failed(self, chunk: _Chunk, error: Exception) -> Iterator[Done]:
        """Dask has given up the chunk: each of its flights is flown alone, to find the one that crashes the worker."""
        if type(error).__name__ != "KilledWorker":
            raise WorkersError(f"a worker of {self.cluster.where} failed: {type(error).__name__}: {error}")
        if not chunk.is_alone:  # Dask blames all that a worker had when it ended
            self.suspects.extend(_Chunk([task], chunk.parcels, is_alone=True) for task in chunk.tasks)
            return
        (task,) = chunk.tasks
        last = getattr(getattr(error, "last_worker", None), "address", "unknown")
        reason = f"the workers of the cluster that had it ended, one after the other; the last one was {last}"
        yield Done(task, WorkerResult(failed_result(Outcome.WORKER_DIED, reason), task.version))

    def _with_recording(self, task: Task, result: WorkerResult, recording: bytes) -> WorkerResult:
        if not recording:
            return result
        path = recording_path(self.folder, task.key)
        try:
            make_folder(path.parent)
            with replacing(path) as partial:
                partial.write_bytes(recording)
        except OSError as error:
            return result._replace(recording=f"{path}: cannot be written: {error.strerror or error}")
        return result

    def _look(self) -> None:
        """Counts the workers. Raises `WorkersError` when the scheduler or all workers are gone for long."""
        now = time.monotonic()
        if now - self.looked < _LOOK_EVERY:
            return
        self.looked = now
        resumes = "what was flown is kept, and the same command resumes the run"
        if self.client.status == "closed":
            raise WorkersError(f"{self.cluster.where}: the scheduler is gone; {resumes}")
        if self.client.status != "running":
            return  # it is being looked for
        try:
            self.cluster.workers = len(self.client.nthreads())
        except OSError:
            return
        if self.cluster.workers:
            self.staffed = now
        elif now - self.staffed > _WITHOUT_WORKERS:
            raise WorkersError(f"{self.cluster.where}: all workers are gone; {resumes}")


def _unfit(reports: Mapping[str, Report | BaseException]) -> list[str]:
    """The difference and the remedy, in words, for each process that cannot fly."""
    here = versions()
    wrong: list[str] = []
    met: dict[tuple[str, int], str] = {}
    for name, told in reports.items():
        if isinstance(told, ModuleNotFoundError) or (isinstance(told, BaseException) and "No module" in str(told)):
            wrong.append(f"{name}: {told}: install this standoff-harness there, with [dask]")
        elif isinstance(told, BaseException):
            wrong.append(f"{name}: could not be examined: {type(told).__name__}: {told}")
        elif different := unlike(here, told.versions):
            wrong.append(f"{name}: {', '.join(different)}: {_remedy(here, told.versions)}")
        elif told.threads != 1:
            wrong.append(f"{name}: has {told.threads} threads, must have 1: start it with --nthreads 1")
        elif name.startswith(("tcp:", "tls:", "inproc:")) and told.process in met:
            wrong.append(f"{name}: is in one process with {met[told.process]}, must have its own")
        met[told.process if isinstance(told, Report) else ("", 0)] = name
    return wrong


def _remedy(here: Mapping[str, str], there: Mapping[str, str]) -> str:
    """The versions to install there."""
    unequal = [name for name in here if here[name] != there.get(name) and name != "processor"]
    packages = [f"{name}=={here[name]}" for name in unequal if name not in (SOURCE, "Python")]
    parts = [f"Python {here['Python']}"] if "Python" in unequal else []
    if SOURCE in unequal:
        parts.append("the harness from this source")
    if packages:
        parts.append(f"pip install {' '.join(packages)}")
    return f"install there {', '.join(parts)}"
