"""Recordings of real, short flights: what is in the file, what comes back, and that the viewer shows it."""

import random
import resource
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
import rerun as rr
from rerun.chunk import Chunk, RrdReader

from autopilot.estimator import Estimator
from autopilot.laws import law
from harness.flight import MetricSettings
from harness.log import COLUMNS, FlightLog
from harness.loop import simulate
from harness.plants.plant import Outcome
from harness.review.charts import charts
from harness.review.lanes import BRIEF, lanes_by_flight, without_cut_words
from harness.review.reading import read_logs, read_recording
from harness.review.recorder import Recorder, clean_up
from harness.review.recording import write_recording
from harness.review.seal import PLACEHOLDER, TEXT
from harness.review.styled import styled
from harness.review.viewer import RERUN, quiet
from harness.world.wind import Wind
from tests.builders import FLIGHT, SIXDOF

PERIOD_NS = 50_000_000


@pytest.fixture(scope="module")
def kinematic() -> FlightLog:
    return simulate(FLIGHT)


@pytest.fixture(scope="module")
def sixdof() -> FlightLog:
    return simulate(replace(SIXDOF, wind=Wind(steady=(2.0, -1.0))))


@pytest.fixture(scope="module")
def ekf() -> FlightLog:
    return simulate(replace(FLIGHT, estimator=Estimator(kind="ekf")))


def chunks(path: Path, entities: str = "/**") -> list[Chunk]:
    return RrdReader(path).stream().filter(content=entities).to_chunks()


def stamps(chunk: Chunk) -> list[int]:
    return list(chunk.to_record_batch().column("sim_time").cast(pa.int64()).to_pylist())


def entities(path: Path) -> set[str]:
    return {chunk.entity_path for chunk in chunks(path)}


def plotted(path: Path) -> set[str]:
    return {entity.split("/")[2] for entity in entities(path) if entity.startswith("/plots/")}


def drawn(path: Path, plot: str) -> list[dict[str, np.ndarray]]:
    """The lines of a plot by their names, an entry per entity; of those with one name the last."""
    names: dict[str, list[str]] = {}
    values: dict[str, np.ndarray] = {}
    for chunk in chunks(path, f"/plots/{plot}/**"):
        batch = chunk.to_record_batch()
        if chunk.is_static:
            names[chunk.entity_path] = batch.column("SeriesLines:names").flatten().to_pylist()
        else:
            values[chunk.entity_path] = np.vstack(batch.column("Scalars:scalars").to_pylist())
    return [dict(zip(names[entity], values[entity].T, strict=True)) for entity in sorted(names)]


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
    with pytest.raises(ValueError, match=r"text\.rrd: is not a complete recording"):
        read_recording(tmp_path / "text.rrd")


def test_a_recording_with_one_wrong_bit_is_refused(kinematic: FlightLog, sixdof: FlightLog, tmp_path: Path) -> None:
    whole, damaged, bits = tmp_path / "pair.rrd", tmp_path / "damaged.rrd", random.Random(1)
    write_recording(whole, {"kinematic": kinematic, "sixdof": sixdof}, "Two")
    written = whole.read_bytes()
    for _ in range(120):
        content = bytearray(written)
        content[bits.randrange(len(content))] ^= 1 << bits.randrange(8)
        damaged.write_bytes(content)
        with pytest.raises(ValueError, match="damaged"):
            read_recording(damaged, "sixdof")


def test_a_recording_that_is_cut_or_doubled_is_refused(kinematic: FlightLog, tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    write_recording(path, {"kinematic": kinematic}, "One")
    written = path.read_bytes()
    seal = written.index(b"CHECKSUM:")
    old = written[:seal] + b"UNSEALED:" + written[seal + 9 :]  # as by an earlier version
    for content, told in (
        (written[: len(written) // 2], "is damaged"),
        (2 * written, "is several recordings"),
        (2 * old, "the times of its rows do not rise"),
    ):
        path.write_bytes(content)
        with pytest.raises(ValueError, match=told):
            read_recording(path)
    path.write_bytes(old)
    assert read_logs(path)["kinematic"].digest == kinematic.digest


def test_a_recording_read_whole_is_the_flights_that_were_written(
    kinematic: FlightLog, sixdof: FlightLog, tmp_path: Path
) -> None:
    write_recording(tmp_path / "pair.rrd", {"kinematic": kinematic, "sixdof": sixdof}, "Two")
    for log, read in zip((kinematic, sixdof), read_logs(tmp_path / "pair.rrd").values(), strict=True):
        assert (read.flight, read.outcome, read.digest) == (log.flight, log.outcome, log.digest)


def test_a_recording_without_seal_that_ends_the_process_that_reads_it_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.rrd"
    write_recording(path, {"a": simulate(replace(FLIGHT, duration=1.0))}, "A title")
    path.write_bytes(path.read_bytes().replace(b"CHECKSUM:", b"UNSEALED:"))
    read_recording(path)
    monkeypatch.setattr("harness.review.reading._CHILD", "import os; os.abort()")
    with pytest.raises(ValueError, match=r"a\.rrd: is damaged: the process that read it ended with exit code -6"):
        read_recording(path)


def test_every_recording_takes_its_seal() -> None:
    """What Rerun draws at random in each must not meet a part of the placeholder: then that would be compressed."""
    for _ in range(400):
        to = Recorder()
        memory = to.stream.memory_recording()
        to.once("/notes/checksum", rr.TextDocument(TEXT))
        assert memory.drain_as_bytes().count(PLACEHOLDER) == 1
        to.stream.disconnect()
    clean_up()


def test_time_is_whole_nanoseconds_that_all_entities_share(ekf: FlightLog, sixdof: FlightLog, tmp_path: Path) -> None:
    write_recording(tmp_path / "pair.rrd", {"ekf": ekf, "sixdof": sixdof}, "Two")
    periods = set(range(0, len(sixdof) * PERIOD_NS, PERIOD_NS))
    moving = [chunk for chunk in chunks(tmp_path / "pair.rrd") if not chunk.is_static]
    assert {name for chunk in moving for name in chunk.timeline_names} == {"sim_time"}
    assert all(set(stamps(chunk)) <= periods for chunk in moving)
    whole = [chunk for chunk in moving if chunk.num_rows == len(sixdof)]
    assert {chunk.entity_path.split("/")[1] for chunk in whole} == {"runs", "plots"}
    assert all(stamps(chunk) == sorted(periods) for chunk in whole)


def test_plots_are_in_degrees(sixdof: FlightLog, tmp_path: Path) -> None:
    write_recording(tmp_path / "a.rrd", {"sixdof": sixdof}, "One")
    bounds, flown = drawn(tmp_path / "a.rrd", "heading_rate")
    assert bounds["limit ±5 deg/s"] == pytest.approx(5.0)
    assert np.allclose(flown["limited"], np.degrees(sixdof["heading_rate_command"]))
    assert np.allclose(flown["flown"], np.degrees(sixdof["heading_rate"]))
    assert np.allclose(drawn(tmp_path / "a.rrd", "surfaces")[0]["rudder, left +"], np.degrees(sixdof["rudder"]))
    assert np.array_equal(drawn(tmp_path / "a.rrd", "sliding_variable")[0]["s"], sixdof["sliding_variable"])
    assert np.array_equal(drawn(tmp_path / "a.rrd", "airspeed")[1]["flown"], sixdof["airspeed"])


def test_what_a_plant_has_not_is_not_drawn(kinematic: FlightLog, sixdof: FlightLog, tmp_path: Path) -> None:
    write_recording(tmp_path / "kinematic.rrd", {"a": kinematic}, "One")
    write_recording(tmp_path / "sixdof.rrd", {"a": sixdof}, "One")
    assert plotted(tmp_path / "sixdof.rrd") - plotted(tmp_path / "kinematic.rrd") == {
        *("bank", "sideslip", "attack", "load", "lateral", "throttle", "surfaces")
    }
    assert "/target/position/wind" in entities(tmp_path / "sixdof.rrd") - entities(tmp_path / "kinematic.rrd")


def test_every_line_shows_both_peaks_when_zoomed_out(ekf: FlightLog, sixdof: FlightLog, tmp_path: Path) -> None:
    write_recording(tmp_path / "pair.rrd", {"ekf": ekf, "sixdof": sixdof}, "Two")
    policies = {
        chunk.entity_path: batch.column(name).flatten().to_pylist()
        for chunk in chunks(tmp_path / "pair.rrd", "/plots/**")
        if chunk.is_static
        for batch in [chunk.to_record_batch()]
        for name in batch.schema.names
        if name.endswith(":aggregation_policy")
    }
    lines = {entity for entity in entities(tmp_path / "pair.rrd") if entity.startswith("/plots/")}
    assert policies == {line: [rr.components.AggregationPolicy.MinMax.value] for line in lines}


def test_differences_are_against_the_reference_at_the_same_time(
    kinematic: FlightLog, sixdof: FlightLog, tmp_path: Path
) -> None:
    path = tmp_path / "pair.rrd"
    write_recording(path, {"kinematic": kinematic, "sixdof": sixdof}, "Two")
    error, bank, slip = (drawn(path, f"difference_{name}")[1]["sixdof"] for name in ("range_error", "bank", "sideslip"))
    assert np.allclose(error, sixdof["range_error"] - kinematic["range_error"])
    coordinated = np.arctan(kinematic["airspeed"] * kinematic["heading_rate"] / 9.80665)
    assert np.allclose(bank, np.degrees(sixdof["bank"] - coordinated))
    assert np.allclose(slip, np.degrees(sixdof["sideslip"]))


def test_the_band_of_an_estimate_is_its_variance(ekf: FlightLog, tmp_path: Path) -> None:
    write_recording(tmp_path / "a.rrd", {"a": ekf}, "One")
    (chunk,) = (c for c in chunks(tmp_path / "a.rrd", "/plots/target_velocity_north/00") if not c.is_static)
    batch = chunk.to_record_batch()
    for column, name in (("values", "seen"), ("variances", "variance")):
        values = batch.column(f"Measurements:{column}").flatten().to_numpy()
        assert np.array_equal(values, ekf[f"target_velocity_north_{name}"][::10])  # a measurement every 0.5 s
    innovations = [c for c in chunks(tmp_path / "a.rrd", "/plots/innovation_azimuth/01") if not c.is_static]
    assert [c.num_rows for c in innovations] == [np.isfinite(ekf["innovation_azimuth"]).sum()]


def test_more_flights_than_colours_are_refused(kinematic: FlightLog, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="7 flights: a recording shows 1 to 6"):
        write_recording(tmp_path / "a.rrd", {str(i): kinematic for i in range(7)}, "Seven")
    assert list(tmp_path.iterdir()) == []


def test_an_early_end_is_told_with_its_reason(tmp_path: Path) -> None:
    log = simulate(replace(FLIGHT, metrics=MetricSettings(monitoring_range=283.0)))
    assert log.outcome is Outcome.TARGET_LOST
    for rows in (len(log), 1, 0):
        ended = FlightLog(log.flight, log.outcome, log.reason, log.table[:rows])
        write_recording(tmp_path / "a.rrd", {"a": ended}, "One")
        assert len(read_recording(tmp_path / "a.rrd")) == rows
        (chunk,) = chunks(tmp_path / "a.rrd", "/events/a")
        texts = chunk.to_record_batch().column("TextLog:text").flatten().to_pylist()
        assert (stamps(chunk)[-1], texts[-1]) == (max(0, rows - 1) * PERIOD_NS, f"target_lost: {log.reason}")


def test_rerun_verifies_the_file(kinematic: FlightLog, sixdof: FlightLog, tmp_path: Path) -> None:
    write_recording(tmp_path / "pair.rrd", {"kinematic": kinematic, "sixdof": sixdof}, "Two", "*notes*")
    done = subprocess.run(
        [RERUN, "rrd", "verify", tmp_path / "pair.rrd"], env=quiet(), capture_output=True, check=False
    )
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


WRITING = """
import sys
from pathlib import Path
from harness.review.charts import charts
from harness.review.lanes import lanes_by_flight
from harness.review.reading import read_logs
from harness.review.recorder import Recorder, clean_up
from harness.review.recording import write_recording
from harness.review.seal import PLACEHOLDER, TEXT
from harness.review.styled import styled

logs = read_logs(Path(sys.argv[1]))
for i in range(1000):
    write_recording(Path(sys.argv[2]) / f"{i}.rrd", logs, "One")
    print(i, flush=True)
"""


def test_kill_9_while_writing_leaves_no_file_under_the_final_name(sixdof: FlightLog, tmp_path: Path) -> None:
    write_recording(tmp_path / "a.rrd", {"a": sixdof}, "One")
    folder = tmp_path / "written"
    folder.mkdir()
    writer = subprocess.Popen([sys.executable, "-c", WRITING, tmp_path / "a.rrd", folder], stdout=subprocess.PIPE)
    assert writer.stdout is not None
    writer.stdout.readline()
    for _ in range(10_000_000):  # until it is in the middle of a file
        if any(path.suffix == ".partial" for path in folder.iterdir()):
            break
    writer.kill()
    writer.wait()
    writer.stdout.close()
    whole = sorted(folder.glob("*.rrd"))
    assert whole
    for path in whole:
        assert len(read_recording(path)) == len(sixdof)


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


def test_a_word_that_has_no_room_in_its_lane_is_left_out_not_cut() -> None:
    log = simulate(replace(SIXDOF, duration=70.0, law=law("nftsm", "fitted")))
    (changes,) = (changes for name, changes in lanes_by_flight({"a": log}).items() if name == "/command")
    shown = without_cut_words(changes, 70.0, lambda word: 4.0)
    assert [(c.time, c.state.strip()) for c in shown] == changes
    ends = [*(c.time for c in changes[1:]), 70.0]
    assert [c.state.startswith(BRIEF) for c in shown] == [
        end - c.time < 4.0 for c, end in zip(changes, ends, strict=True)
    ]
    assert len({c.state.startswith(BRIEF) for c in shown}) == 2


def test_chatter_has_a_lane_that_convergence_does_not_hide() -> None:
    chattering = simulate(replace(SIXDOF, duration=100.0, law=law("nftsm", "fitted")))
    entities = {"/circle": "converged", "/chatter": "limit cycle"}
    found = lanes_by_flight({"sixdof": chattering})
    assert {entity: found[entity][-1].state for entity in entities} == entities
    assert list(lanes_by_flight({"a b": chattering, "a=b": chattering})) == [
        "/circle/a-b", "/chatter/a-b", "/circle/a-b-2", "/chatter/a-b-2",
    ]  # fmt: skip


def test_where_no_flight_circled_the_error_round_the_circle_is_not_drawn() -> None:
    log = simulate(replace(FLIGHT, duration=75.0, law=law("nftsm", "fitted")))
    azimuth = next(chart for chart in charts(styled(dict.fromkeys("abc", log))) if chart.name == "azimuth")
    for line in azimuth.lines[1:]:
        assert line.strips
        widths = [np.diff(strip[:, 0]) for strip in line.strips]
        assert np.concatenate(widths) == pytest.approx(5.0)  # degrees: one slice of the circle to the next
