"""A map: which column of which CSV file is which channel, in which unit, sign, frame and clock. Written in TOML."""

import math
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from harness.error import did_you_mean
from harness.files import read
from harness.plants.turn import GRAVITY
from harness.recorded.frames import AXES, BODY, EARTH
from harness.recorded.recorded_flight import QUANTITIES, Basis, LogError
from harness.toml_text import shown

SHIPPED = Path(__file__).with_name("maps")
_DEGREE, _KNOT, _FOOT = math.pi / 180.0, 1852.0 / 3600.0, 0.3048
# For each unit of a channel, the units of a column and what one of each is in it.
UNITS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        "m": {"m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0, "ft": _FOOT},
        "m/s": {"m/s": 1.0, "cm/s": 0.01, "km/h": 1.0 / 3.6, "kn": _KNOT, "ft/s": _FOOT},
        "rad": {"rad": 1.0, "deg": _DEGREE, "cdeg": 0.01 * _DEGREE},
        "rad/s": {"rad/s": 1.0, "deg/s": _DEGREE},
        "m/s2": {"m/s2": 1.0, "g": GRAVITY},
        "": {"1": 1.0, "%": 0.01},
    }
)
CLOCKS: Mapping[str, float] = MappingProxyType({"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9})
# A vector, by the frames that it may be given in: the channels of its three axes and their signs.
_POSITION = (("north", 1.0), ("east", 1.0), ("altitude", -1.0))
VECTORS: Mapping[str, Mapping[tuple[str, ...], tuple[tuple[str, float], ...]]] = MappingProxyType(
    {
        "position": {EARTH: _POSITION},
        "velocity": {
            EARTH: (("velocity_north", 1.0), ("velocity_east", 1.0), ("velocity_down", 1.0)),
            BODY: (("velocity_forward", 1.0), ("velocity_right", 1.0), ("velocity_below", 1.0)),
        },
        "wind": {EARTH: (("wind_north", 1.0), ("wind_east", 1.0), ("wind_down", 1.0))},
        "rates": {BODY: (("roll_rate", 1.0), ("pitch_rate", 1.0), ("yaw_rate", 1.0))},
        "specific_force": {
            BODY: (("forward_acceleration", 1.0), ("lateral_acceleration", 1.0), ("vertical_acceleration", 1.0))
        },
    }
)
FAILURE = "failure"
_TOP, _CLOCK = ("about", "clock", "file"), ("column", "unit", "offset_s", "counts", "of_receipt")
_SCALAR, _VECTOR = ("column", "unit", "sign", "basis", "note"), ("columns", "frame", "unit", "sign", "basis", "note")


class LogClock(NamedTuple):
    """Where a file's times are: `unit` seconds are one of the column's, and `offset` seconds are added."""

    column: str
    unit: float
    offset: float
    counts: str  # what the times are
    of_receipt: bool  # they are when a message was received


class Given(NamedTuple):
    """A channel as a column: `factor` times it is in SI, rad and our frame."""

    channel: str
    column: str
    factor: float
    basis: Basis
    note: str


@dataclass(frozen=True)
class FileMap:
    """The channels of the files whose names fit a pattern."""

    pattern: str
    clock: LogClock
    given: tuple[Given, ...]
    failure: str = ""  # the column that is not 0 from a failure on

    @property
    def columns(self) -> list[str]:
        """The columns that it needs, each once."""
        failure = [self.failure] if self.failure else []
        return list(dict.fromkeys([self.clock.column, *(one.column for one in self.given), *failure]))


@dataclass(frozen=True)
class ColumnMap:
    """A whole map, by its name."""

    name: str
    about: str
    files: tuple[FileMap, ...]

    def file(self, name: str) -> FileMap | None:
        """The part for a file of this name, the first that fits."""
        return next((one for one in self.files if fnmatchcase(name, one.pattern)), None)


def shipped() -> Mapping[str, Path]:
    """The maps that come with the harness, by name."""
    return {path.stem: path for path in sorted(SHIPPED.glob("*.toml"))}


def read_map(name: str) -> ColumnMap:
    """The map in a file, or a shipped one by its name. Raises `LogError`, a line for each mistake."""
    path = shipped().get(name, Path(name))
    if not path.exists():
        known = ", ".join(shipped())
        raise LogError(f"{name}: no such map; the shipped ones are {known}{did_you_mean(name, shipped())}")
    try:
        document = tomllib.loads(read(path).decode("utf-8"))
    except tomllib.TOMLDecodeError as error:
        raise LogError(f"{name}: {error}") from None
    except UnicodeDecodeError:
        raise LogError(f"{name}: not text in UTF-8") from None
    except RecursionError:
        raise LogError(f"{name}: nested too deep") from None
    try:
        return _parsed(name, document)
    except _MapError as error:
        raise LogError(f"{name}: {error}") from None


class _MapError(ValueError):
    """A mistake in a map, with its key."""


def _parsed(name: str, document: Mapping[str, Any]) -> ColumnMap:
    _only(document, _TOP, "")
    files = document.get("file")
    if not isinstance(files, list) or not files or not all(isinstance(one, dict) for one in files):
        raise _MapError("[[file]] is missing, must be given once for each kind of file")
    default = document.get("clock")
    return ColumnMap(
        name,
        _word(document, "about", "", ""),
        tuple(_file(one, one.get("clock", default), f"file.{k}") for k, one in enumerate(files)),
    )


def _file(table: Mapping[str, Any], clock: object, place: str) -> FileMap:
    given: list[Given] = []
    failure = ""
    for key, value in table.items():
        at = f"{place}.{key}"
        if key in ("name", "clock"):
            continue
        if not isinstance(value, dict):
            raise _MapError(f"{at}: is {shown(value)}, must be a table such as {{ column = ..., unit = ... }}")
        if key == FAILURE:
            _only(value, ("column",), at)
            failure = _word(value, "column", at)
        elif key in VECTORS:
            given += _vector(key, value, at)
        elif key in QUANTITIES:
            _only(value, _SCALAR, at)
            factor = _sign(value, at) * _factor(QUANTITIES[key].unit, value, at)
            column, note = _word(value, "column", at), _word(value, "note", at, "")
            given.append(Given(key, column, factor, _basis(value, at), note))
        else:
            known = [*VECTORS, *QUANTITIES, FAILURE]
            raise _MapError(f"{at}: unknown channel, known are {', '.join(known)}{did_you_mean(key, known)}")
    return FileMap(_word(table, "name", place), _clock(clock, place), tuple(given), failure)


def _clock(clock: object, place: str) -> LogClock:
    if not isinstance(clock, dict):
        raise _MapError('clock is missing, must be a table such as { column = "time", unit = "s" }')
    at = f"{place}.clock"
    _only(clock, _CLOCK, at)
    unit, offset = _word(clock, "unit", at), clock.get("offset_s", 0.0)
    if unit not in CLOCKS:
        raise _MapError(f"{at}.unit: is {shown(unit)}, must be one of {', '.join(CLOCKS)}")
    if isinstance(offset, bool) or not isinstance(offset, int | float) or not abs(offset) < 1e9:
        raise _MapError(f"{at}.offset_s: is {shown(offset)}, must be a finite number")
    received = clock.get("of_receipt", False)
    if not isinstance(received, bool):
        raise _MapError(f"{at}.of_receipt: is {shown(received)}, must be true or false")
    return LogClock(_word(clock, "column", at), CLOCKS[unit], float(offset), _word(clock, "counts", at, ""), received)


def _vector(key: str, value: Mapping[str, Any], at: str) -> Iterator[Given]:
    _only(value, _VECTOR, at)
    columns, frame = value.get("columns"), value.get("frame")
    if not isinstance(columns, list) or len(columns) != 3 or not all(isinstance(c, str) for c in columns):
        raise _MapError(f"{at}.columns: is {shown(columns)}, must be the names of three columns, one for each axis")
    frames = [name for names in VECTORS[key] for name in names]
    if frame not in frames:
        raise _MapError(f"{at}.frame: is {shown(frame)}, must be one of {', '.join(frames)}")
    channels = next(channels for names, channels in VECTORS[key].items() if frame in names)
    factor = _sign(value, at) * _factor(QUANTITIES[channels[0][0]].unit, value, at)
    for column, (axis, sign) in zip(columns, AXES[frame], strict=True):
        channel, own = channels[axis]
        note = _word(value, "note", at, "")
        yield Given(channel, column, factor * sign * own, _basis(value, at), note)


def _factor(si: str, value: Mapping[str, Any], at: str) -> float:
    unit = _word(value, "unit", at)
    if unit not in UNITS[si]:
        raise _MapError(f"{at}.unit: is {shown(unit)}, must be one of {', '.join(UNITS[si])}")
    return UNITS[si][unit]


def _sign(value: Mapping[str, Any], at: str) -> float:
    sign = value.get("sign", 1)
    if isinstance(sign, bool) or sign not in (1, -1):
        raise _MapError(f"{at}.sign: is {shown(sign)}, must be 1 or -1")
    return float(sign)


def _basis(value: Mapping[str, Any], at: str) -> Basis:
    basis = _word(value, "basis", at)
    if basis not in tuple(Basis):
        raise _MapError(f"{at}.basis: is {shown(basis)}, must be one of {', '.join(Basis)}")
    return Basis(basis)


def _word(table: Mapping[str, Any], key: str, at: str, default: str | None = None) -> str:
    value = table.get(key, default)
    if not isinstance(value, str) or (not value and default is None):
        how = "is missing" if key not in table else f"is {shown(value)}"
        raise _MapError(f"{f'{at}.' if at else ''}{key}: {how}, must be a text")
    return value


def _only(table: Mapping[str, Any], known: tuple[str, ...], at: str) -> None:
    for key in table:
        if key not in known:
            place = f"{at}.{key}" if at else key
            raise _MapError(f"{place}: unknown key, known here: {', '.join(known)}{did_you_mean(key, known)}")
