"""Running a function in a process of its own, with limits: what it does to that process, it does not do to this one.

A server is started once, which has imported what the first function needs; each call is a fork of it, and takes some
milliseconds.
"""

import math
import multiprocessing
import pickle
import resource
import signal
import threading
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from harness.error import HarnessError
from harness.pool import end_with_parent

SECONDS = 60.0  # on the clock
MEMORY = 2 << 30  # bytes more than the process has when the function is called
_FORKS = multiprocessing.get_context("forkserver")

Given = ParamSpec("Given")
Result = TypeVar("Result")


class ChildError(HarnessError, RuntimeError):
    """The function gave no answer: `STAGE: cause`. The cause is a signal, too little memory, or too much time."""

    def __init__(self, stage: str, cause: str, *, is_late: bool = False) -> None:
        super().__init__(f"{stage}: {cause}")
        self.stage, self.cause, self.is_late = stage, cause, is_late


def in_child(stage: str, function: Callable[Given, Result], *args: Given.args, **kwargs: Given.kwargs) -> Result:
    """What the function returns, or raises, in a process with the limits `SECONDS` and `MEMORY`. Raises `ChildError`.

    The function and all that goes there and back must be picklable. The process writes no file, does not hear Ctrl-C,
    and ends with this one. `stage` says in an error what was done.
    """
    return limited(stage, SECONDS, MEMORY, function, *args, **kwargs)


def limited(
    stage: str,
    seconds: float,
    memory: int,
    function: Callable[Given, Result],
    *args: Given.args,
    **kwargs: Given.kwargs,
) -> Result:
    """`in_child` with other limits: bytes, and seconds on the clock, which each call of `alive` starts anew."""
    modules = {function.__module__, *(type(given).__module__ for given in args)}
    _FORKS.set_forkserver_preload(sorted(modules))  # of effect before the first call only
    answers, answer = _FORKS.Pipe(duplex=False)
    process = _FORKS.Process(target=_answer, args=(answer, seconds, memory, function, args, kwargs), daemon=True)
    process.start()
    answer.close()
    try:
        returned = None
        while returned is None:
            if not answers.poll(seconds):
                raise ChildError(stage, f"was not done in {seconds:g} s", is_late=True)
            returned, value = answers.recv()
    except EOFError:
        process.join()
        raise ChildError(stage, f"the process {how_ended(process.exitcode)}") from None
    finally:
        process.kill()
        process.join()
        process.close()
        answers.close()
    if returned:
        return value  # type: ignore[no-any-return]
    if isinstance(value, MemoryError):
        raise ChildError(stage, f"needs more memory than the {memory >> 20} MB that it may have")
    raise value


def how_ended(code: int | None) -> str:
    """What the exit code of a process says, as the end of a sentence."""
    if code is not None and code < 0:
        names = {each.value: each.name for each in signal.Signals}
        return f"was ended by {names.get(-code, f'signal {-code}')}"
    return f"ended with exit code {code}"


# In the child

_TELL_EVERY = 0.5  # s
_NONE = (resource.RLIMIT_FSIZE, resource.RLIMIT_CORE)  # a file has no room for a byte, and nothing dumps a core
_told: dict[str, Any] = {}  # where to answer, the limit in s, and when it was last told that the function goes on


def alive(*_: object) -> None:
    """Tells the parent that the function goes on, in a child; elsewhere nothing happens."""
    if _told and time.monotonic() > _told["at"] + _TELL_EVERY:
        _told["at"] = time.monotonic()
        _limit_time(_told["seconds"])
        _told["answer"].send((None, None))


def _answer(
    answer: Connection,
    seconds: float,
    memory: int,
    function: Callable[..., object],
    args: tuple[Any, ...],
    kwargs: dict[str, Any],
) -> None:
    """Sends whether the function returned, and what it returned or raised."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=end_with_parent, daemon=True).start()
    for what, most in ((resource.RLIMIT_AS, _address_space() + memory), *((what, 0) for what in _NONE)):
        _, hard = resource.getrlimit(what)
        least = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(what, (least, least))
    _limit_time(seconds)
    _told.update(answer=answer, seconds=seconds, at=time.monotonic())
    try:
        message = pickle.dumps((True, function(*args, **kwargs)))
    except Exception as error:
        message = _pickled(error)
    answer.send_bytes(message)


def _limit_time(seconds: float) -> None:
    """The kernel ends this process when it has computed for so long from now, also when its parent is gone."""
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    soon = math.ceil(time.process_time() + seconds) + 1
    resource.setrlimit(resource.RLIMIT_CPU, (soon if hard == resource.RLIM_INFINITY else min(soon, hard), hard))


def _pickled(error: Exception) -> bytes:
    """The error as a message; in words where it is of a kind that cannot be sent."""
    try:
        message = pickle.dumps((False, error))
        pickle.loads(message)
    except Exception:
        return pickle.dumps((False, RuntimeError(f"{type(error).__name__}: {error}")))
    return message


def _address_space() -> int:
    """Bytes that this process has mapped."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()
