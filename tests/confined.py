"""Commands in a process of their own each, confined: no socket, little memory, little time; and what they left behind.

A process costs half a second of imports; so one process imports everything once, and forks for each command.
"""

import ctypes
import gc
import json
import os
import platform
import resource
import signal
import struct
import subprocess
import sys
import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages
from types import TracebackType
from typing import Any, Self

SECONDS = 30  # of a command: as processor time, and twice that on the clock
MEMORY = 6 << 30  # bytes of address space


@dataclass(frozen=True)
class Ended:
    """How a command ended."""

    code: int  # minus the signal, of one that a signal ended
    stdout: str
    stderr: str
    seconds: float


class Confined:
    """Runs commands. A context manager: leaving it ends the process that forks."""

    def __init__(self, folder: Path) -> None:
        """`folder` gets what the commands print."""
        self._printed = (folder / "stdout", folder / "stderr")
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.confined"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._process.communicate()

    def run(self, words: Sequence[str], folder: Path) -> Ended:
        """`harness` with these words, started in the folder, which is its home as well."""
        assert self._process.stdin
        assert self._process.stdout
        call = {"words": list(words), "folder": str(folder), "printed": list(map(str, self._printed))}
        print(json.dumps(call), file=self._process.stdin, flush=True)
        code, seconds = json.loads(self._process.stdout.readline())
        stdout, stderr = (path.read_text(encoding="utf-8", errors="replace") for path in self._printed)
        return Ended(code, stdout, stderr, seconds)


def _serve() -> None:
    for package in ("harness", "autopilot", "aircraft"):
        for module in walk_packages(import_module(package).__path__, f"{package}."):
            if not module.name.endswith("__main__"):
                import_module(module.name)
    gc.freeze()
    for line in sys.stdin:
        call = json.loads(line)
        begun = time.monotonic()
        if (child := os.fork()) == 0:
            _command(**call)
        print(json.dumps((_waited(child, begun + 2 * SECONDS), time.monotonic() - begun)), flush=True)


def _waited(child: int, until: float) -> int:
    """The exit code of the child, which is killed when its time is over."""
    while True:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)
        if time.monotonic() > until:
            os.kill(child, signal.SIGKILL)
        time.sleep(0.002)


def _command(words: list[str], folder: str, printed: list[str]) -> None:
    """Turns this process into the command."""
    from harness.cli.main import main

    for path, number in zip(("/dev/null", *printed), range(3), strict=True):
        os.dup2(os.open(path, os.O_RDWR | os.O_CREAT | os.O_TRUNC, 0o666), number)
    sys.stdin, sys.stdout, sys.stderr = (os.fdopen(i, "rw"[i > 0], closefd=False) for i in range(3))
    os.chdir(folder)
    os.environ.update(HOME=folder, TMPDIR=folder)
    for what, most in ((resource.RLIMIT_CPU, SECONDS), (resource.RLIMIT_AS, MEMORY), (resource.RLIMIT_CORE, 0)):
        resource.setrlimit(what, (most, most))
    warnings.simplefilter("error", RuntimeWarning)  # of numbers: it says nothing to a user
    _forbid_sockets()
    sys.addaudithook(_stay_inside(folder))
    sys.argv = ["harness", *words]
    code: Any = 1
    try:
        main()
    except SystemExit as end:
        code = end.code
    except BaseException as error:  # printed as Python would
        sys.excepthook(type(error), error, error.__traceback__)
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code if isinstance(code, int) else 1)


def _stay_inside(folder: str) -> Any:
    """An audit hook that ends the process when Python opens a file elsewhere for writing."""

    def hook(event: str, words: tuple[Any, ...]) -> None:
        if event != "open" or not isinstance(words[0], str | bytes):
            return
        path, flags = os.path.realpath(os.fsdecode(words[0])), words[2]
        if flags & (os.O_WRONLY | os.O_RDWR) and not path.startswith((f"{os.path.realpath(folder)}/", "/dev/")):
            os.write(2, f"opened for writing: {path}\n".encode())
            os._exit(99)

    return hook


def _forbid_sockets() -> None:
    """From now on the kernel ends this process (SIGSYS) when it makes a socket that is no Unix socket."""
    number = {"x86_64": 41, "aarch64": 198}.get(platform.machine())
    if number is None:
        return
    load, equal, give = 0x20, 0x15, 0x06
    filter_ = [(load, 0, 0, 0), (equal, 0, 3, number), (load, 0, 0, 16), (equal, 1, 0, 1),
               (give, 0, 0, 0x80000000), (give, 0, 0, 0x7FFF0000)]  # fmt: skip
    code = ctypes.create_string_buffer(b"".join(struct.pack("HBBI", *line) for line in filter_))
    program = ctypes.create_string_buffer(struct.pack("HxxxxxxP", len(filter_), ctypes.addressof(code)))
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(38, 1, 0, 0, 0) or libc.prctl(22, 2, program, 0, 0):
        raise OSError(ctypes.get_errno(), "the kernel does not forbid sockets")


if __name__ == "__main__":
    _serve()
