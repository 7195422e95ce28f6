"""Blind logs as files: ULog, DataFlash, and CSV with its map, from the streams of messages."""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from harness.recorded.read import read_log
from harness.recorded.recorded_flight import Array, Basis, RecordedFlight
from tests.recorded_logs import quaternion, write_csv, write_dataflash, write_ulog


class Stream(NamedTuple):
    """The rows of one message: when each was written, s, and its values. SI, rad, signs as in the harness."""

    time: Array
    basis: Basis
    values: Mapping[str, Array]


Streams = Mapping[str, Stream]
UNITS = MappingProxyType({"bank": "rad", "bank_command": "rad", "pitch": "rad", "yaw": "rad", "altitude": "m",
                          "lateral_acceleration": "m/s2", "heading_rate_command": "rad/s"})  # fmt: skip
VECTORS = MappingProxyType(
    {
        "velocity": (("velocity_north", "velocity_east", "velocity_down"), "ned"),
        "wind": (("wind_north", "wind_east", "wind_down"), "ned"),
        "specific_force": (("forward", "lateral_acceleration", "below"), "frd"),
    }
)


def _ulog(folder: Path, streams: Streams, of_receipt: bool) -> RecordedFlight:
    of = {name: {"timestamp": stream.time, **stream.values} for name, stream in streams.items()}
    attitude, track, imu = of["attitude"], of["track"], of["imu"]
    turned = quaternion(attitude["bank"], attitude["pitch"], attitude["yaw"])
    nothing = np.zeros_like(imu["timestamp"])
    topics = {
        "vehicle_attitude": {"timestamp": attitude["timestamp"], **{f"q[{k}]": q for k, q in enumerate(turned)}},
        "vehicle_attitude_setpoint": _renamed(of["command"], bank_command="roll_body"),
        "vehicle_local_position": _renamed(
            {**track, "altitude": -track["altitude"]},
            velocity_north="vx", velocity_east="vy", velocity_down="vz", altitude="z",
        ),
        "airspeed": _renamed(of["airspeed"], airspeed="true_airspeed_m_s"),
        "wind": _renamed(of["wind"], wind_north="windspeed_north", wind_east="windspeed_east"),
        "vehicle_acceleration": {
            "timestamp": imu["timestamp"], "xyz[0]": nothing, "xyz[1]": imu["lateral_acceleration"],
            "xyz[2]": nothing - 9.8,
        },
    }  # fmt: skip
    return read_log([write_ulog(folder / "blind.ulg", topics)])


def _dataflash(folder: Path, streams: Streams, of_receipt: bool) -> RecordedFlight:
    of = {name: {"TimeUS": stream.time, **stream.values} for name, stream in streams.items()}
    attitude, command, track = of["attitude"], of["command"], of["track"]
    degrees = {name: np.degrees(attitude[name]) for name in ("bank", "pitch", "yaw")}
    zero = np.zeros_like(attitude["TimeUS"])
    messages = {
        "ATT": (
            "QccccC",
            {"TimeUS": attitude["TimeUS"], "DesRoll": np.degrees(command["bank_command"]), "Roll": degrees["bank"],
             "DesPitch": zero, "Pitch": degrees["pitch"], "Yaw": degrees["yaw"] % 360.0},
        ),
        "XKF1": (
            "QBffff",
            {"TimeUS": track["TimeUS"], "C": np.zeros_like(track["TimeUS"]), "VN": track["velocity_north"],
             "VE": track["velocity_east"], "VD": track["velocity_down"], "PD": -track["altitude"]},
        ),
        "XKF2": (
            "QBff",
            {"TimeUS": of["wind"]["TimeUS"], "C": np.zeros_like(of["wind"]["TimeUS"]),
             "VWN": of["wind"]["wind_north"], "VWE": of["wind"]["wind_east"]},
        ),
        "ARSP": (
            "QBf",
            {"TimeUS": of["airspeed"]["TimeUS"], "I": np.zeros_like(of["airspeed"]["TimeUS"]),
             "Airspeed": of["airspeed"]["airspeed"]},
        ),
        "IMU": (
            "QBf",
            {"TimeUS": of["imu"]["TimeUS"], "I": np.zeros_like(of["imu"]["TimeUS"]),
             "AccY": of["imu"]["lateral_acceleration"]},
        ),
    }  # fmt: skip
    return read_log([write_dataflash(folder / "blind.bin", messages)])


def _csv(folder: Path, streams: Streams, of_receipt: bool) -> RecordedFlight:
    received = ", of_receipt = true" if of_receipt else ""
    lines = [f'clock = {{ column = "t", unit = "s", counts = "the recorder\'s clock"{received} }}']
    for message, stream in streams.items():
        values = dict(stream.values)
        lines += ["[[file]]", f'name = "{message}.csv"']
        for vector, (names, frame) in VECTORS.items():
            if set(names) & set(values):
                values |= {name: np.zeros_like(stream.time) for name in names if name not in values}
                columns = ", ".join(f'"{name}"' for name in names)
                unit = "m/s2" if vector == "specific_force" else "m/s"
                lines.append(
                    f'{vector} = {{ columns = [{columns}], frame = "{frame}", unit = "{unit}", '
                    f'basis = "{stream.basis}" }}'
                )
        grouped = {name for names, _ in VECTORS.values() for name in names}
        lines += [
            f'{name} = {{ column = "{name}", unit = "{UNITS.get(name, "m/s")}", basis = "{stream.basis}" }}'
            for name in values
            if name not in grouped
        ]
        write_csv(folder / f"{message}.csv", {"t": stream.time, **values})
    (folder / "map.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return read_log([folder], str(folder / "map.toml"))


def _renamed(table: Mapping[str, Array], **names: str) -> dict[str, Array]:
    return {"timestamp": table["timestamp"], **{new: table[old] for old, new in names.items()}}


FORMATS: Mapping[str, Callable[[Path, Streams, bool], RecordedFlight]] = MappingProxyType(
    {"ULog": _ulog, "DataFlash": _dataflash, "CSV": _csv}
)  # of each a function that writes the streams into a folder and reads them back
