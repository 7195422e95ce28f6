"""Running a function in a process of its own, with limits: what it does to that process, it does not do to this one.

A server, which is started once for each calling thread, has imported the module of the function; each call is a fork
of it, and takes some milliseconds. Server and child end with this process, and use pipes alone: no file and no socket
that others could find.
"""

import math
import multiprocessing
import os
import pickle
import resource
import signal
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, NamedTuple, ParamSpec, TypeVar

from harness.error import HarnessError
from harness.spawn import SPAWN
from harness.threads import use_one_thread

SECONDS = 60.0  # wall time of a call
MEMORY = 2 << 30  # bytes more than the process has when the function is called

Given = ParamSpec("Given")
Result = TypeVar("Result")


class ChildError(HarnessError, RuntimeError):
    """The function gave no answer: `STAGE: cause`. The cause is a signal, too little memory, or too much time."""

    def __init__(self, stage: str, cause: str, *, is_late: bool = False) -> None:
        super().__init__(f"{stage}: {cause}")
        self.stage, self.cause, self.is_late = stage, cause, is_late


def in_child(stage: str, function: Callable[Given, Result], *args: Given.args, **kwargs: Given.kwargs) -> Result:
    """The result or error of a function in a process with the limits `SECONDS` and `MEMORY`. Raises `ChildError`.

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
    modules = {function.__module__, *(type(given).__module__ for given in args)} - {"__main__"}
    call = _Call(seconds, memory, tuple(sorted(modules)), pickle.dumps((function, args, kwargs)))
    server = _idle()
    ended, message = server.answer(call)
    _servers.append(server)
    if ended is None:
        raise ChildError(stage, f"was not done in {seconds:g} s", is_late=True)
    if not message:
        raise ChildError(stage, f"the process {how_ended(ended)}")
    returned, value = pickle.loads(message)
    if returned:
        result: Result = value
        return result
    if isinstance(value, MemoryError):
        raise ChildError(stage, f"needs more memory than the {memory >> 20} MB that it may have")
    raise value


def how_ended(code: int | None) -> str:
    """The meaning of a process's exit code, as the end of a sentence."""
    if code is not None and code < 0:
        names = {each.value: each.name for each in signal.Signals}
        return f"was ended by {names.get(-code, f'signal {-code}')}"
    return f"ended with exit code {code}"


class _Call(NamedTuple):
    seconds: float
    memory: int
    modules: tuple[str, ...]  # what the server imports first
    content: bytes  # the function and its arguments, pickled


class _Answer(NamedTuple):
    ended: int | None  # the exit code of the child; None when its time was over
    message: bytes  # whether the function returned, and what it returned or raised, pickled; empty without an answer


class _Server:
    """The process that forks, as this one sees it."""

    def __init__(self) -> None:
        use_one_thread()  # before spawn: the server has imported the libraries when it serves
        self._calls, calls = SPAWN.Pipe()
        self._process = SPAWN.Process(target=_serve, args=(calls,), daemon=True)
        self._process.start()
        calls.close()
        self._of = os.getpid()

    @property
    def serves(self) -> bool:
        """Whether it is there, and is this process's: a fork of this one must not use it."""
        return self._of == os.getpid() and self._process.is_alive()

    def answer(self, call: _Call) -> _Answer:
        try:
            self._calls.send(call)
            return _Answer(*self._calls.recv())
        except (EOFError, OSError):
            self._process.join()
            return _Answer(self._process.exitcode, b"")
        except BaseException:  # Ctrl-C: the child ends with the server
            self._process.kill()
            self._process.join()
            raise


_servers: list[_Server] = []  # idle servers: each thread with a call uses its own


def _idle() -> _Server:
    while _servers:
        if (server := _servers.pop()).serves:
            return server
    return _Server()


# In the server


def _serve(calls: Connection) -> None:
    """Answers one call after the other until the parent is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    while True:
        try:
            call = _Call(*calls.recv())
        except EOFError:
            return
        for module in call.modules:
            with suppress(ImportError):
                import_module(module)
        answers, answer = multiprocessing.Pipe(duplex=False)
        server = os.getpid()
        if (child := os.fork()) == 0:
            calls.close()
            threading.Thread(target=_end_with, args=(server,), daemon=True).start()
            _run(call, answer)
        answer.close()
        late, message = _awaited(answers, calls, call.seconds)
        answers.close()
        if message or late:
            os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
        calls.send(tuple(_Answer(None if late else os.waitstatus_to_exitcode(status), message)))


def _awaited(answers: Connection, calls: Connection, seconds: float) -> tuple[bool, bytes]:
    """Whether the child's time was over, and its message; empty when it has ended without one."""
    while ready := wait([answers, calls], timeout=seconds):
        if calls in ready:  # the parent is gone
            return True, b""
        try:
            if message := answers.recv_bytes():
                return False, message
        except (EOFError, OSError):  # also in the middle of a message
            return False, b""
    return True, b""


# In the child

_TELL_EVERY = 0.5  # s between progress reports
_NOTHING = (resource.RLIMIT_FSIZE, resource.RLIMIT_CORE)  # no file has room for a byte, and nothing dumps a core
_told: dict[str, Any] = {}  # where to answer, the limit in s, and the time of the last progress report


def alive(*_: object) -> None:
    """Reports progress to the parent, in a child; elsewhere it has no effect."""
    if _told and time.monotonic() > _told["at"] + _TELL_EVERY:
        _told["at"] = time.monotonic()
        _limit_time(_told["seconds"])
        _told["answer"].send_bytes(b"")


def _run(call: _Call, answer: Connection) -> None:
    """Sends whether the function returned, and what it returned or raised; ends the process."""
    try:
        for what, most in ((resource.RLIMIT_AS, _address_space() + call.memory), *((what, 0) for what in _NOTHING)):
            _, hard = resource.getrlimit(what)
            least = most if hard == resource.RLIM_INFINITY else min(most, hard)
            resource.setrlimit(what, (least, least))
        _limit_time(call.seconds)
        _told.update(answer=answer, seconds=call.seconds, at=time.monotonic())
        try:
            function, args, kwargs = pickle.loads(call.content)
            message = pickle.dumps((True, function(*args, **kwargs)))
        except Exception as error:
            message = _pickled(error)
        answer.send_bytes(message)
    finally:
        os._exit(1)


def _end_with(server: int) -> None:
    while os.getppid() == server:
        time.sleep(0.2)
    os._exit(1)


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
