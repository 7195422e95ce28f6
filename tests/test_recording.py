"""Recordings of real, short flights: what is in the file, what comes back, and that the viewer shows it."""

import os
import resource
import socket
import subprocess
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
import rerun_cli
from rerun.chunk import Chunk, RrdReader
from rerun.experimental import ViewerClient

from autopilot.laws import law
from harness.flight import Flight, MetricSettings
from harness.flight_log import COLUMNS, FlightLog
from harness.plant import Outcome
from harness.review.reading import read_recording
from harness.review.recording import write_recording
from harness.simulation import simulate
from harness.wind import Wind

RERUN = Path(rerun_cli.__file__).parent / "rerun"
QUIET = {**os.environ, "CI": "1"}  # or the binary writes down its user and reports home
PERIOD_NS = 50_000_000


def flight(plant: str, **settings: object) -> Flight:
    return Flight(plant=plant, law=law("nftsm", "paper_1"), duration=20.0, **settings)


@pytest.fixture(scope="module")
def kinematic() -> FlightLog:
    return simulate(flight("kinematic"))


@pytest.fixture(scope="module")
def sixdof() -> FlightLog:
    return simulate(flight("sixdof", wind=Wind(steady=(2.0, -1.0))))


def chunks(path: Path, entities: str = "/**") -> list[Chunk]:
    return RrdReader(path).stream().filter(content=entities).to_chunks()


def stamps(chunk: Chunk) -> list[int]:
    return chunk.to_record_batch().column("sim_time").cast(pa.int64()).to_pylist()


def entities(path: Path) -> set[str]:
    return {chunk.entity_path for chunk in chunks(path)}


@pytest.mark.parametrize("plant", ["kinematic", "sixdof"])
def test_a_flight_reads_back_to_the_last_bit(plant: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    log = request.getfixturevalue(plant)
    write_recording(tmp_path / "a.rrd", {plant: log}, "One flight")
    table = read_recording(tmp_path / "a.rrd")
    assert tuple(table.columns) == COLUMNS
    assert table.to_numpy().tobytes() == log.table.tobytes()


def test_of_several_flights_the_named_one_reads_back(kinematic: FlightLog, sixdof: FlightLog, tmp_path: Path) -> None:
    path, odd = tmp_path / "pair.rrd", r"runs/7:plant=6 DOF \ ü"
    write_recording(path, {"kinematic": kinematic, odd: sixdof}, "Two")
    assert read_recording(path, odd).to_numpy().tobytes() == sixdof.table.tobytes()
    assert read_recording(path, "kinematic").to_numpy().tobytes() == kinematic.table.tobytes()
    with pytest.raises(ValueError, match=r"which flight\? It holds kinematic, runs/7"):
        read_recording(path)
    with pytest.raises(ValueError, match=r"no flight 'lagged'.*kinematic"):
        read_recording(path, "lagged")


def test_what_is_no_recording_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        read_recording(tmp_path / "none.rrd")
    (tmp_path / "text.rrd").write_text("north, east\n" * 100)
    with pytest.raises(ValueError, match=r"text\.rrd is no whole recording"):
        read_recording(tmp_path / "text.rrd")


def test_time_is_whole_nanoseconds_that_all_entities_share(
    kinematic: FlightLog, sixdof: FlightLog, tmp_path: Path
) -> None:
    write_recording(tmp_path / "pair.rrd", {"kinematic": kinematic, "sixdof": sixdof}, "Two")
    periods = list(range(0, len(kinematic) * PERIOD_NS, PERIOD_NS))
    moving = [chunk for chunk in chunks(tmp_path / "pair.rrd") if not chunk.is_static]
    assert {name for chunk in moving for name in chunk.timeline_names} == {"sim_time"}
    bounds = [chunk for chunk in moving if chunk.num_rows == 2]
    assert {tuple(stamps(chunk)) for chunk in bounds} == {(0, periods[-1])}
    assert all(stamps(chunk) == periods for chunk in moving if chunk not in bounds)


def test_plots_are_in_degrees(sixdof: FlightLog, tmp_path: Path) -> None:
    write_recording(tmp_path / "a.rrd", {"sixdof": sixdof}, "One")
    drawn = {}
    for chunk in chunks(tmp_path / "a.rrd", "/plots/**"):
        batch = chunk.to_record_batch()
        column = "SeriesLines:names" if chunk.is_static else "Scalars:scalars"
        drawn.setdefault(chunk.entity_path, {})[column] = batch.column(column).flatten().to_numpy(zero_copy_only=False)
    curves = {parts["SeriesLines:names"][0]: parts["Scalars:scalars"] for parts in drawn.values()}
    assert np.array_equal(curves["sixdof [rad]"], sixdof["sliding_variable"])
    assert np.allclose(curves["sixdof command [deg/s]"], np.degrees(sixdof["heading_rate_command"]))
    assert curves["limit ±5 [deg/s]"].tolist() == [pytest.approx(5.0)] * 2
    assert {name.split(" [")[1] for name in curves} == {"m]", "deg/s]", "deg]", "rad]"}


def test_what_a_plant_has_not_is_not_drawn(kinematic: FlightLog, sixdof: FlightLog, tmp_path: Path) -> None:
    write_recording(tmp_path / "kinematic.rrd", {"a": kinematic}, "One")
    write_recording(tmp_path / "sixdof.rrd", {"a": sixdof}, "One")
    missing = {entity.split("/")[2] for entity in entities(tmp_path / "sixdof.rrd") if "/plots/" in entity}
    missing -= {entity.split("/")[2] for entity in entities(tmp_path / "kinematic.rrd") if "/plots/" in entity}
    assert missing == {"bank", "sideslip"}
    assert "/target/position/wind" in entities(tmp_path / "sixdof.rrd") - entities(tmp_path / "kinematic.rrd")


def test_an_early_end_is_told_with_its_reason(tmp_path: Path) -> None:
    log = simulate(flight("kinematic", metrics=MetricSettings(monitoring_range=283.0)))
    assert log.outcome is Outcome.TARGET_LOST
    for rows in (len(log), 1, 0):
        ended = FlightLog(log.flight, log.outcome, log.reason, log.table[:rows])
        write_recording(tmp_path / "a.rrd", {"a": ended}, "One")
        assert len(read_recording(tmp_path / "a.rrd")) == rows
        (event,) = (chunk for chunk in chunks(tmp_path / "a.rrd", "/runs/a/end") if not chunk.is_static)
        (text,) = event.to_record_batch().column("TextLog:text").flatten().to_pylist()
        assert "target_lost" in text
        assert log.reason in text
        assert stamps(event) == [max(0, rows - 1) * PERIOD_NS]


def test_rerun_verifies_the_file(kinematic: FlightLog, sixdof: FlightLog, tmp_path: Path) -> None:
    write_recording(tmp_path / "pair.rrd", {"kinematic": kinematic, "sixdof": sixdof}, "Two", "*notes*")
    done = subprocess.run([RERUN, "rrd", "verify", tmp_path / "pair.rrd"], env=QUIET, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_file_that_breaks_off_leaves_the_old_one_and_nothing_else(kinematic: FlightLog, tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    path.write_text("old")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, hard))
    try:
        with pytest.raises(OSError, match="too large"):
            write_recording(path, {"a": kinematic}, "One")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert [file.name for file in tmp_path.iterdir()] == ["a.rrd"]
    assert path.read_text() == "old"


def test_a_path_that_cannot_be_written_is_an_oserror(kinematic: FlightLog, tmp_path: Path) -> None:
    for path in (tmp_path / "no such folder" / "a.rrd", tmp_path):
        with pytest.raises(OSError, match=path.name):
            write_recording(path, {"a": kinematic}, "One")
    assert list(tmp_path.iterdir()) == []
    assert list(tmp_path.parent.glob(".*.partial")) == []


def test_recordings_leave_no_threads_behind(kinematic: FlightLog, tmp_path: Path) -> None:
    threads = Path("/proc/self/task")
    if not threads.exists():
        pytest.skip("threads are counted in /proc")
    counts = []
    for _ in range(6):
        write_recording(tmp_path / "a.rrd", {"a": kinematic}, "One")
        counts.append(sum(1 for _ in threads.iterdir()))
    assert counts[-1] <= counts[0]


def test_the_viewer_shows_a_pair(kinematic: FlightLog, sixdof: FlightLog, tmp_path: Path) -> None:
    drivers = [*Path("/usr/share/vulkan/icd.d").glob("*.json"), *Path("/etc/vulkan/icd.d").glob("*.json")]
    if not drivers and os.environ.get("CI") != "true":
        pytest.skip("no Vulkan driver: apt-get install --no-install-recommends mesa-vulkan-drivers")
    write_recording(tmp_path / "pair.rrd", {"kinematic": kinematic, "sixdof": sixdof}, "Two", "*notes*")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    at = ["--bind", "127.0.0.1", "--port", str(port), "--window-size", "1200x800", "--memory-limit", "2GB"]
    with (tmp_path / "viewer.log").open("w") as said:
        viewer = subprocess.Popen(
            [RERUN, "--headless", *at, tmp_path / "pair.rrd"], env=QUIET, stdout=said, stderr=said
        )
    try:
        client = connected(viewer, port, tmp_path / "viewer.log")
        client.set_time("sim_time", duration=10.0, play_state="paused")
        client.save_screenshot(str(tmp_path / "pair.png"))  # draws, and so reports
        views = client.get_state().views
        names = {view.name for view in views}
        assert {"Notes", "Range error [m]", "Heading rate [deg/s]", "Bank [deg]", "Sideslip [deg]"} < names
        assert [(view.name, report.summary) for view in views for report in view.reports] == []
        assert [entry.message for entry in client.get_logs() if entry.level == "ERROR"] == []
    finally:
        viewer.terminate()
        viewer.wait(10.0)
    assert (tmp_path / "pair.png").stat().st_size > 20_000  # bytes: more than an empty window has


def connected(viewer: subprocess.Popen[bytes], port: int, said: Path) -> ViewerClient:
    """The viewer once it has loaded its recording."""
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline and viewer.poll() is None:
        try:
            client = ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
            state = client.get_state()
        except Exception:  # whatever it says before it listens
            time.sleep(0.1)
            continue
        if state.recordings and not state.loading and any(line.end for line in state.recordings[0].timelines):
            return client
        time.sleep(0.05)
    raise AssertionError(f"the viewer shows nothing: {said.read_text()[-2000:]}")
