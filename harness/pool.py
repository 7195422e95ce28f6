"""Worker processes: how they begin and end, for the flights of a run and for the jobs of a study alike.

They are spawned, so that they share nothing with their parent. They do not hear Ctrl-C, which is their parent's to
answer, and they end at once when their parent is gone.
"""

import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from multiprocessing.process import BaseProcess
from typing import Any, TypeVar

from pebble import ProcessPool
from pebble.pool.process import WORKERS_NAME

from harness.spawn import SPAWN
from harness.threads import use_one_thread

Result = TypeVar("Result")

_AHEAD = 2  # jobs per worker that are sent out: one in work, one waiting; a full pipe would block


def started(workers: int, prepare: Callable[..., None] | None = None, arguments: Sequence[Any] = ()) -> ProcessPool:
    """A pool whose workers are there; each calls `prepare` with the arguments first. Libraries in it use one thread."""
    use_one_thread()  # before spawn: a library reads it when it is loaded
    # Threads and processes started now leave Ctrl-C to this thread.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        pool = ProcessPool(workers, initializer=_begin, initargs=(prepare, *arguments), context=SPAWN)
        assert pool.active  # asking starts it
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    return pool


def ended(pool: ProcessPool) -> None:
    """Ends every worker at once, whatever it is at."""
    pool.stop()  # type: ignore[no-untyped-call]
    for worker in living():
        worker.kill()
    pool.join()


def living() -> list[BaseProcess]:
    """The workers of all pools of this process that have not ended."""
    return [child for child in multiprocessing.active_children() if child.name == WORKERS_NAME]


def computed(jobs: Sequence[Callable[[], Result]], workers: int) -> Iterator[Result]:
    """The results of the jobs as they complete, in any order; with one worker in this process, in their order.

    A job must be importable in a worker: a function, or a `partial` of one. Closing the generator ends every worker;
    what a job raises is raised here.
    """
    if workers == 1:
        yield from (job() for job in jobs)
        return
    waiting, out = deque(jobs), set[Future[Result]]()
    pool = started(workers)
    try:
        while waiting or out:
            while waiting and len(out) < _AHEAD * workers:
                out.add(pool.schedule(waiting.popleft()))
            done, out = wait(out, return_when=FIRST_COMPLETED)
            for future in done:
                yield future.result()
    finally:
        ended(pool)


def _begin(prepare: Callable[..., None] | None, *arguments: Any) -> None:
    """In a worker, before its first job."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if prepare:
        prepare(*arguments)


def _end_with_parent() -> None:
    """A worker whose parent was killed ends immediately, since its results are not needed."""
    parent = multiprocessing.parent_process()
    assert parent
    parent.join()
    os._exit(1)
