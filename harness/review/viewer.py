"""The Rerun viewer, started as a process of its own: without telemetry, listening on the loopback address only."""

import ctypes
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.parse
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import rerun_cli
from rerun.experimental import ViewerClient

from harness.error import HarnessError

HOST = "127.0.0.1"
PORT = 9876  # Rerun's default: a viewer that was opened without the harness is found there too
RERUN = Path(rerun_cli.__file__).parent / ("rerun.exe" if os.name == "nt" else "rerun")
WINDOW = (1600, 1000)
_PR_SET_PDEATHSIG = 1  # of Linux: the signal that a process gets when its parent ends


class ViewerError(HarnessError, RuntimeError):
    """The viewer cannot be opened or reached; the message says why and what to do, in one line."""


def quiet() -> dict[str, str]:
    """The environment of a viewer process: in Rerun 0.41 only the variable `CI` turns telemetry off.

    RERUN_ANALYTICS and DO_NOT_TRACK have no effect there.
    """
    return {**os.environ, "CI": "1"}


def has_display() -> bool:
    """Whether a window can be opened here, according to the environment."""
    return not sys.platform.startswith("linux") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def listening(port: int) -> bool:
    """Whether something listens on the port; answered at once, while Rerun itself would wait for 5 s."""
    try:
        with socket.create_connection((HOST, port), timeout=0.5):
            return True
    except OSError:
        return False


def address(port: int) -> str:
    """The address at which Rerun finds the viewer on this port."""
    return f"rerun+http://{HOST}:{port}/proxy"


def show(path: Path | None, port: int = PORT) -> None:
    """Opens a window with the recording, or an empty one, and waits until it is closed. Raises `ViewerError`.

    If another viewer has the port, the window uses a free one: Rerun would send the recording to the other viewer.
    """
    if not has_display():
        raise ViewerError(
            "there is no display here: use --web, or write a file with --save and open it where there is one"
        )
    if listening(port):
        if path is None:
            raise ViewerError(f"port {port} is taken, perhaps by an open viewer: use that one, or another --port")
        port = free_port()
    window = _started([*_at(port), *([str(path)] if path else [])], None)
    try:
        code = window.wait()
    finally:
        _stop(window)
    if code:
        raise ViewerError(f"the viewer ended with {code}; its own words are above")


def serve(path: Path, said: Callable[[str], None], port: int = PORT) -> None:
    """Serves Rerun's web viewer with the recording on the loopback address until it is interrupted.

    `said` gets what to open, and what to type on the machine that has a screen. Raises `ViewerError`.
    """
    data, page = (port if not listening(port) else free_port()), free_port()
    server = _started(["--serve-web", *_at(data), "--web-viewer-port", str(page), str(path)], subprocess.DEVNULL)
    try:
        deadline = time.monotonic() + 60.0
        while not (listening(page) and listening(data)):
            if server.poll() is not None or time.monotonic() > deadline:
                raise ViewerError("the web viewer does not start")
            time.sleep(0.05)
        source = urllib.parse.quote(address(data), safe="")
        said(f"open http://{HOST}:{page}/?url={source}")
        said(f"from another machine first: ssh -L {page}:{HOST}:{page} -L {data}:{HOST}:{data} {socket.gethostname()}")
        said("Ctrl-C ends it")
        server.wait()
    finally:
        _stop(server)
    raise ViewerError(f"the web viewer ended with {server.returncode}")


@contextmanager
def headless(path: Path | None, port: int | None = None) -> Iterator[ViewerClient]:
    """Yields a viewer without a window once it has loaded the recording. Needs Vulkan. Raises `ViewerError`."""
    port = port or free_port()
    with tempfile.TemporaryFile() as output:
        size = "x".join(map(str, WINDOW))
        options = ["--headless", *_at(port), "--window-size", size, "--memory-limit", "2GB"]
        process = _started([*options, *([str(path)] if path else [])], output.fileno())
        try:
            yield _connected(process, port, path is not None)
        except ViewerError as error:
            output.seek(0)
            raise ViewerError(f"{error}: {output.read()[-2000:].decode(errors='replace')}") from None
        finally:
            _stop(process)


def free_port() -> int:
    """A port on which nothing listens."""
    with socket.socket() as listener:
        listener.bind((HOST, 0))
        return int(listener.getsockname()[1])


def _at(port: int) -> list[str]:
    return ["--bind", HOST, "--port", str(port)]


def _started(arguments: Sequence[str], output: int | None) -> subprocess.Popen[bytes]:
    """A viewer process. On Linux it ends with this one, even if that is killed."""
    command = [str(RERUN), *arguments]
    if not sys.platform.startswith("linux"):
        return subprocess.Popen(command, env=quiet(), stdout=output, stderr=output)
    libc = ctypes.CDLL(None)  # loaded before the fork

    def end_with_parent() -> None:
        libc.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)

    return subprocess.Popen(command, env=quiet(), stdout=output, stderr=output, preexec_fn=end_with_parent)


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
            except Exception:  # any error: the viewer is not ready yet
                time.sleep(0.1)
                continue
            lines = state.recordings[0].timelines if state.recordings else ()
            if not loads or (not state.loading and any(line.end for line in lines)):
                return client
        time.sleep(0.05)
    raise ViewerError("the viewer shows nothing")
