"""A recorded track: the curve against closed forms, the file's mistakes, and a flight along it."""

import math
import os
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from autopilot.laws import law
from harness.checks import problems
from harness.feasibility import relative_speed, warnings
from harness.flight import Flight
from harness.key import flight_key
from harness.loop import simulate
from harness.settings import SettingsError, document, flight_from_document, load_flight
from harness.world.target import Target
from harness.world.track import TrackError, load_track
from harness.world.wind import Wind
from tests.builders import write

Array = NDArray[np.float64]
HEADER = "time_s, north_m, east_m"


def written(path: Path, times: Array, north: Array, east: Array) -> Path:
    rows = (f"{t!r},{n!r},{e!r}" for t, n, e in zip(times.tolist(), north.tolist(), east.tolist(), strict=True))
    return write(path, "\n".join([HEADER, *rows, ""]))


@pytest.fixture
def circle(tmp_path: Path) -> Path:
    """Of 100 m at 3 m/s, clockwise from its northernmost point, a row each 2 s."""
    t = np.arange(0.0, 61.0, 2.0)
    return written(tmp_path / "circle.csv", t, 100.0 * np.cos(0.03 * t), 100.0 * np.sin(0.03 * t))


def flight(track: Path) -> Flight:
    return Flight(plant="kinematic", law=law("smc"), duration=60.0, target=Target(track=str(track)))


def test_a_track_that_is_a_cubic_in_time_comes_back_exactly(tmp_path: Path) -> None:
    north, east = np.poly1d([1e-3, -0.05, 2.0, 30.0]), np.poly1d([-5e-4, 0.02, -1.0, -7.0])
    rows = np.array([-4.0, 0.0, 1.0, 2.5, 7.0, 20.0, 40.0])  # unevenly
    at = load_track(written(tmp_path / "a.csv", rows, north(rows), east(rows))).at
    for t in np.linspace(0.0, 40.0, 83).tolist():
        v, a = (np.array([p.deriv(n)(t) for p in (north, east)]) for n in (1, 2))
        speed = math.hypot(*v)
        expected = (north(t), east(t), *v, v @ a / speed, (v[0] * a[1] - v[1] * a[0]) / speed**2)
        assert at(t) == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_a_circle_is_followed_through_its_rows_with_its_speed_and_turn_rate(circle: Path) -> None:
    at = load_track(circle).at
    assert at(20.0)[:2] == pytest.approx((100.0 * math.cos(0.6), 100.0 * math.sin(0.6)), abs=1e-12)
    for t in np.linspace(8.0, 52.0, 101).tolist():
        n, e, v_n, v_e, along, turn = at(t)
        assert (n, e) == pytest.approx((100.0 * math.cos(0.03 * t), 100.0 * math.sin(0.03 * t)), abs=1e-5)
        assert math.hypot(v_n, v_e) == pytest.approx(3.0, abs=1e-5)
        assert (along, turn) == pytest.approx((0.0, 0.03), abs=5e-5)


def test_the_error_falls_with_the_fourth_power_of_the_spacing(tmp_path: Path) -> None:
    def error(spacing: float) -> float:
        t = np.arange(0.0, 240.0 + spacing, spacing)
        at = load_track(written(tmp_path / f"{spacing}.csv", t, 100.0 * np.cos(0.03 * t), 100.0 * np.sin(0.03 * t))).at
        return max(abs(math.hypot(*at(t)[:2]) - 100.0) for t in np.linspace(80.0, 160.0, 777).tolist())

    assert error(8.0) / error(4.0) == pytest.approx(16.0, rel=0.1)


def test_acceleration_and_turn_rate_have_no_jump_at_a_row(circle: Path) -> None:
    track = load_track(circle)
    for row in track.begins[1:]:
        assert track.at(row - 1e-9) == pytest.approx(track.at(row), abs=1e-6)


def test_a_target_that_stands_still_does_not_turn(tmp_path: Path) -> None:
    t = np.arange(0.0, 10.0)
    track = load_track(written(tmp_path / "a.csv", t, 0.0 * t + 1.3, 0.0 * t - 2.7))
    assert track.at(4.3) == pytest.approx((1.3, -2.7, 0.0, 0.0, 0.0, 0.0), abs=1e-12)


ROWS = ["0,0,0", "1,1,0", "2,2,0", "3,3,0"]


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        ([HEADER, *ROWS[:2], "0.5,2,0", *ROWS[2:]], ":4: time_s 0.5 comes after 1, must increase from row to row"),
        ([HEADER, *ROWS[:3], ROWS[2], ROWS[3]], ":5: time_s 2 is given twice, must increase from row to row"),
        (
            [HEADER, ROWS[0], "1e-9,1,0", *ROWS[2:]],
            ":3: time_s comes 1e-09 s after the row before, must be at least 1e-06 s",
        ),
        ([HEADER, ROWS[0], "1,,0", *ROWS[2:]], ":3: north_m is missing"),
        ([HEADER, ROWS[0], "", *ROWS[2:]], ":3: no numbers, must be 3: time_s, north_m, east_m"),
        ([HEADER, ROWS[0], "1,2", *ROWS[2:]], ":3: 2 numbers, must be 3: time_s, north_m, east_m"),
        ([HEADER, ROWS[0], "1,1,0,5", *ROWS[2:]], ":3: 4 numbers, must be 3: time_s, north_m, east_m"),
        ([HEADER, ROWS[0], "1,1,NaN", *ROWS[2:]], ":3: east_m is 'NaN', must be a finite number"),
        ([HEADER, ROWS[0], "1,inf,0", *ROWS[2:]], ":3: north_m is 'inf', must be a finite number"),
        ([HEADER, ROWS[0], "one,1,0", *ROWS[2:]], ":3: time_s is 'one', must be a finite number"),
        (["time;north;east", *ROWS], ":1: the header is 'time;north;east', must be 'time_s,north_m,east_m'"),
        (ROWS, ":1: the header is '0,0,0', must be 'time_s,north_m,east_m'"),
        ([], ":1: the header is '', must be 'time_s,north_m,east_m'"),
        ([HEADER, *ROWS[:3]], ":4: 3 rows under the header, must be at least 4"),
        ([HEADER, *ROWS[1:], "4,4,0"], ":2: the track begins at 1 s, must begin at 0 or before, as the flight does"),
    ],
)
def test_a_mistake_is_one_line_with_its_place(tmp_path: Path, lines: list[str], told: str) -> None:
    path = tmp_path / "track.csv"
    path.write_text("\n".join(lines))
    with pytest.raises(TrackError) as caught:
        load_track(path)
    assert str(caught.value) == f"{path}{told}"


def test_a_file_that_cannot_be_read_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes(b"time_s\xff")
    for name, told in (("a.csv", "not text in UTF-8"), ("b.csv", "No such file or directory"), (".", "Is a directory")):
        with pytest.raises(TrackError, match=told):
            load_track(tmp_path / name)


def test_a_pipe_is_no_track(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "a.csv")
    with pytest.raises(TrackError, match="is a pipe or a device, must be a file"):
        load_track(tmp_path / "a.csv")


def test_byte_order_mark_carriage_returns_and_blank_lines_at_the_end_are_no_mistakes(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(b"\xef\xbb\xbf" + "\r\n".join([HEADER.replace(" ", ""), *ROWS, "", ""]).encode())
    assert load_track(path).at(1.5)[:3] == pytest.approx((1.5, 0.0, 1.0))


def settings(track: str, more: str = "") -> str:
    return (
        f'[flight]\nplant = "kinematic"\nduration_s = 60.0\n[flight.law]\nname = "smc"\n[flight.target]\n{track}{more}'
    )


def mistake(path: Path) -> str:
    with pytest.raises(SettingsError) as caught:
        load_flight(path)
    return str(caught.value)


def test_a_relative_path_is_from_the_settings_files_folder(
    circle: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    file = tmp_path / "a.toml"
    file.write_text(settings('track = "circle.csv"\n'))
    assert load_flight(Path("../a.toml")).target.start()(0.0)[:2] == pytest.approx((100.0, 0.0))
    file.write_text(settings(f'track = "{circle}"\n'))
    assert load_flight(file).target == Target(track=str(circle))


def test_a_flight_along_a_track_is_written_and_read_back(circle: Path) -> None:
    assert flight_from_document(document(flight(circle))) == flight(circle)


def test_mistakes_in_a_track_are_told_at_its_key(circle: Path, tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    file.write_text(settings('track = "none.csv"\n'))
    assert mistake(file) == f"{file}:7: flight.target.track: {tmp_path}/none.csv: No such file or directory"
    circle.write_text(circle.read_text() + "70,x,0\n")
    file.write_text(settings('track = "circle.csv"\n'))
    assert mistake(file) == f"{file}:7: flight.target.track: {circle}:33: north_m is 'x', must be a finite number"


def test_a_flight_may_not_outlast_its_track(circle: Path) -> None:
    (problem,) = problems(replace(flight(circle), duration=60.05))
    assert problem.name == "target.track"
    assert problem.message == f"{circle} ends at 60 s, must last as long as duration_s, 60.05 s"
    assert problems(flight(circle)) == []


def test_a_track_stands_alone(circle: Path, tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    file.write_text(settings('track = "circle.csv"\n', "speed_mps = 3\nsegments = [{ from_s = 0, to_s = 1 }]\n"))
    speed, segments = mistake(file).splitlines()
    assert speed.startswith(f"{file}:8: flight.target.speed_mps: is set beside a track")
    assert segments.startswith(f"{file}:9: flight.target.segments: is set beside a track")


def test_feasibility_and_remark_1_count_the_tracks_speed(circle: Path) -> None:
    assert relative_speed(flight(circle)) == pytest.approx(3.0, rel=1e-3)
    assert relative_speed(replace(flight(circle), wind=Wind(steady=(0.0, -2.0)))) == pytest.approx(5.0, rel=1e-3)
    said = warnings(replace(flight(circle), wind=Wind(steady=(10.5, 0.0))))
    assert any(text.startswith("Remark 1 requires v_t + v_w < v_a; here v_t + v_w is 13.5 m/s") for text in said)


def test_the_key_counts_a_tracks_content_not_its_place(circle: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy.csv"
    copy.write_bytes(circle.read_bytes())
    key = flight_key(flight(circle))
    assert flight_key(flight(copy)) == key
    assert flight_key(replace(flight(circle), target=Target())) != key
    copy.write_text(copy.read_text().replace("100.0", "100.5"))
    assert flight_key(flight(copy)) != key


def test_a_file_rewritten_within_the_clock_of_its_file_system_is_read_anew(circle: Path) -> None:
    before, since = flight_key(flight(circle)), circle.stat()
    there = load_track(circle).at(10.0)
    circle.write_text(circle.read_text().replace("100.0", "200.0"))
    os.utime(circle, ns=(since.st_atime_ns, since.st_mtime_ns))
    assert load_track(circle).at(10.0) != there
    assert flight_key(flight(circle)) != before


def test_a_flight_along_a_track_logs_it_and_flies_alike_after_pickling(circle: Path) -> None:
    log = simulate(flight(circle))
    assert log["target_north"] == pytest.approx(100.0 * np.cos(0.03 * log["time"]), abs=1e-2)
    assert log["target_turn_rate"][600] == pytest.approx(0.03, abs=1e-4)
    assert simulate(pickle.loads(pickle.dumps(flight(circle)))).digest == log.digest
