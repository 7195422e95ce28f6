"""A flight of the harness, written as an autopilot does and read back: the format changes nothing of what is said."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from benchmarks.blind_flights import BlindLog, blind_log
from harness.recorded.assessment import assess
from harness.recorded.read import read_log
from harness.recorded.recorded_flight import Array, RecordedFlight
from tests.builders import write
from tests.recorded_logs import quaternion, write_csv, write_dataflash, write_ulog

ON_BOARD = 5  # a log of circles, on board

MAP = """\
clock = { column = "t", unit = "s" }
[[file]]
name = "attitude.csv"
bank = { column = "bank", unit = "rad", basis = "estimated" }
pitch = { column = "pitch", unit = "rad", basis = "estimated" }
yaw = { column = "yaw", unit = "rad", basis = "estimated" }
[[file]]
name = "track.csv"
velocity.columns = ["velocity_north", "velocity_east", "velocity_down"]
velocity.frame = "ned"
velocity.unit = "m/s"
velocity.basis = "estimated"
altitude = { column = "altitude", unit = "m", basis = "estimated" }
[[file]]
name = "airspeed.csv"
airspeed = { column = "airspeed", unit = "m/s", basis = "measured" }
[[file]]
name = "command.csv"
bank_command = { column = "bank_command", unit = "rad", basis = "commanded" }
[[file]]
name = "imu.csv"
lateral_acceleration = { column = "lateral_acceleration", unit = "m/s2", basis = "measured" }
[[file]]
name = "wind.csv"
wind = { columns = ["wind_north", "wind_east", "zero"], frame = "ned", unit = "m/s", basis = "estimated" }
"""


@pytest.fixture(scope="module")
def blind() -> BlindLog:
    return blind_log(ON_BOARD)


def as_csv(log: BlindLog, folder: Path) -> RecordedFlight:
    for name, stream in log.streams.items():
        write_csv(folder / f"{name}.csv", {"t": stream.time, **stream.values, "zero": 0.0 * stream.time})
    return read_log([folder], str(write(folder / "map.toml", MAP)))


def as_ulog(log: BlindLog, folder: Path) -> RecordedFlight:
    streams = log.streams
    attitude, track, imu = streams["attitude"], streams["track"], streams["imu"]
    q = quaternion(*(attitude.values[name] for name in ("bank", "pitch", "yaw")))
    velocity = {field: track.values[f"velocity_{axis}"] for field, axis in zip(("vx", "vy", "vz"), AXES, strict=True)}
    topics = {
        "vehicle_attitude": {"timestamp": attitude.time, **{f"q[{k}]": part for k, part in enumerate(q)}},
        "vehicle_local_position": {"timestamp": track.time, "z": -track.values["altitude"], **velocity},
        "airspeed": {
            "timestamp": streams["airspeed"].time, "true_airspeed_m_s": streams["airspeed"].values["airspeed"],
        },
        "vehicle_attitude_setpoint": {
            "timestamp": streams["command"].time, "roll_body": streams["command"].values["bank_command"],
        },
        "vehicle_acceleration": {
            "timestamp": imu.time, "xyz[0]": 0.0 * imu.time, "xyz[1]": imu.values["lateral_acceleration"],
            "xyz[2]": 0.0 * imu.time - 9.8,
        },
        "wind": {"timestamp": streams["wind"].time, **wind(log, "windspeed_north", "windspeed_east")},
    }  # fmt: skip
    return read_log([write_ulog(folder / "a.ulg", topics)])


def as_dataflash(log: BlindLog, folder: Path) -> RecordedFlight:
    streams = log.streams
    attitude, track, imu = streams["attitude"], streams["track"], streams["imu"]
    command = log.recorded()["bank_command"].at(attitude.time)  # a message has both
    degrees = {name: np.degrees(attitude.values[name]) for name in ("bank", "pitch", "yaw")}
    velocity = {field: track.values[f"velocity_{axis}"] for field, axis in zip(("VN", "VE", "VD"), AXES, strict=True)}
    no: Callable[[Array], Array] = np.zeros_like
    messages = {
        "ATT": ("QccccC", {
            "TimeUS": attitude.time, "DesRoll": np.degrees(np.nan_to_num(command)), "Roll": degrees["bank"],
            "DesPitch": no(attitude.time), "Pitch": degrees["pitch"], "Yaw": degrees["yaw"] % 360.0,
        }),
        "XKF1": ("QBffff", {"TimeUS": track.time, "C": no(track.time), **velocity, "PD": -track.values["altitude"]}),
        "XKF2": ("QBff", {"TimeUS": streams["wind"].time, "C": no(streams["wind"].time), **wind(log, "VWN", "VWE")}),
        "ARSP": ("QBf", {
            "TimeUS": streams["airspeed"].time, "I": no(streams["airspeed"].time),
            "Airspeed": streams["airspeed"].values["airspeed"],
        }),
        "IMU": ("QBf", {"TimeUS": imu.time, "I": no(imu.time), "AccY": imu.values["lateral_acceleration"]}),
    }  # fmt: skip
    return read_log([write_dataflash(folder / "a.bin", messages)])


AXES = ("north", "east", "down")


def wind(log: BlindLog, north: str, east: str) -> dict[str, Array]:
    values = log.streams["wind"].values
    return {north: values["wind_north"], east: values["wind_east"]}


@pytest.mark.parametrize("write_and_read", [as_csv, as_ulog, as_dataflash])
def test_what_is_said_of_a_flight_is_the_same_from_every_format(
    write_and_read: Callable[[BlindLog, Path], RecordedFlight], blind: BlindLog, tmp_path: Path
) -> None:
    before, after = assess(blind.recorded()), assess(write_and_read(blind, tmp_path))
    exact = write_and_read is not as_dataflash  # whose bank has hundredths of a degree, with its command at its times
    for one, other in zip(before.findings, after.findings, strict=True):
        if exact or not one.part.title.startswith("bank"):
            assert one.word == other.word, one.part.title
            assert one.value == pytest.approx(other.value, rel=1e-3 if exact else 0.02, nan_ok=True), one.part.title
    assert before.wind
    assert after.wind
    assert before.wind.north == pytest.approx(after.wind.north, abs=0.05)
