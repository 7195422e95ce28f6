"""How much memory and time a long log takes: `python -m benchmarks.long_logs [MEGABYTES ...]`.

Logs of the three formats, of a flight that goes round in wind: position, velocity, attitude, command and airspeed at
50 Hz, angular rates at 400 Hz (in CSV at 50 Hz). Each is read by `harness assess` in a process of its own.
"""

import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.signal import lfilter

from benchmarks.measured import keep
from harness.plants.turn import GRAVITY
from harness.tables import markdown

PAGE = Path("docs/guide/your_flight.md")
_SIZES = (50, 500)  # MB
_RATE, _FAST = 50.0, 8  # rows a second, and how many of the angular rates come in the time of one
_CSV_ROW = 95.0  # bytes, about
_CHILD = """if True:
    import pathlib, sys
    from harness.cli.main import main
    try:
        main()
    finally:
        (most,) = (line for line in pathlib.Path("/proc/self/status").read_text().splitlines() if "VmHWM" in line)
        print(most, file=sys.stderr)
"""
_HEADINGS = ("format", "MB", "minutes of flight", "most memory, MB", "time, s")
_MAP = """\
clock = { column = "t", unit = "s", counts = "the recorder's clock" }
[[file]]
name = "*.csv"
bank = { column = "bank", unit = "rad", basis = "estimated" }
bank_command = { column = "command", unit = "rad", basis = "commanded" }
yaw = { column = "yaw", unit = "rad", basis = "estimated" }
airspeed = { column = "airspeed", unit = "m/s", basis = "measured" }
velocity_north = { column = "north", unit = "m/s", basis = "estimated" }
velocity_east = { column = "east", unit = "m/s", basis = "estimated" }
roll_rate = { column = "p", unit = "rad/s", basis = "measured" }
yaw_rate = { column = "r", unit = "rad/s", basis = "measured" }
"""
Array = NDArray[np.float64]


class Taken(NamedTuple):
    """What one log took."""

    kind: str
    size: float  # bytes
    duration: float  # s of flight
    memory: float  # bytes, at most
    seconds: float


def flown(rows: int) -> dict[str, Array]:
    """Turns to either side in wind; the bank follows its command by a lag of 0.4 s. SI, rad."""
    t = np.arange(rows) / _RATE
    noise = np.random.default_rng(0)
    command = 0.1 + 0.4 * np.sign(np.sin(0.05 * t)) + 0.1 * np.sin(0.011 * t)
    share = 1.0 / (0.4 * _RATE)
    bank = np.asarray(lfilter([share], [1.0, share - 1.0], command)) + 0.002 * noise.standard_normal(rows)
    turn = GRAVITY * np.tan(bank) / 18.0
    yaw = np.cumsum(turn) / _RATE
    return {
        "t": t, "bank": bank, "command": command, "yaw": yaw,
        "airspeed": 18.0 + 0.05 * noise.standard_normal(rows),
        "north": 18.0 * np.cos(yaw) + 3.0, "east": 18.0 * np.sin(yaw) - 2.0,
        "p": np.gradient(bank) * _RATE, "r": turn * np.cos(bank),
    }  # fmt: skip


def write_csv(folder: Path, size: float) -> tuple[Path, float]:
    """A log of this size, and how long it flies, s."""
    columns = flown(round(size / _CSV_ROW))
    (folder / "map.toml").write_text(_MAP)
    pd.DataFrame(columns).to_csv(folder / "log.csv", index=False, float_format="%.8g")
    return folder / "log.csv", len(columns["t"]) / _RATE


def write_ulog(folder: Path, size: float) -> tuple[Path, float]:
    """A log of this size, and how long it flies, s."""
    fields = {
        "vehicle_attitude": "float[4] q", "vehicle_local_position": "float vx;float vy",
        "vehicle_attitude_setpoint": "float roll_body", "airspeed": "float true_airspeed_m_s",
        "vehicle_angular_velocity": "float[3] xyz",
    }  # fmt: skip
    numbers = (4, 2, 1, 1, 3)
    kinds = [
        np.dtype([("size", "<u2"), ("kind", "u1"), ("topic", "<u2"), ("time", "<u8"), ("x", "<f4", (k,))])
        for k in numbers
    ]
    period = np.dtype(
        [(name, kind, (_FAST if k == 3 else 1,)) for name, kind, k in zip(fields, kinds, numbers, strict=True)]
    )
    f = flown(round(size / period.itemsize))
    rows = np.zeros(len(f["t"]), period)
    for topic, (name, kind) in enumerate(zip(fields, kinds, strict=True)):
        rows[name]["size"], rows[name]["kind"], rows[name]["topic"] = kind.itemsize - 3, ord("D"), topic
        rows[name]["time"] = _microseconds(f["t"], rows[name].shape[1]) + 1_000_000
    half, yaw = 0.5 * f["bank"], 0.5 * f["yaw"]
    quaternion = [
        np.cos(half) * np.cos(yaw),
        np.sin(half) * np.cos(yaw),
        np.sin(half) * np.sin(yaw),
        np.cos(half) * np.sin(yaw),
    ]
    values = (quaternion, [f["north"], f["east"]], [f["command"]], [f["airspeed"]], [f["p"], 0.0 * f["p"], f["r"]])
    for name, columns in zip(fields, values, strict=True):
        rows[name]["x"] = np.stack(columns, axis=-1)[:, np.newaxis]

    def message(kind: str, body: bytes) -> bytes:
        return struct.pack("<HB", len(body), ord(kind)) + body

    begin = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0) + message("B", bytes(40))
    for name, described in fields.items():
        begin += message("F", f"{name}:uint64_t timestamp;{described};".encode())
    for topic, name in enumerate(fields):
        begin += message("A", struct.pack("<BH", 0, topic) + name.encode())
    return _written(folder / "log.ulg", begin, rows), len(rows) / _RATE


def write_dataflash(folder: Path, size: float) -> tuple[Path, float]:
    """A log of this size, and how long it flies, s."""
    fields = {"ATT": "DesRoll,Roll,Yaw", "XKF1": "VN,VE", "ARSP": "Airspeed", "IMU": "GyrX,GyrY,GyrZ"}
    numbers = {name: len(of.split(",")) for name, of in fields.items()}
    kinds = {
        name: np.dtype([("magic", "u1", (2,)), ("kind", "u1"), ("time", "<u8"), ("x", "<f4", (k,))])
        for name, k in numbers.items()
    }
    period = np.dtype([(name, kind, (_FAST if name == "IMU" else 1,)) for name, kind in kinds.items()])
    f = flown(round(size / period.itemsize))
    rows = np.zeros(len(f["t"]), period)
    begin = _described(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
    values = {
        "ATT": [np.degrees(f[name]) for name in ("command", "bank", "yaw")], "XKF1": [f["north"], f["east"]],
        "ARSP": [f["airspeed"]], "IMU": [f["p"], 0.0 * f["p"], f["r"]],
    }  # fmt: skip
    for number, (name, kind) in enumerate(kinds.items(), 10):
        begin += _described(number, kind.itemsize, name, f"Q{numbers[name] * 'f'}", f"TimeUS,{fields[name]}")
        rows[name]["magic"], rows[name]["kind"] = (0xA3, 0x95), number
        rows[name]["time"] = _microseconds(f["t"], rows[name].shape[1])
        rows[name]["x"] = np.stack(values[name], axis=-1)[:, np.newaxis]
    return _written(folder / "log.bin", begin, rows), len(rows) / _RATE


def _described(kind: int, length: int, name: str, letters: str, fields: str) -> bytes:
    texts = (name.encode(), letters.encode(), fields.encode())
    return b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", kind, length, *texts)


def _microseconds(t: Array, times: int) -> NDArray[np.uint64]:
    """The time of each row, which comes so many times in a period."""
    return np.round(1e6 * (t[:, np.newaxis] + np.arange(times) / (times * _RATE))).astype(np.uint64)


def _written(path: Path, begin: bytes, rows: NDArray[np.void]) -> Path:
    with path.open("wb") as file:
        file.write(begin)
        rows.tofile(file)
    return path


WRITERS: Mapping[str, Callable[[Path, float], tuple[Path, float]]] = MappingProxyType(
    {"ULog": write_ulog, "DataFlash": write_dataflash, "CSV": write_csv}
)


def taken(kind: str, size: float) -> Taken:
    """What `harness assess` takes of a log of so many bytes."""
    with tempfile.TemporaryDirectory() as temporary:
        log, duration = WRITERS[kind](Path(temporary), size)
        words = ["--map", str(log.with_name("map.toml"))] if log.suffix == ".csv" else []
        begin = time.perf_counter()
        command = [sys.executable, "-c", _CHILD, "assess", str(log), *words]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        kilobytes = float(done.stderr.splitlines()[-1].split()[1])
        return Taken(kind, log.stat().st_size, duration, 1024.0 * kilobytes, time.perf_counter() - begin)


def block(sizes: Sequence[float]) -> Iterator[str]:
    """A line for each format and size, in Markdown."""
    rows = []
    for kind in WRITERS:
        for size in sizes:
            t = taken(kind, 1e6 * size)
            rows.append(
                (t.kind, f"{t.size / 1e6:.0f}", f"{t.duration / 60:.0f}", f"{t.memory / 1e6:.0f}", f"{t.seconds:.0f}")
            )
    yield from markdown(_HEADINGS, rows, "lrrrr")


def main(sizes: Sequence[float] = _SIZES, *, page: Path | None = None) -> None:
    """Print what was measured, and write it into the page."""
    text = "\n".join(block(sizes)) + "\n"
    print(text, end="")
    if page:
        keep(page, "benchmarks.long_logs", text)


if __name__ == "__main__":
    main([float(word) for word in sys.argv[1:]] or _SIZES, page=PAGE)
