"""Worker processes that fly flights; a worker that dies or hangs costs one flight.

Flights are sent in chunks, because a kinematic flight takes little longer than a message. Each worker notes in shared
memory which flight of its chunk it flies and since when. So a death or a hang loses that flight alone: the rest of the
chunk is flown again.
"""

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

from harness.error import HarnessError
from harness.flight import Flight
from harness.key import version_of
from harness.plants.plant import Outcome
from harness.pool import SPAWN, ended, started
from harness.runs.row import FlightResult, failed_result, result_of, simulate_safely
from harness.runs.wall_time import CHUNK, WallTime

AHEAD = 2  # chunks sent out per worker: one is flown, one waits
SHORTEST_TIMEOUT = 10.0  # s: with a shorter one, flights would time out because the machine is busy
_RECORDING = 60.0  # s added to the timeout of a flight that is recorded
_STALLED = 30.0  # s without any busy worker, after which all are restarted
_MOST_RESTARTS = 3  # of the workers, with no flight done in between
_MOST_TASKS = 64  # in a chunk
_PIPE = 48_000  # bytes of waiting messages: a full pipe blocks this process, for ever if all workers are dead
_NONE = -1  # no flight of the chunk has begun


class WorkersError(HarnessError):
    """The workers cannot fly; the message says why in one line."""


class Task(NamedTuple):
    """A flight to be flown."""

    key: str
    position: int
    flight: Flight
    version: str  # the number of its `Version` when the task was made
    record: str  # when to write a recording: all | failed | none


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


def fly_task(task: Task, folder: Path) -> WorkerResult:
    """Flies a task, in a worker, and writes its recording if the task asks for one."""
    begin = time.perf_counter()
    log = simulate_safely(task.flight)
    result = result_of(log, time.perf_counter() - begin)
    problem = ""
    if task.record == "all" or (task.record == "failed" and log.outcome is not Outcome.COMPLETED):
        from harness.runs.recordings import record

        problem = record(log, task.key, folder)
    return WorkerResult(result, version_of(task.flight).number, problem)


def _failed(task: Task, outcome: Outcome, reason: str) -> Done:
    return Done(task, WorkerResult(failed_result(outcome, reason), task.version))


@dataclass(slots=True)
class _Chunk:
    tasks: Sequence[Task]
    slot: int = 0  # its place in the shared memory
    size: int = 0  # bytes, of its message
    hung: int | None = None  # the number of the flight that took too long
    deaths: int = 0  # of workers that held it but had not begun any of its flights


def fly_all(
    tasks: Iterator[Task],
    folder: Path,
    *,
    workers: int,
    wall_time: WallTime,
    timeout: float | None = None,
    fly: Fly = fly_task,
) -> Generator[Done | None]:
    """Flies the tasks and yields each when it is done, in any order; None now and then while there is nothing to yield.

    A few chunks are sent out ahead. With `workers` = 0 the tasks are flown in this process, one by one, without a
    timeout. Closing the generator ends every worker at once. Raises `WorkersError` when workers cannot be kept alive.
    """
    if not workers:
        for task in tasks:
            yield Done(task, fly(task, folder))
        return
    yield from _Flying(tasks, folder, workers, wall_time, timeout, fly).results()


class _Flying:
    """The state of `fly_all`."""

    def __init__(
        self, tasks: Iterator[Task], folder: Path, workers: int, wall_time: WallTime, timeout: float | None, fly: Fly
    ) -> None:
        self.tasks, self.folder, self.workers, self.timeout, self.fly = tasks, folder, workers, timeout, fly
        self.wall_time = wall_time
        self.again: deque[_Chunk] = deque()  # to be flown again
        self.out: dict[Future[list[WorkerResult | str]], _Chunk] = {}
        # For each slot: which flight of its chunk is flown, and since when (all processes share the monotonic clock).
        # A worker that is being ended may still write to its slot, so a slot is reused as late as possible.
        slots = 16 * AHEAD * workers
        self.begun = SPAWN.RawArray("d", 2 * slots)
        self.slots = deque(range(slots))
        self.pool = self._pool()
        self.restarts = 0  # since a flight was done
        self.moved = time.monotonic()  # the last time a worker was busy

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
                self._end_hung()
                if done or any(future.running() for future in self.out):
                    self.moved = time.monotonic()
                elif time.monotonic() - self.moved > _STALLED:  # a worker was killed while it held the lock they share
                    self._restart()
        finally:
            ended(self.pool)

    def _pool(self) -> ProcessPool:
        pool = started(self.workers, _prepare, (self.begun, self.folder, self.fly))
        self.moved = time.monotonic()
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
            chunk.slot, chunk.size, chunk.hung = self.slots.popleft(), len(message), None
            self.begun[2 * chunk.slot] = _NONE
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
        """Ends every worker whose flight takes longer than its timeout."""
        for future, chunk in self.out.items():
            number, since = self.begun[2 * chunk.slot : 2 * chunk.slot + 2]
            if number == _NONE or chunk.hung is not None:
                continue
            if time.monotonic() - since > self._limit(chunk.tasks[int(number)]):
                chunk.hung = int(number)
                future.cancel()  # Pebble ends the worker of a running task that is cancelled

    def _limit(self, task: Task) -> float:
        limit = self.timeout or max(SHORTEST_TIMEOUT, 20.0 * self.wall_time.seconds(task.flight))
        return limit + (_RECORDING if task.record != "none" else 0.0)

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
                self.wall_time.learn(task.flight, answer.result.seconds or 0.0)
                yield Done(task, answer)

    def _lost(self, chunk: _Chunk, error: BaseException) -> Iterator[Done]:
        """The worker of the chunk died or was ended: the flight it flew is lost, the others are flown again."""
        at = int(self.begun[2 * chunk.slot]) if chunk.hung is None else chunk.hung
        rest = list(chunk.tasks)
        if at != _NONE:
            task = rest.pop(at)
            self.restarts = 0
            if chunk.hung is None:
                code = getattr(error, "exitcode", None)
                yield _failed(task, Outcome.WORKER_DIED, f"its worker ended with exit code {code}")
            else:
                yield _failed(task, Outcome.TIMEOUT, f"ended after {self._limit(task):.3g} s")
        else:  # between two flights: none of them is to blame
            chunk.deaths += 1
            if chunk.deaths > _MOST_RESTARTS:
                raise WorkersError(f"worker processes end before they can fly: {error}")
        if rest:
            self.again.append(_Chunk(rest, deaths=chunk.deaths))


# In a worker

_SHARED: dict[str, Any] = {}  # set once per process by `_prepare`


def _prepare(begun: Any, folder: Path, fly: Fly) -> None:
    _SHARED.update(begun=begun, folder=folder, fly=fly)


def _fly_chunk(slot: int, message: bytes) -> list[WorkerResult | str]:
    """For each task of a message its result, or in words what went wrong."""
    tasks: list[Task] = pickle.loads(zlib.decompress(message))
    begun, folder, fly = _SHARED["begun"], _SHARED["folder"], _SHARED["fly"]
    answers: list[WorkerResult | str] = []
    for number, task in enumerate(tasks):
        begun[2 * slot + 1] = time.monotonic()
        begun[2 * slot] = float(number)
        try:
            answers.append(fly(task, folder))
        except Exception as error:  # a fault of the harness, or a missing file: it concerns this flight only
            answers.append(f"it could not be flown: {type(error).__name__}: {error}")
    begun[2 * slot] = _NONE
    return answers
