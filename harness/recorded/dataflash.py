"""Reads DataFlash, the log of ArduPilot: a file that describes the format of its own messages."""

import mmap
import struct
from array import array
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from harness.recorded import thinning
from harness.recorded.draft import Draft
from harness.recorded.recorded_flight import Array, Basis, LogError, LoggedEvent, RecordedFlight

MAGIC = b"\xa3\x95"  # before every message; the type follows
_FMT = 128  # the type of the message that describes another
_FMT_LENGTH = 89
_PIECE = 1 << 24  # bytes of the mapped file in memory at once

# Each letter of a format: NumPy's type, and the factor by which its whole numbers are multiplied.
_LETTERS: Mapping[str, tuple[str, float]] = MappingProxyType(
    {
        "a": ("(32,)<i2", 1.0), "b": ("i1", 1.0), "B": ("u1", 1.0), "h": ("<i2", 1.0), "H": ("<u2", 1.0),
        "i": ("<i4", 1.0), "I": ("<u4", 1.0), "f": ("<f4", 1.0), "d": ("<f8", 1.0), "g": ("<f2", 1.0), "n": ("S4", 1.0),
        "N": ("S16", 1.0), "Z": ("S64", 1.0), "c": ("<i2", 0.01), "C": ("<u2", 0.01), "e": ("<i4", 0.01),
        "E": ("<u4", 0.01), "L": ("<i4", 1e-7), "M": ("u1", 1.0), "q": ("<i8", 1.0), "Q": ("<u8", 1.0),
    }
)  # fmt: skip
_FIX = 3  # the least GPS.Status of a position in three dimensions
_EARTH = 6_371_000.0  # m: radius of the Earth
_DEGREES = ("d", "h", "D", "U", "k")  # units of FMTU that are degrees, or degrees a second


class Message(NamedTuple):
    """The channels of one kind of message, each a field with its unit in logs that do not contain units."""

    name: str
    basis: Basis
    channels: Mapping[str, tuple[str, str, float]]  # field, unit ("deg" or SI), sign or scale
    note: str = ""


def _filter(number: str) -> tuple[Message, ...]:
    """The messages of the extended Kalman filter `XKF` or `NKF`."""
    return (
        Message(
            f"{number}1",
            Basis.ESTIMATED,
            {
                "north": ("PN", "m", 1.0),
                "east": ("PE", "m", 1.0),
                "altitude": ("PD", "m", -1.0),
                "velocity_north": ("VN", "m/s", 1.0),
                "velocity_east": ("VE", "m/s", 1.0),
                "velocity_down": ("VD", "m/s", 1.0),
            },
        ),
        Message(f"{number}2", Basis.ESTIMATED, {"wind_north": ("VWN", "m/s", 1.0), "wind_east": ("VWE", "m/s", 1.0)}),
    )


_INDICATED = "as the sensor gives it: not corrected for thin air"
# The first message that gives a channel is taken, so that a sensor comes before a filter.
MESSAGES = (
    Message(
        "ATT",
        Basis.ESTIMATED,
        {"bank": ("Roll", "deg", 1.0), "pitch": ("Pitch", "deg", 1.0), "yaw": ("Yaw", "deg", 1.0)},
    ),
    Message(
        "ATT",
        Basis.COMMANDED,
        {"bank_command": ("DesRoll", "deg", 1.0), "pitch_command": ("DesPitch", "deg", 1.0)},
    ),
    *_filter("XKF"),
    *_filter("NKF"),
    Message(
        "GPS",
        Basis.MEASURED,
        {
            "ground_speed": ("Spd", "m/s", 1.0),
            "course": ("GCrs", "deg", 1.0),
            "velocity_down": ("VZ", "m/s", 1.0),
        },
    ),
    Message("POS", Basis.ESTIMATED, {"altitude": ("RelHomeAlt", "m", 1.0)}),
    Message("ARSP", Basis.MEASURED, {"airspeed": ("Airspeed", "m/s", 1.0)}, _INDICATED),
    Message(
        "CTUN", Basis.ESTIMATED, {"airspeed": ("As", "m/s", 1.0)}, "the autopilot's airspeed, maybe without a sensor"
    ),
    Message(
        "IMU",
        Basis.MEASURED,
        {
            "roll_rate": ("GyrX", "rad/s", 1.0),
            "pitch_rate": ("GyrY", "rad/s", 1.0),
            "yaw_rate": ("GyrZ", "rad/s", 1.0),
            "forward_acceleration": ("AccX", "m/s2", 1.0),
            "lateral_acceleration": ("AccY", "m/s2", 1.0),
            "vertical_acceleration": ("AccZ", "m/s2", 1.0),
        },
    ),
    Message(
        "AOA",
        Basis.ESTIMATED,
        {"angle_of_attack": ("AOA", "deg", 1.0), "sideslip": ("SSA", "deg", 1.0)},
        "from the filter's wind",
    ),
    Message("NTUN", Basis.COMMANDED, {"airspeed_command": ("TAspd", "m/s", 1.0)}),
    Message("TECS", Basis.COMMANDED, {"airspeed_command": ("spdem", "m/s", 1.0)}),
    Message("NTUN", Basis.DERIVED, {"altitude_error": ("AltErr", "m", -1.0)}, "by the autopilot"),
    Message("AETR", Basis.COMMANDED, {"throttle": ("Thr", "", 0.01)}),
    Message("CTUN", Basis.COMMANDED, {"throttle": ("ThO", "", 0.01)}),
)
_WANTED = {message.name for message in MESSAGES} | {"MODE", "MSG", "PARM", "FMTU", "MULT", "STAT", "ERR"}
# Flight modes of ArduPlane that events name.
_MODES: Mapping[int, str] = MappingProxyType(
    {0: "MANUAL", 1: "CIRCLE", 2: "STABILIZE", 3: "TRAINING", 4: "ACRO", 5: "FBWA", 6: "FBWB", 7: "CRUISE",
     8: "AUTOTUNE", 10: "AUTO", 11: "RTL", 12: "LOITER", 13: "TAKEOFF", 14: "AVOID_ADSB", 15: "GUIDED", 24: "THERMAL"}
)  # fmt: skip


class Layout(NamedTuple):
    """The format of a message from FMT."""

    name: str
    length: int  # bytes, with the three before it
    letters: str
    fields: tuple[str, ...]

    @property
    def dtype(self) -> np.dtype[np.void] | None:
        """The body of the message; None where the description does not fit its length."""
        if len(self.letters) != len(self.fields) or not set(self.letters) <= set(_LETTERS) or not self.letters:
            return None
        if len(set(self.fields)) < len(self.fields):
            return None
        kind = np.dtype([(name, _LETTERS[letter][0]) for name, letter in zip(self.fields, self.letters, strict=True)])
        return kind if kind.itemsize == self.length - 3 else None

    @property
    def instance(self) -> int:
        """Where in the message the number of the sensor, or filter, is; 0 without one."""
        places = self.dtype.fields if self.dtype else None
        for name in ("I", "C", "Instance"):
            if places and name in places and places[name][0].itemsize == 1:
                return 3 + places[name][1]
        return 0


class _Offsets:
    """Where the messages of one kind are, of its first sensor: all of them, of more than `2 MOST` every second, …"""

    def __init__(self, instance: int) -> None:
        self.instance, self.number = instance, 256
        self.seen, self.step, self.at = 0, 1, array("q")

    def add(self, content: mmap.mmap, at: int) -> None:
        if self.instance and (number := content[at + self.instance]) != self.number:
            if number > self.number:
                return
            self.number, self.seen, self.step, self.at = number, 0, 1, array("q")
        if self.seen % self.step == 0:
            self.at.append(at)
        self.seen += 1
        if len(self.at) >= 2 * thinning.MOST:
            del self.at[1::2]
            self.step *= 2


class _Index:
    """Where the messages of a file are: the layouts, and the offset of each message that is wanted."""

    def __init__(self, content: mmap.mmap) -> None:
        self.layouts: dict[int, Layout] = {_FMT: Layout("FMT", _FMT_LENGTH, "BBnNZ", ())}
        self.offsets: dict[str, _Offsets] = {}
        self.skipped, self.cut, self.conflicts = 0, 0, 0
        self._scan(content)

    def _scan(self, content: mmap.mmap) -> None:
        at, size, released = 0, len(content), _PIECE
        lengths = [0] * 256
        wanted: list[_Offsets | None] = [None] * 256
        lengths[_FMT] = _FMT_LENGTH
        while at + 3 <= size:
            if content[at] != 0xA3 or content[at + 1] != 0x95 or not lengths[content[at + 2]]:
                begin = content.find(MAGIC, at + 1)
                self.skipped += (begin if begin >= 0 else size) - at
                at = begin if begin >= 0 else size
                continue
            if at > released:
                content.madvise(mmap.MADV_DONTNEED)
                released = at + _PIECE
            kind = content[at + 2]
            if at + lengths[kind] > size:
                self.cut = size - at
                return
            if kind == _FMT:
                described, layout = _described(content[at + 3 : at + _FMT_LENGTH])
                known = self.layouts.get(described)
                if layout is None or described == _FMT or (known and known != layout and lengths[described]):
                    self.conflicts += int(described != _FMT)
                elif known is None:
                    self.layouts[described] = layout
                    lengths[described] = layout.length
                    if layout.name in _WANTED and layout.dtype is not None:
                        wanted[described] = self.offsets.setdefault(layout.name, _Offsets(layout.instance))
            offsets = wanted[kind]
            if offsets is not None:
                offsets.add(content, at)
            at += lengths[kind]

    def layout(self, name: str) -> Layout | None:
        return next((layout for layout in self.layouts.values() if layout.name == name), None)


def _described(body: bytes) -> tuple[int, Layout | None]:
    kind, length, name, letters, fields = struct.unpack("<BB4s16s64s", body)
    try:
        texts = [text.rstrip(b"\0").decode("ascii") for text in (name, letters, fields)]
    except UnicodeDecodeError:
        return kind, None
    if length < 3 or not texts[0]:
        return kind, None
    return kind, Layout(texts[0], length, texts[1], tuple(filter(None, texts[2].split(","))))


def read_dataflash(path: Path) -> RecordedFlight:
    """The flight of a DataFlash file, which is mapped into memory, not read into it. Raises `LogError`, and OSError."""
    with path.open("rb") as file:
        try:
            content = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        except ValueError:
            raise LogError(f"{path}: is empty") from None
        with content:
            return _read(path, content)


def _read(path: Path, content: mmap.mmap) -> RecordedFlight:
    index = _Index(content)
    if len(index.layouts) < 2:
        raise LogError(f"{path}: is no readable DataFlash log: it describes no message")
    draft = Draft(path.name, [str(path)], "the autopilot's clock since its start")
    if index.cut:
        draft.problems.append(f"{path.name}: ends within a message, {index.cut} bytes before its end")
    if index.skipped:
        draft.problems.append(f"{path.name}: {index.skipped} bytes belong to no known message, and are skipped")
    if index.conflicts:
        draft.problems.append(
            f"{path.name}: {index.conflicts} descriptions of messages are damaged, or contradict others"
        )
    tables = {
        name: table
        for name in index.offsets
        if (layout := index.layout(name)) and (table := _table(content, index.offsets[name].at, layout)) is not None
    }
    for name, offsets in index.offsets.items():
        if offsets.step > 1:
            draft.problems.append(thinning.said(f"{path.name}: {name}", offsets.seen, offsets.step))
    units, factors = _units(tables, index.layouts)
    times: dict[str, tuple[Array, NDArray[np.void]]] = {}
    for message in MESSAGES:
        if message.name in tables and message.name not in times:
            times[message.name] = _in_order(draft, path, message.name, tables[message.name])
        layout = index.layout(message.name)
        if message.name in times and layout:
            time, rows = times[message.name]
            unit, factor = units.get(message.name, ""), factors.get(message.name, {})
            for name, (wanted, default, scale) in message.channels.items():
                if wanted not in layout.fields or name in draft.channels:
                    continue
                k = layout.fields.index(wanted)
                known = unit[k : k + 1]
                degrees = known in _DEGREES if known and known not in "-?" else default == "deg"
                to_si = scale * factor.get(k, _LETTERS[layout.letters[k]][1]) * (np.pi / 180.0 if degrees else 1.0)
                values, source = rows[wanted].astype(float) * to_si, f"{message.name}.{wanted}"
                draft.add(name, time, values, message.basis, source, message.note)
    _add_velocity(draft)
    if "GPS" in times and (layout := index.layout("GPS")):
        _add_position(draft, layout, *times["GPS"])
    _add_events(draft, tables)
    return draft.finished()


def _table(content: mmap.mmap, offsets: "array[int]", layout: Layout) -> NDArray[np.void] | None:
    """The messages of one kind as rows."""
    kind = layout.dtype
    if kind is None or not offsets:
        return None
    raw = np.frombuffer(content, np.uint8)
    rows = np.empty(len(offsets), kind)
    body, begins = rows.view(np.uint8).reshape(len(offsets), -1), np.frombuffer(offsets, np.int64)
    for k in range(0, len(offsets), 10_000):
        body[k : k + 10_000] = raw[begins[k : k + 10_000, None] + 3 + np.arange(layout.length - 3)]
        content.madvise(mmap.MADV_DONTNEED)
    del raw  # else the file could not be unmapped
    return rows


def _units(
    tables: Mapping[str, NDArray[np.void]], layouts: Mapping[int, Layout]
) -> tuple[dict[str, str], dict[str, dict[int, float]]]:
    """The letters of the units and the factor of each field of each message, if the log contains them."""
    units: dict[str, str] = {}
    factors: dict[str, dict[int, float]] = {}
    scale = {}
    if "MULT" in tables and {"Id", "Mult"} <= set(tables["MULT"].dtype.names or ()):
        scale = {chr(int(row["Id"]) % 256): float(row["Mult"]) for row in tables["MULT"]}
    if "FMTU" in tables and {"FmtType", "UnitIds", "MultIds"} <= set(tables["FMTU"].dtype.names or ()):
        for row in tables["FMTU"]:
            if layout := layouts.get(int(row["FmtType"])):
                units[layout.name] = _text(row["UnitIds"])
                letters = enumerate(_text(row["MultIds"]))
                known = {k: scale[letter] for k, letter in letters if letter not in "-?" and scale.get(letter)}
                factors[layout.name] = {k: _rounded(value) for k, value in known.items() if np.isfinite(value)}
    return units, factors


def _rounded(value: float) -> float:
    """A factor, which the log has in single precision, as it was meant."""
    return float(f"{value:.6g}")


def _in_order(draft: Draft, path: Path, name: str, rows: NDArray[np.void]) -> tuple[Array, NDArray[np.void]]:
    """The rows of this message in the order of their times, s."""
    fields = rows.dtype.names or ()
    clock, second = ("TimeUS", 1e-6) if "TimeUS" in fields else ("TimeMS", 1e-3)
    if clock not in fields:
        draft.problems.append(f"{path.name}: {name} has no time, and is left out")
        return np.empty(0), rows[:0]
    time = rows[clock].astype(float) * second
    kept = draft.in_order(time, f"{path.name}: {name}")
    return time[kept], rows[kept]


def _add_velocity(draft: Draft) -> None:
    """Without a filter's velocity, that of the receiver: its ground speed and course."""
    if "velocity_north" in draft.channels or not {"ground_speed", "course"} <= set(draft.channels):
        return
    speed, course = draft.channels["ground_speed"], draft.channels["course"]
    v, chi = speed.values, course.at(speed.time)
    draft.add("velocity_north", speed.time, v * np.cos(chi), Basis.DERIVED, "GPS.Spd, GPS.GCrs")
    draft.add("velocity_east", speed.time, v * np.sin(chi), Basis.DERIVED, "GPS.Spd, GPS.GCrs")


def _add_position(draft: Draft, layout: Layout, time: Array, rows: NDArray[np.void]) -> None:
    """Without a filter's position, that of the receiver, from its first fix on a sphere."""
    if {"north", "east"} & set(draft.channels) or not {"Status", "Lat", "Lng", "Alt"} <= set(layout.fields):
        return
    fixed = rows["Status"] >= _FIX
    time, rows = time[fixed], rows[fixed]
    if not len(time):
        return

    def number(name: str) -> Array:
        return rows[name].astype(float) * _LETTERS[layout.letters[layout.fields.index(name)]][1]

    latitude, longitude = np.radians(number("Lat")), np.radians(number("Lng"))
    east = np.unwrap(longitude - longitude[0]) * np.cos(latitude[0])
    draft.add("north", time, _EARTH * (latitude - latitude[0]), Basis.MEASURED, "GPS.Lat")
    draft.add("east", time, _EARTH * east, Basis.MEASURED, "GPS.Lng")
    draft.add("altitude", time, number("Alt") - number("Alt")[0], Basis.MEASURED, "GPS.Alt")


def _add_events(draft: Draft, tables: Mapping[str, NDArray[np.void]]) -> None:
    for time, row in _rows(tables, "MODE", "ModeNum"):
        mode = int(row["ModeNum"])
        draft.events.append(LoggedEvent(time, f"mode {_MODES.get(mode, mode)}"))
    for time, row in _rows(tables, "ERR", "Subsys"):
        draft.events.append(LoggedEvent(time, f"error of subsystem {int(row['Subsys'])}"))
    for _, row in _rows(tables, "MSG", "Message"):
        text = _text(row["Message"])
        if text.startswith("Ardu") and not draft.vehicle:
            draft.vehicle = text
    for _, row in _rows(tables, "PARM", "Value"):
        if "Name" in (row.dtype.names or ()) and np.isfinite(row["Value"]):
            draft.parameters[_text(row["Name"])] = float(row["Value"])


def _rows(tables: Mapping[str, NDArray[np.void]], name: str, field: str) -> Iterator[tuple[float, np.void]]:
    table = tables.get(name)
    if table is not None and {"TimeUS", field} <= set(table.dtype.names or ()):
        for row in table:
            yield float(row["TimeUS"]) * 1e-6, row


def _text(value: bytes) -> str:
    return bytes(value).rstrip(b"\0").decode("utf-8", "replace")
