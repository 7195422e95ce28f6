"""The Rerun viewer as a process that the harness starts: its telemetry off, listening on loopback only."""

import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import rerun_cli
from rerun.experimental import ViewerClient

from harness.error import HarnessError

HOST = "127.0.0.1"
PORT = 9876  # Rerun's own default: a viewer that was opened otherwise is found there too
RERUN = Path(rerun_cli.__file__).parent / ("rerun.exe" if os.name == "nt" else "rerun")
WINDOW = (1600, 1000)


class ViewerError(HarnessError, RuntimeError):
    """The viewer cannot be shown, or reached: why, and what to do, in one line."""


def quiet() -> dict[str, str]:
    """The environment of a viewer: `CI` is the one variable that keeps it from writing down its user and reporting.

    RERUN_ANALYTICS and DO_NOT_TRACK do nothing in Rerun 0.41.
    """
    return {**os.environ, "CI": "1"}


def listening(port: int) -> bool:
    """Whether something listens there. At once: Rerun itself would wait for 5 s."""
    try:
        with socket.create_connection((HOST, port), timeout=0.5):
            return True
    except OSError:
        return False


def address(port: int) -> str:
    """Where Rerun finds the viewer."""
    return f"rerun+http://{HOST}:{port}/proxy"


def show(path: Path | None, port: int = PORT) -> None:
    """Opens a window with the recording, or an empty one, and waits until it is closed. Raises `ViewerError`.

    Where another viewer has the port, the recording's window takes a free one: it would be sent to the other.
    """
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise ViewerError("there is no display here: write a file with --save, and open it where there is one")
    if listening(port):
        if path is None:
            raise ViewerError(f"port {port} is taken: by a viewer that is open already, or give another --port")
        port = free_port()
    window = _started([*_at(port), *([str(path)] if path else [])], None)
    try:
        code = window.wait()
    finally:
        _stop(window)
    if code:
        raise ViewerError(f"the viewer ended with {code}; its own words are above")


@contextmanager
def headless(path: Path | None, port: int | None = None) -> Iterator[ViewerClient]:
    """A viewer without a window, once it has loaded the recording. Needs a Vulkan driver. Raises `ViewerError`."""
    port = port or free_port()
    with tempfile.TemporaryFile() as said:
        size = "x".join(map(str, WINDOW))
        options = ["--headless", *_at(port), "--window-size", size, "--memory-limit", "2GB"]
        process = _started([*options, *([str(path)] if path else [])], said.fileno())
        try:
            yield _connected(process, port, path is not None)
        except ViewerError as error:
            said.seek(0)
            raise ViewerError(f"{error}: {said.read()[-2000:].decode(errors='replace')}") from None
        finally:
            _stop(process)


def free_port() -> int:
    """A port that nobody listens on."""
    with socket.socket() as one:
        one.bind((HOST, 0))
        return int(one.getsockname()[1])


def _at(port: int) -> list[str]:
    return ["--bind", HOST, "--port", str(port)]


def _started(arguments: Sequence[str], said: int | None) -> subprocess.Popen[bytes]:
    return subprocess.Popen([str(RERUN), *arguments], env=quiet(), stdout=said, stderr=said)


def _stop(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    try:
        process.wait(10.0)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _connected(process: subprocess.Popen[bytes], port: int, loads: bool) -> ViewerClient:
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline and process.poll() is None:
        if listening(port):
            try:
                client = ViewerClient.connect(address(port))
                state = client.get_state()
            except Exception:  # whatever it says before it is ready
                time.sleep(0.1)
                continue
            lines = state.recordings[0].timelines if state.recordings else ()
            if not loads or (not state.loading and any(line.end for line in lines)):
                return client
        time.sleep(0.05)
    raise ViewerError("the viewer shows nothing")
