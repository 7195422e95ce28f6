"""Recorded flights: their logs are read or refused, repeated rows are no samples, and gaps stay unknown."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from harness.recorded import thinning
from harness.recorded.assessment import assess
from harness.recorded.column_map import read_map, shipped
from harness.recorded.contents import contents
from harness.recorded.read import read_log
from harness.recorded.recorded_flight import Array, Basis, LogError, RecordedFlight, sampled
from harness.recorded.said import lines as said
from tests import mutations
from tests.builders import invoke, write
from tests.recorded_logs import (
    BANK,
    COLUMNS,
    COMMAND,
    MAP,
    MESSAGES,
    PITCH,
    ROLL_RATE,
    SPEED,
    TIME,
    TOPICS,
    YAW,
    write_csv,
    write_dataflash,
    write_ulog,
)


def test_rows_that_repeat_a_value_are_no_samples() -> None:
    row = np.arange(0.0, 60.0, 1 / 19)
    bank = np.sin(np.floor(row / 0.4) * 0.4)  # 19 rows a second of 2.5 values
    channel = sampled(row, bank, Basis.ESTIMATED, "roll.csv: measured")
    assert channel.rows == len(row)
    assert channel.rate == pytest.approx(2.5, rel=0.06)
    middle = (channel.time[:-1] + channel.time[1:]) / 2
    assert np.abs(channel.at(middle) - np.sin(middle - 0.03)).max() < 0.06


def test_what_stays_the_same_is_known_all_along() -> None:
    row = np.arange(0.0, 60.0, 0.1)
    throttle = np.where(row < 20.0, np.sin(row), 0.5)
    channel = sampled(row, throttle, Basis.MEASURED, "throttle")
    assert channel.rate == pytest.approx(10.0)
    assert channel.at(np.array([20.05, 33.3, 59.9])) == pytest.approx(0.5, abs=0.3)
    assert channel.at(np.array([33.3, 59.9])) == pytest.approx(0.5)


def test_a_command_is_held_and_a_measured_value_interpolated_but_not_across_a_gap() -> None:
    row = np.concatenate([np.arange(0.0, 10.0), np.arange(30.0, 40.0)])
    command, measured = (sampled(row, row * 2.0, basis, "x") for basis in (Basis.COMMANDED, Basis.MEASURED))
    assert command.at(np.array([-1.0, 3.5, 20.0, 39.0, 50.0])) == pytest.approx(
        [np.nan, 6, 18, 78, np.nan], nan_ok=True
    )
    assert measured.at(np.array([-1.0, 3.5, 9.0, 20.0, 30.0, 40.0])) == pytest.approx(
        [np.nan, 7, 18, np.nan, 60, np.nan], nan_ok=True
    )


def test_a_part_of_a_flight_keeps_the_command_that_was_given_before_it() -> None:
    channel = sampled(np.array([0.0, 10.0]), np.array([15.0, 16.0]), Basis.COMMANDED, "x")
    speed = sampled(np.arange(0.0, 10.0), np.sin(np.arange(10.0)), Basis.MEASURED, "y")
    flight = RecordedFlight("f", ("f.csv",), "s", {"airspeed_command": channel, "airspeed": speed})
    part = flight.between(5.0, 8.0)
    assert part["airspeed_command"].at(np.array([5.0])) == pytest.approx(15.0)
    assert (part.begin, part.end) == (5.0, 8.0)


def logs(folder: Path) -> dict[str, list[object]]:
    """The same flight in three formats: what is passed to `harness assess`."""
    return {
        "ulog": [write_ulog(folder / "a.ulg", TOPICS)],
        "dataflash": [write_dataflash(folder / "a.bin", MESSAGES)],
        "csv": [write_csv(folder / "a.csv", COLUMNS), "--map", write(folder / "map.toml", MAP)],
    }


@pytest.mark.parametrize("kind", ["ulog", "dataflash", "csv"])
def test_a_flight_is_the_same_from_every_format(kind: str, tmp_path: Path) -> None:
    log, *map_ = logs(tmp_path)[kind]
    flight = read_log([Path(str(log))], str(map_[1]) if map_ else None)
    time = TIME[:-1] + 1e-6
    for name, values in (("bank", BANK), ("pitch", PITCH), ("airspeed", SPEED), ("roll_rate", ROLL_RATE)):
        assert flight[name].at(time) == pytest.approx(values[:-1], abs=6e-4), name
    assert np.sin(flight["yaw"].at(time)) == pytest.approx(np.sin(YAW[:-1]), abs=6e-4)
    assert flight["bank_command"].at(time) == pytest.approx(COMMAND[:-1], abs=6e-4)
    assert (flight["bank_command"].basis, flight["airspeed"].basis) == (Basis.COMMANDED, Basis.MEASURED)


def test_frames_and_signs_turn_a_vector_into_ours(tmp_path: Path) -> None:
    columns = {"t": TIME, "x": 3.0 + 0.0 * TIME, "y": 4.0 + np.sin(TIME), "z": 5.0 + 0.0 * TIME}
    text = """\
clock = { column = "t", unit = "s" }
[[file]]
name = "*.csv"
velocity = { columns = ["x", "y", "z"], frame = "enu", unit = "m/s", basis = "estimated" }
wind = { columns = ["x", "y", "z"], frame = "ned", unit = "km/h", sign = -1, basis = "estimated" }
"""
    flight = read_log([write_csv(tmp_path / "a.csv", columns)], str(write(tmp_path / "m.toml", text)))
    found = {name: float(channel.values[0]) for name, channel in flight.channels.items()}
    assert (found["velocity_east"], found["velocity_north"], found["velocity_down"]) == (3.0, 4.0, -5.0)
    assert found["wind_north"] == pytest.approx(-3.0 / 3.6)
    assert found["wind_down"] == pytest.approx(-5.0 / 3.6)


def test_velocity_along_the_body_and_attitude_give_the_velocity_over_the_ground(tmp_path: Path) -> None:
    zero = 0.0 * TIME
    columns = {
        "t_s": TIME, "north_m": zero, "east_m": zero, "down_m": zero, "u_mps": 10.0 + TIME, "v_mps": zero,
        "w_mps": zero, "phi_rad": 0.1 * np.sin(TIME), "theta_rad": zero, "psi_rad": np.pi / 2 + zero,
        "p_radps": 0.1 * np.cos(TIME), "q_radps": zero, "r_radps": zero,
    }  # fmt: skip
    flight = read_log([write_csv(tmp_path / "a.csv", columns)])  # the shipped map of Stanford fits
    assert flight["velocity_east"].at(TIME) == pytest.approx(10.0 + TIME)
    assert flight["velocity_east"].basis is Basis.DERIVED


@pytest.mark.parametrize("name", sorted(shipped()))
def test_the_shipped_maps_can_be_read(name: str) -> None:
    assert all(part.given or part.failure for part in read_map(name).files)


# Bad input: each is one line


def refused(*words: object) -> str:
    result = invoke("assess", *words)
    assert result.exit_code == 2, result.output
    (line,) = result.stderr.splitlines()
    return line


def changed(name: str, change: Callable[[Array], Array]) -> dict[str, Array]:
    return {**COLUMNS, name: change(COLUMNS[name].copy())}


def told(folder: Path, columns: Mapping[str, Array], text: str = MAP) -> str:
    """What `assess` says of a CSV file with these columns."""
    file, map_ = write_csv(folder / "a.csv", columns), write(folder / "map.toml", text)
    result = invoke("assess", file, "--map", map_)
    assert result.exit_code in (0, 2), result.output
    return result.output + result.stderr


def put(at: int, value: float) -> Callable[[Array], Array]:
    def change(column: Array) -> Array:
        column[at] = value
        return column

    return change


def test_what_is_wrong_with_the_rows_of_a_csv_is_said(tmp_path: Path) -> None:
    assert "1 of 80 rows have the time of the row before" in told(tmp_path, changed("t", put(10, COLUMNS["t"][9])))
    assert "1 of 80 rows have no time" in told(tmp_path, changed("t", put(10, np.nan)))
    assert "1 of 80 values of bank are no numbers" in told(tmp_path, changed("roll", put(10, np.nan)))
    longer = {name: np.append(column, column[:20] + 4000.0 * (name == "t")) for name, column in COLUMNS.items()}
    longer["t"] = put(10, 9e6)(longer["t"].copy())
    late = told(tmp_path, changed("t", put(10, 310.0)))
    assert "1 of 80 rows are out of order by up to 0.14 s, and are sorted" in late
    assert "1 of 100 rows have a time far off" in told(tmp_path, longer)
    back = changed("t", lambda t: np.where(t < 2000.0, t + 5000.0, t))
    assert "the clock goes back at row 41 from 1.95 s to -3.00 s after its first" in told(tmp_path, back)


def test_units_that_cannot_be_are_refused(tmp_path: Path) -> None:
    assert "bank reaches 22.4 rad: looks like degrees" in told(tmp_path, COLUMNS, MAP.replace('"deg"', '"rad"'))
    less = changed("roll", np.radians)
    assert "roll_rate looks like degrees, or bank was radians already" in told(tmp_path, less)
    rates = changed("gx", np.degrees)
    assert "looks like degrees" in told(tmp_path, rates)


def test_noise_of_an_angle_does_not_look_like_degrees(tmp_path: Path) -> None:
    noise = np.random.default_rng(1).normal(size=len(TIME))
    assert "looks like degrees" not in told(tmp_path, {**COLUMNS, "roll": noise, "gx": 0.01 * noise[::-1]})


def test_rows_that_come_faster_than_is_needed_are_averaged(tmp_path: Path) -> None:
    fast = {"t": np.arange(0.0, 8000.0, 1.0)}
    columns = {**fast, **{name: np.interp(fast["t"], COLUMNS["t"], COLUMNS[name]) for name in COLUMNS if name != "t"}}
    flight = read_log([write_csv(tmp_path / "a.csv", columns)], str(write(tmp_path / "map.toml", MAP)))
    assert flight["bank"].rate == pytest.approx(100.0, rel=0.01)
    assert flight["bank"].rows == 8000
    assert flight["bank"].at(np.array([1.0])) == pytest.approx(0.4 * np.sin(1.0), abs=1e-3)


@pytest.mark.parametrize("kind", ["ulog", "dataflash", "csv"])
def test_of_a_long_log_one_row_in_a_few_is_read_which_is_said(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log, *map_ = logs(tmp_path)[kind]
    monkeypatch.setattr(thinning, "MOST", len(TIME) // 5)
    flight = read_log([Path(str(log))], str(map_[1]) if map_ else None)
    assert len(TIME) // 10 <= flight["bank"].rows <= 2 * (len(TIME) // 5)
    assert any(f"is read of its {len(TIME)}, to bound the memory" in problem for problem in flight.problems)
    time = flight["bank"].time
    at = np.searchsorted(TIME, time - 1e-3)
    assert flight["bank"].values == pytest.approx(BANK[at], abs=6e-4)


def test_a_file_that_is_no_log_is_one_line(tmp_path: Path) -> None:
    empty, zeros = tmp_path / "empty.csv", tmp_path / "zeros.bin"
    empty.write_bytes(b"")
    zeros.write_bytes(bytes(1000))
    assert "is empty" in refused(empty)
    assert "is no ULog, no DataFlash and no CSV" in refused(zeros)
    assert "no such file or folder" in refused(tmp_path / "none.ulg")
    folder = tmp_path / "folder"
    folder.mkdir()
    assert "holds no file that ends in .ulg" in refused(folder)
    other = write_csv(tmp_path / "b.csv", {"a": TIME, "b": TIME})
    assert "none of the shipped maps, alfa, stanford, x8_ntnu, fits its columns a, b" in refused(other)
    assert "has no column 't'" in refused(other, "--map", write(tmp_path / "map.toml", MAP))
    ulog = write_ulog(tmp_path / "a.ulg", TOPICS)
    assert "must be given alone" in refused(ulog, other)
    assert "describes itself" in refused(ulog, "--map", "alfa")
    assert "the log goes from 0.00 to 3.95 s" in refused(ulog, "--from", 100)


def test_a_mistake_in_a_map_is_named_by_its_key(tmp_path: Path) -> None:
    log = write_csv(tmp_path / "a.csv", COLUMNS)
    for old, new, complaint in (
        (
            'unit = "deg", basis = "commanded"',
            'unit = "rad/s", basis = "commanded"',
            'file.0.bank_command.unit: is "rad/s"',
        ),
        ("bank_command", "bank_comand", "did you mean 'bank_command'?"),
        ('"measured" }\nrates', '"seen" }\nrates', "file.0.airspeed.basis"),
        ('frame = "flu"', 'frame = "enu"', "must be one of frd, flu"),
        ('unit = "ms"', 'unit = "min"', "must be one of s, ms, us, ns"),
        ("[[file]]", "[file]", "[[file]] is missing"),
        ("clock =", "clock", "map.toml"),
    ):
        assert complaint in refused(log, "--map", write(tmp_path / "map.toml", MAP.replace(old, new)))


def test_a_cut_log_gives_what_it_has(tmp_path: Path) -> None:
    for path in (
        write_ulog(tmp_path / "a.ulg", TOPICS, dropouts=[120, 30]),
        write_dataflash(tmp_path / "a.bin", MESSAGES),
    ):
        whole = read_log([path])
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2 + 1])
        cut = read_log([path])
        assert whole.end / 3 < cut.end < whole.end
        if path.suffix == ".ulg":
            assert "2 dropouts of the logger, 0.15 s in all, the longest 0.12 s" in whole.problems[0]
        else:
            assert "ends within a message" in cut.problems[0]


def test_messages_that_nothing_describes_are_skipped_and_counted(tmp_path: Path) -> None:
    path = write_dataflash(tmp_path / "a.bin", MESSAGES)
    path.write_bytes(path.read_bytes() + b"\xa3\x95\xee" + bytes(20) + path.read_bytes()[89:])
    flight = read_log([path])
    assert "23 bytes belong to no known message" in flight.problems[0]


def test_without_a_filter_the_receiver_tells_the_position(tmp_path: Path) -> None:
    fix = np.where(TIME < 1.0, 1.0, 3.0)
    places = {"Lat": 60.0 + 1e-4 * TIME, "Lng": 180.0 - 2e-4 * TIME, "Alt": 50.0 + TIME}
    gps = {"TimeUS": TIME, "Status": fix, **{name: np.where(fix < 3.0, 0.0, at) for name, at in places.items()}}
    flight = read_log([write_dataflash(tmp_path / "a.bin", {**MESSAGES, "GPS": ("QBLLe", gps)})])
    moved = [float(np.ptp(flight[name].values)) for name in ("north", "east", "altitude")]
    seconds = TIME[-1] - 1.0
    assert moved == pytest.approx([11.12 * seconds, 11.12 * seconds, seconds], rel=2e-3)
    assert flight["north"].time[0] == pytest.approx(1.0)


def test_a_damaged_time_does_not_make_a_log_a_year_long(tmp_path: Path) -> None:
    letters, _ = MESSAGES["ARSP"]
    rare = {"TimeUS": np.array([3e7]), "I": np.zeros(1), "Airspeed": np.array([17.0])}
    flight = read_log([write_dataflash(tmp_path / "a.bin", {**MESSAGES, "ARSP": (letters, rare)})])
    assert flight.end < 4.0
    assert "airspeed has times a day away from the others" in flight.problems[-1]


def test_a_command_that_repeats_what_is_flown_is_none(tmp_path: Path) -> None:
    letters, table = MESSAGES["ATT"]
    flight = read_log([write_dataflash(tmp_path / "a.bin", {"ATT": (letters, {**table, "DesRoll": table["Roll"]})})])
    assert "bank_command" not in flight
    assert "bank_command repeats the flown values" in flight.problems[-1]


@pytest.mark.parametrize("kind", ["ulog", "dataflash", "csv"])
@settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_a_damaged_log_is_read_or_refused_in_one_line(kind: str, data: st.DataObject, tmp_path: Path) -> None:
    log, *map_ = logs(tmp_path)[kind]
    content = Path(str(log)).read_bytes()
    Path(str(log)).write_bytes(data.draw(mutations.contents(content)))
    lines: list[str] = []
    try:
        flight = read_log([Path(str(log))], str(map_[1]) if map_ else None)
        lines += [*contents(flight), *said(assess(flight))]
    except LogError as error:
        lines += str(error).splitlines()
    assert lines
