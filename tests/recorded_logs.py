"""Logs that tests write: one flight as ULog, as DataFlash and as CSV, from nothing but the formats' descriptions."""

import struct
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Table = Mapping[str, Array]  # a column for each field; the first is the time, s

TIME = np.arange(0.0, 4.0, 0.05)
BANK, PITCH, YAW = 0.4 * np.sin(TIME), 0.05 + 0.02 * np.cos(TIME), 3.0 + 0.1 * TIME
COMMAND, SPEED = 0.4 * np.sin(TIME + 0.2), 18.0 + np.cos(TIME)
ROLL_RATE = 0.4 * np.cos(TIME)


def quaternion(bank: Array, pitch: Array, yaw: Array) -> list[Array]:
    """From forward-right-down to north-east-down: w, x, y, z."""
    (sr, sp, sy), (cr, cp, cy) = ([f(angle / 2) for angle in (bank, pitch, yaw)] for f in (np.sin, np.cos))
    w, x = cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy
    return [w, x, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy]


TOPICS: Mapping[str, Table] = {
    "vehicle_attitude": {
        "timestamp": TIME, **{f"q[{k}]": q for k, q in enumerate(quaternion(BANK, PITCH, YAW))},
    },
    "vehicle_attitude_setpoint": {"timestamp": TIME, "roll_body": COMMAND},
    "airspeed": {"timestamp": TIME, "true_airspeed_m_s": SPEED},
    "vehicle_angular_velocity": {
        "timestamp": TIME, "xyz[0]": ROLL_RATE, "xyz[1]": 0.0 * TIME, "xyz[2]": 0.1 + 0.0 * TIME,
    },
}  # fmt: skip
# Of each message its letters, and fields in the units of ArduPilot.
MESSAGES: Mapping[str, tuple[str, Table]] = {
    "ATT": (
        "QccccC",
        {
            "TimeUS": TIME, "DesRoll": np.degrees(COMMAND), "Roll": np.degrees(BANK), "DesPitch": 0.0 * TIME,
            "Pitch": np.degrees(PITCH), "Yaw": np.degrees(YAW) % 360.0,
        },
    ),
    "ARSP": ("QBf", {"TimeUS": TIME, "I": 0.0 * TIME, "Airspeed": SPEED}),
    "IMU": ("QBfff", {"TimeUS": TIME, "I": 0.0 * TIME, "GyrX": ROLL_RATE, "GyrY": 0.0 * TIME, "GyrZ": 0.0 * TIME}),
}  # fmt: skip
COLUMNS: Table = {
    "t": 1000.0 * TIME, "roll": np.degrees(BANK), "roll_sp": np.degrees(COMMAND), "pitch": np.degrees(PITCH),
    "yaw": np.degrees(YAW), "v": SPEED, "gx": ROLL_RATE, "gy": 0.0 * TIME, "gz": 0.0 * TIME,
}  # fmt: skip
MAP = """\
clock = { column = "t", unit = "ms", counts = "the recorder's clock" }
[[file]]
name = "*.csv"
bank = { column = "roll", unit = "deg", basis = "estimated" }
bank_command = { column = "roll_sp", unit = "deg", basis = "commanded" }
pitch = { column = "pitch", unit = "deg", basis = "estimated" }
yaw = { column = "yaw", unit = "deg", basis = "estimated" }
airspeed = { column = "v", unit = "m/s", basis = "measured" }
rates = { columns = ["gx", "gy", "gz"], frame = "flu", unit = "rad/s", basis = "measured" }
"""


def write_csv(path: Path, columns: Table) -> Path:
    rows = "".join(",".join(f"{value:.9g}" for value in row) + "\n" for row in zip(*columns.values(), strict=True))
    path.write_text(",".join(columns) + "\n" + rows, encoding="utf-8")
    return path


def write_ulog(path: Path, topics: Mapping[str, Table], dropouts: Sequence[int] = ()) -> Path:
    """All fields as floats; `dropouts` in ms."""

    def message(kind: bytes, body: bytes) -> bytes:
        return struct.pack("<HB", len(body), kind[0]) + body

    out = [b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0), message(b"B", bytes(40))]
    rows = []
    for number, (name, table) in enumerate(topics.items()):
        fields = [f"float {field.replace('[', '_').replace(']', '')};" for field in table if field != "timestamp"]
        vectors: dict[str, int] = {}
        for field in table:
            if "[" in field:
                vectors[field.partition("[")[0]] = vectors.get(field.partition("[")[0], 0) + 1
        if vectors:
            fields = [f"float[{size}] {field};" for field, size in vectors.items()]
        out.append(message(b"F", f"{name}:uint64_t timestamp;{''.join(fields)}".encode()))
        for time, *values in zip(*table.values(), strict=True):
            rows.append((time, struct.pack(f"<HQ{len(values)}f", number, round(time * 1e6) + 1_000_000, *values)))
    out += [message(b"A", struct.pack("<BH", 0, number) + name.encode()) for number, name in enumerate(topics)]
    out += [message(b"O", struct.pack("<H", ms)) for ms in dropouts]
    out += [message(b"D", body) for _, body in sorted(rows, key=lambda row: float(row[0]))]
    path.write_bytes(b"".join(out))
    return path


_PACKED = {"Q": "Q", "c": "h", "C": "H", "B": "B", "f": "f", "e": "i", "L": "i"}
_PARTS = {"c": 100, "C": 100, "e": 100, "L": 10_000_000}


def write_dataflash(path: Path, messages: Mapping[str, tuple[str, Table]]) -> Path:
    def described(kind: int, length: int, name: str, letters: str, fields: str) -> bytes:
        texts = (name.encode(), letters.encode(), fields.encode())
        return b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", kind, length, *texts)

    out = [described(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")]
    rows = []
    for kind, (name, (letters, table)) in enumerate(messages.items(), 10):
        packed = struct.Struct("<" + "".join(_PACKED[letter] for letter in letters))
        out.append(described(kind, packed.size + 3, name, letters, ",".join(table)))
        for time, *values in zip(*table.values(), strict=True):
            whole = [
                float(value) if letter == "f" else round(value * _PARTS.get(letter, 1))
                for letter, value in zip(letters[1:], values, strict=True)
            ]
            rows.append((time, b"\xa3\x95" + bytes([kind]) + packed.pack(round(time * 1e6), *whole)))
    path.write_bytes(b"".join([*out, *(body for _, body in sorted(rows, key=lambda row: float(row[0])))]))
    return path
