"""Worker processes that fly flights; a worker that dies or hangs costs one flight.

Flights are sent in chunks, because a kinematic flight takes little longer than a message. Each worker notes in shared
memory which flight of its chunk it flies, and the simulated time. So a death or a hang loses that flight alone: the
rest of the chunk is flown again. A flight hangs when it gains no simulated time although its worker had time for it,
however slow the machine is.
"""

import os
import pickle
import time
import zlib
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from pebble import ProcessExpired, ProcessPool

from harness.child import how_ended
from harness.error import HarnessError
from harness.flight import Flight
from harness.key import version_of
from harness.plants.plant import Outcome
from harness.pool import ended, living, started
from harness.runs.own_time import OwnTime
from harness.runs.recordings import record, wanted
from harness.runs.row import FlightResult, failed_result, result_of, simulate_safely
from harness.runs.wall_time import CHUNK, WallTime
from harness.settings.law_source import LawError
from harness.spawn import SPAWN

AHEAD = 2  # chunks sent out per worker: one is flown, one waits
TIMEOUT = 60.0  # s of process time without progress of the simulated time, after which a flight has hung
_ASIDE = 60.0  # s: additional time before a flight's first row and after its last: start, metrics, recording
_STALLED = 30.0  # s that all workers are blocked with no flight begun, after which they are replaced
_LOOK_EVERY = 0.2  # s between two checks of the workers
_MOST_RESTARTS = 3  # largest number of restarts of the workers without a finished flight
_MOST_TASKS = 64  # largest number of flights in a chunk
_PIPE = 48_000  # bytes of waiting messages: a full pipe blocks this process, for ever if all workers are dead
OUT_OF_MEMORY = "the machine had too little memory for it"
_NONE = -1  # no flight of the chunk has begun
_NOT_IN_FLIGHT = -1.0  # for the simulated time, before a flight's first row and after its last
_NOTES = 3  # numbers that a worker notes: which flight of its chunk, the simulated time in s, its process


class WorkersError(HarnessError):
    """The workers cannot fly; the message says why in one line."""


class Task(NamedTuple):
    """A flight to be flown."""

    key: str
    position: int
    flight: Flight
    version: str  # the number of its `Version` when the task was made
    record: str  # when to write a recording: all | failed | none
    compiled: bool = False  # flown by a compiled loop where that can be


class WorkerResult(NamedTuple):
    """A worker's answer to a task."""

    result: FlightResult
    version: str  # the number of its `Version` after the flight
    recording: str = ""  # what went wrong in writing the recording; empty if nothing did


class Done(NamedTuple):
    """A task and its result."""

    task: Task
    result: WorkerResult


Fly = Callable[[Task, Path], WorkerResult]


def fly_task(task: Task, folder: Path, home: Path | None = None) -> WorkerResult:
    """Flies a task, in a worker, and writes its recording if the task requires one.

    `home` is the folder of the run, where that is another than the one to write to.
    """
    begin, problem = time.perf_counter(), ""
    try:
        log = simulate_safely(task.flight, _note, compiled=task.compiled, in_worker=bool(_SHARED))
        _note(_NOT_IN_FLIGHT)
        result = result_of(log, time.perf_counter() - begin)
    except MemoryError:
        return WorkerResult(failed_result(Outcome.WORKER_DIED, OUT_OF_MEMORY), version_of(task.flight).number)
    if wanted(task.record, log.outcome):
        problem = record(log, task.key, folder, home or folder)
    return WorkerResult(result, version_of(task.flight).number, problem)


def _failed(task: Task, outcome: Outcome, reason: str) -> Done:
    return Done(task, WorkerResult(failed_result(outcome, reason), task.version))


@dataclass(slots=True)
class _Chunk:
    tasks: Sequence[Task]
    slot: int = 0  # its place in the shared memory
    size: int = 0  # bytes, of its message
    worker: OwnTime | None = None
    at: tuple[float, float] = (_NONE, _NOT_IN_FLIGHT)  # the flight and its simulated time when last looked at
    stuck: float = 0.0  # process time of the worker since that changed, s
    hung: int | None = None  # the number of the flight that hangs
    deaths: int = 0  # of workers that held it but had not begun any of its flights


def _how_hung(chunk: _Chunk) -> str:
    simulated = chunk.at[1]
    where = "before its first row or after its last" if simulated == _NOT_IN_FLIGHT else f"at {simulated:.6g} s"
    return f"{where} the simulated time did not advance during {chunk.stuck:.3g} s of process time"


def fly_all(
    tasks: Iterator[Task | None],
    folder: Path,
    *,
    workers: int,
    wall_time: WallTime,
    timeout: float = TIMEOUT,
    fly: Fly = fly_task,
) -> Generator[Done | None]:
    """Flies the tasks and yields each when it is done, in any order; None now and then while there is nothing to yield.

    A None among the tasks says that the next one waits for flights that are out. A few chunks are sent out ahead. With
    `workers` = 0 the tasks are flown in this process, one by one, without a timeout. Closing the generator ends every
    worker at once. Raises `WorkersError` when workers cannot be kept alive.
    """
    if not workers:
        for task in filter(None, tasks):
            yield Done(task, fly(task, folder))
        return
    yield from _Flying(tasks, folder, workers, wall_time, timeout, fly).results()


class _Flying:
    """The state of `fly_all`."""

    def __init__(
        self, tasks: Iterator[Task | None], folder: Path, workers: int, wall_time: WallTime, timeout: float, fly: Fly
    ) -> None:
        self.tasks, self.folder, self.workers, self.timeout, self.fly = tasks, folder, workers, timeout, fly
        self.wall_time = wall_time
        self.again: deque[_Chunk] = deque()  # to be flown again
        self.out: dict[Future[list[WorkerResult | str]], _Chunk] = {}
        # For each slot what its worker notes. One that is being ended may still write, so a slot is reused as late as
        # possible.
        slots = 16 * AHEAD * workers
        self.notes = SPAWN.RawArray("d", _NOTES * slots)
        self.slots = deque(range(slots))
        self.pool = self._pool()
        self.restarts = 0  # since a flight was done
        self.idle: dict[int, OwnTime] = {}  # the workers by their process, while none has begun a flight
        self.stalled = 0.0  # for how long all of these have been blocked, s
        self.looked = time.monotonic()

    def results(self) -> Iterator[Done | None]:
        try:
            while self._send() or self.out:
                done, _ = wait(self.out, timeout=0.1, return_when=FIRST_COMPLETED)
                if not done:
                    yield None
                for future in done:
                    if chunk := self.out.pop(future, None):
                        self.slots.append(chunk.slot)
                        yield from self._received(chunk, future)
                if done:
                    self.idle, self.stalled = {}, 0.0
                if time.monotonic() - self.looked > _LOOK_EVERY:
                    self.looked = time.monotonic()
                    self._end_hung()
                    self._replace_stalled()
        finally:
            ended(self.pool)

    def _pool(self) -> ProcessPool:
        pool = started(self.workers, _prepare, (self.notes, self.folder, self.fly))
        self.idle, self.stalled = {}, 0.0
        return pool

    def _restart(self) -> None:
        """Replaces all workers; the chunks of the old ones are flown again."""
        self.restarts += 1
        if self.restarts > _MOST_RESTARTS:
            raise WorkersError(
                "the worker processes end as soon as they are started; a Python script must call harness.run under "
                '`if __name__ == "__main__":`'
            )
        ended(self.pool)
        for chunk in self.out.values():
            self.slots.append(chunk.slot)
            self.again.append(chunk)
        self.out.clear()
        self.pool = self._pool()

    def _send(self) -> bool:
        """Sends chunks until every worker has enough; returns whether it sent any."""
        sent = False
        while len(self.out) < AHEAD * self.workers:
            chunk = self.again.popleft() if self.again else self._next_chunk()
            if chunk is None:
                break
            message = zlib.compress(pickle.dumps(chunk.tasks), 1)
            waiting = sum(other.size for future, other in self.out.items() if not future.running())
            if waiting and waiting + len(message) > _PIPE:
                self.again.appendleft(chunk)
                break
            chunk.slot, chunk.size, chunk.worker, chunk.hung = self.slots.popleft(), len(message), None, None
            self.notes[_NOTES * chunk.slot] = _NONE
            try:
                future = self.pool.schedule(_fly_chunk, args=(chunk.slot, message))
            except RuntimeError:  # the pool is broken
                self.slots.append(chunk.slot)
                self.again.appendleft(chunk)
                self._restart()
                continue
            self.out[future] = chunk
            sent = True
        return sent

    def _next_chunk(self) -> _Chunk | None:
        tasks: list[Task] = []
        seconds = 0.0
        while seconds < CHUNK and len(tasks) < _MOST_TASKS and (task := next(self.tasks, None)) is not None:
            tasks.append(task)
            seconds += self.wall_time.seconds(task.flight)
        return _Chunk(tasks) if tasks else None

    def _end_hung(self) -> None:
        """Ends every worker whose flight has gained no simulated time in the time that the worker had for it."""
        for future, chunk in self.out.items():
            number, simulated, process = self.notes[_NOTES * chunk.slot : _NOTES * (chunk.slot + 1)]
            if number == _NONE or chunk.hung is not None:
                continue
            if chunk.worker is None or chunk.at != (number, simulated):
                chunk.worker, chunk.at, chunk.stuck = OwnTime(int(process)), (number, simulated), 0.0
                continue
            chunk.stuck += sum(chunk.worker.since_last_look())
            if chunk.stuck > self.timeout + (_ASIDE if simulated == _NOT_IN_FLIGHT else 0.0):
                chunk.hung = int(number)
                future.cancel()  # Pebble ends the worker of a running task that is cancelled

    def _replace_stalled(self) -> None:
        """Replaces all workers if they only wait: one was killed while it held the lock that they share."""
        if any(future.running() for future in self.out):
            self.idle, self.stalled = {}, 0.0
            return
        processes = [worker.pid for worker in living() if worker.pid]
        looks = [self.idle.setdefault(pid, OwnTime(pid)).since_last_look() for pid in processes]
        self.stalled += min((look.blocked for look in looks), default=0.0)
        if self.stalled > _STALLED:
            self._restart()

    def _received(self, chunk: _Chunk, future: Future[list[WorkerResult | str]]) -> Iterator[Done]:
        try:
            answers = future.result()
        except BrokenProcessPool:
            self.again.append(chunk)
            self._restart()
            return
        except (CancelledError, ProcessExpired) as error:
            yield from self._lost(chunk, error)
            return
        self.restarts = 0
        for task, answer in zip(chunk.tasks, answers, strict=True):
            if isinstance(answer, str):
                yield _failed(task, Outcome.INVALID, answer)
            else:
                if answer.result.seconds is not None:
                    self.wall_time.learn(task.flight, answer.result.seconds)
                yield Done(task, answer)

    def _lost(self, chunk: _Chunk, error: BaseException) -> Iterator[Done]:
        """The worker of the chunk died or was ended: the flight it flew is lost, the others are flown again."""
        at = int(self.notes[_NOTES * chunk.slot]) if chunk.hung is None else chunk.hung
        rest = list(chunk.tasks)
        if at != _NONE:
            task = rest.pop(at)
            self.restarts = 0
            if chunk.hung is None:
                code = getattr(error, "exitcode", None)
                yield _failed(task, Outcome.WORKER_DIED, f"its worker {how_ended(code)}")
            else:
                yield _failed(task, Outcome.TIMEOUT, _how_hung(chunk))
        else:  # between two flights: none of them is to blame
            chunk.deaths += 1
            if chunk.deaths > _MOST_RESTARTS:
                raise WorkersError(f"worker processes end before they can fly: {error}")
        if rest:
            self.again.append(_Chunk(rest, deaths=chunk.deaths))


# In a worker

_SHARED: dict[str, Any] = {}  # set once per process by `_prepare`


def _prepare(notes: Any, folder: Path, fly: Fly) -> None:
    _SHARED.update(notes=notes, folder=folder, fly=fly)


def _note(simulated: float, so_far: object = None) -> None:
    """Notes the simulated time, s: called after each row. Does nothing in a process that is no worker."""
    if _SHARED:
        _SHARED["notes"][_SHARED["at"]] = simulated


def _fly_chunk(slot: int, message: bytes) -> list[WorkerResult | str]:
    """For each task of a message its result, or in words what went wrong."""
    try:
        tasks: list[Task] = pickle.loads(zlib.decompress(message))
    except LawError as error:
        raise WorkersError(f"a law has changed during the run: {error}: run the same command again") from None
    notes, folder, fly = _SHARED["notes"], _SHARED["folder"], _SHARED["fly"]
    _SHARED["at"] = _NOTES * slot + 1
    answers: list[WorkerResult | str] = []
    for number, task in enumerate(tasks):
        notes[_NOTES * slot + 1 : _NOTES * (slot + 1)] = [_NOT_IN_FLIGHT, os.getpid()]
        notes[_NOTES * slot] = float(number)
        try:
            answers.append(fly(task, folder))
        except Exception as error:  # a fault of the harness, or a missing file: it concerns this flight only
            answers.append(f"it could not be flown: {type(error).__name__}: {error}")
    notes[_NOTES * slot] = _NONE
    return answers
