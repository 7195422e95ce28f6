"""`harness view --web`: Rerun's web viewer, served on the loopback address and opened in Chromium."""

import asyncio
import base64
import io
import json
import re
import signal
import subprocess
import time
import urllib.request
from dataclasses import replace
from pathlib import Path
from typing import Any

import psutil
from matplotlib.image import imread
from tornado.websocket import websocket_connect

import harness
from harness.review.viewer import free_port
from tests.builders import FLIGHT, SIXDOF, chromium, invoke, words_of

ORANGE = (1.0, 0.57, 0.13)  # of the 6-DOF flight, within 0.1
LEAST = 600  # pixels: some 100 are those of a warning that nothing but a processor draws here


def screenshot(address: str, folder: Path) -> Any:
    """The browser's picture of the page once it shows the flight's colour; the last one after a minute."""
    port = free_port()
    browser = subprocess.Popen(
        [
            chromium(), "--headless=new", "--no-sandbox", f"--user-data-dir={folder}", "--no-first-run",
            "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist",
            "--window-size=1200,800", f"--remote-debugging-port={port}", address,
        ],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        return asyncio.run(_pictured(port, address))
    finally:
        browser.kill()
        browser.wait()


async def _pictured(port: int, address: str) -> Any:
    deadline = time.monotonic() + 90.0
    while True:
        try:
            tabs = json.load(urllib.request.urlopen(f"http://127.0.0.1:{port}/json"))
            (tab,) = (tab for tab in tabs if tab["type"] == "page")
            break
        except (OSError, ValueError):
            assert time.monotonic() < deadline
            await asyncio.sleep(0.2)
    socket = await websocket_connect(tab["webSocketDebuggerUrl"], max_message_size=50_000_000)
    await socket.write_message(json.dumps({"id": 0, "method": "Page.navigate", "params": {"url": address}}))
    while True:
        await asyncio.sleep(1.0)
        await socket.write_message(json.dumps({"id": 1, "method": "Page.captureScreenshot"}))
        while (answer := json.loads(await socket.read_message() or "{}")).get("id") != 1:
            pass
        picture = imread(io.BytesIO(base64.b64decode(answer["result"]["data"])), format="png")
        if orange(picture) > LEAST or time.monotonic() > deadline:
            socket.close()
            return picture


def orange(picture: Any) -> int:
    return int((abs(picture[..., :3] - ORANGE).max(axis=-1) < 0.1).sum())


def test_a_browser_shows_the_recording_that_is_served_on_the_loopback_address_alone(tmp_path: Path) -> None:
    path = harness.record(harness.simulate(replace(SIXDOF, duration=20.0)), tmp_path / "flight.rrd")
    words = words_of("view", path, "--web", "--port", free_port())
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            opened, tunnel, _ = (server.stdout.readline() for _ in range(3))
            page = re.fullmatch(r"open (http://127\.0\.0\.1:(\d+)/\?url=.*3A(\d+)%2Fproxy)\n", opened)
            assert page
            assert f"ssh -L {page[2]}:127.0.0.1:{page[2]} -L {page[3]}:127.0.0.1:{page[3]} " in tunnel
            (viewer,) = psutil.Process(server.pid).children()
            assert {c.laddr.ip for c in viewer.net_connections() if c.status == psutil.CONN_LISTEN} == {"127.0.0.1"}
            assert orange(screenshot(page[1], tmp_path / "profile")) > LEAST
            server.send_signal(signal.SIGINT)
            assert server.wait(20.0) == 130
            assert not viewer.is_running()
        finally:
            server.kill()


def test_a_viewer_ends_with_a_command_that_is_killed(tmp_path: Path) -> None:
    path = harness.record(harness.simulate(replace(FLIGHT, duration=1.0)), tmp_path / "flight.rrd")
    words = words_of("view", path, "--web", "--port", free_port())
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as command:
        assert command.stdout is not None
        assert command.stdout.readline().startswith("open ")
        (viewer,) = psutil.Process(command.pid).children()
        command.kill()
        command.wait()
        psutil.wait_procs([viewer], timeout=10.0)
        assert not viewer.is_running()


def test_what_cannot_be_served_is_one_line(tmp_path: Path) -> None:
    for words, told in (
        (("--web",), "--flight, --pair, --save and --web require a folder or a file"),
        ((tmp_path / "a.rrd", "--web", "--save", tmp_path / "b.rrd"), "--save and --web exclude each other"),
    ):
        done = invoke("view", *words)
        assert done.exit_code == 2
        assert done.stderr.startswith(told)
        assert len(done.stderr.splitlines()) == 1
