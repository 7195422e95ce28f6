"""Reads ULog, the log of PX4, by pyulog."""

import io
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import redirect_stdout
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pyulog import ULog

from harness.recorded import thinning
from harness.recorded.draft import Draft
from harness.recorded.frames import bank_pitch_yaw
from harness.recorded.recorded_flight import Array, Basis, LogError, LoggedEvent, RecordedFlight

MAGIC = ULog.HEADER_BYTES
_MOST_READ = 20  # largest number of bytes read over the file's size: pyulog may loop in a damaged file

_Fields = Mapping[str, Array]


class Topic(NamedTuple):
    """The channels of a topic by name, each a function of the topic's fields, in SI and rad."""

    name: str
    basis: Basis
    channels: Mapping[str, str | Callable[[_Fields], Array]]
    note: str = ""


def _attitude(part: int, q: str = "q") -> Callable[[_Fields], Array]:
    return lambda d: bank_pitch_yaw(d[f"{q}[0]"], d[f"{q}[1]"], d[f"{q}[2]"], d[f"{q}[3]"])[part]


def _minus(name: str) -> Callable[[_Fields], Array]:
    return lambda d: -d[name]


_WIND = {"wind_north": "windspeed_north", "wind_east": "windspeed_east"}
_INDICATED = "indicated airspeed; the true one is larger in thin air"
# The first topic that gives a channel is taken, so that a sensor comes before a filter.
TOPICS = (
    Topic(
        "vehicle_local_position",
        Basis.ESTIMATED,
        {
            "north": "x",
            "east": "y",
            "altitude": _minus("z"),
            "velocity_north": "vx",
            "velocity_east": "vy",
            "velocity_down": "vz",
        },
    ),
    Topic("vehicle_attitude", Basis.ESTIMATED, {"bank": _attitude(0), "pitch": _attitude(1), "yaw": _attitude(2)}),
    Topic("vehicle_attitude_setpoint", Basis.COMMANDED, {"bank_command": "roll_body", "pitch_command": "pitch_body"}),
    Topic(
        "vehicle_attitude_setpoint",
        Basis.COMMANDED,
        {"bank_command": _attitude(0, "q_d"), "pitch_command": _attitude(1, "q_d")},
    ),
    Topic("airspeed", Basis.MEASURED, {"airspeed": "true_airspeed_m_s"}, "true airspeed of the sensor"),
    Topic("airspeed", Basis.MEASURED, {"airspeed": "indicated_airspeed_m_s"}, _INDICATED),
    Topic("airspeed_validated", Basis.ESTIMATED, {"airspeed": "true_airspeed_m_s"}, "true airspeed, as validated"),
    Topic("wind", Basis.ESTIMATED, _WIND),
    Topic("wind_estimate", Basis.ESTIMATED, _WIND),
    Topic(
        "vehicle_angular_velocity",
        Basis.MEASURED,
        {"roll_rate": "xyz[0]", "pitch_rate": "xyz[1]", "yaw_rate": "xyz[2]"},
    ),
    Topic(
        "sensor_combined",
        Basis.MEASURED,
        {"roll_rate": "gyro_rad[0]", "pitch_rate": "gyro_rad[1]", "yaw_rate": "gyro_rad[2]"},
    ),
    Topic(
        "vehicle_acceleration",
        Basis.MEASURED,
        {"forward_acceleration": "xyz[0]", "lateral_acceleration": "xyz[1]", "vertical_acceleration": "xyz[2]"},
    ),
    Topic(
        "sensor_combined",
        Basis.MEASURED,
        {
            "forward_acceleration": "accelerometer_m_s2[0]",
            "lateral_acceleration": "accelerometer_m_s2[1]",
            "vertical_acceleration": "accelerometer_m_s2[2]",
        },
    ),
    Topic(
        "vehicle_rates_setpoint",
        Basis.COMMANDED,
        {"roll_rate_command": "roll", "pitch_rate_command": "pitch", "yaw_rate_command": "yaw"},
    ),
    Topic("vehicle_thrust_setpoint", Basis.COMMANDED, {"throttle": "xyz[0]"}),
    Topic("actuator_controls_0", Basis.COMMANDED, {"throttle": "control[3]"}),
    Topic("tecs_status", Basis.COMMANDED, {"airspeed_command": "true_airspeed_sp"}),
    Topic("tecs_status", Basis.COMMANDED, {"airspeed_command": "airspeed_sp"}),
)
_STATUS, _TECS, _LAND = "vehicle_status", "tecs_status", "vehicle_land_detected"
# Modes of `nav_state` that a fixed-wing aircraft flies in.
_MODES: Mapping[int, str] = MappingProxyType(
    {0: "manual", 1: "altitude", 2: "position", 3: "mission", 4: "loiter", 5: "return", 8: "stabilised (old)",
     10: "acro", 14: "offboard", 15: "stabilised", 17: "take-off", 18: "land"}
)  # fmt: skip


class _Bounded:
    """A file that bounds reading: it may be read `_MOST_READ` times over, since pyulog may loop in a damaged file."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("rb")
        self._left = _MOST_READ * path.stat().st_size + 1000
        self.seek, self.tell, self.close = self._file.seek, self._file.tell, self._file.close

    def read(self, size: int) -> bytes:
        content = self._file.read(size)
        self._left -= len(content) + 1
        if self._left < 0:
            raise LogError("its definitions lead in circles")
        return content


class _Rows(bytearray):
    """The rows of a topic: all of them, of more than `2 MOST` every second, and so on."""

    def __init__(self, size: int) -> None:
        super().__init__()
        self.size, self.seen, self.step = size, 0, 1

    def __iadd__(self, row: Any) -> Self:  # type: ignore[misc]  # as of bytearray itself
        if self.seen % self.step == 0:
            self.extend(row)
        self.seen += 1
        if len(self) >= 2 * thinning.MOST * self.size:
            self[:] = np.frombuffer(bytes(self), np.dtype((np.void, self.size)))[::2].tobytes()
            self.step *= 2
        return self


def _parsed(file: _Bounded, names: Sequence[str]) -> tuple[Any, Mapping[int, _Rows]]:
    """The log of pyulog, which has all rows of a topic in one `_Rows`, by the topic's number."""
    rows: dict[int, _Rows] = {}

    def topic(*described: Any) -> Any:
        made = ULog._MessageAddLogged(*described)
        made.buffer = rows[made.msg_id] = _Rows(made.dtype.itemsize)
        return made

    return type("Log", (ULog,), {"_MessageAddLogged": staticmethod(topic)})(file, names), rows


def read_ulog(path: Path) -> RecordedFlight:
    """The flight of a ULog file. Raises `LogError`, and OSError."""
    names = [*{topic.name for topic in TOPICS}, _STATUS, _LAND]
    file = _Bounded(path)
    try:
        with redirect_stdout(io.StringIO()), np.errstate(all="ignore"):
            log, rows_of = _parsed(file, names)
    except Exception as error:  # a damaged file makes pyulog raise almost anything
        raise LogError(f"{path}: is no readable ULog: {' '.join(str(error).split()) or type(error).__name__}") from None
    finally:
        file.close()
    draft = Draft(path.name, [str(path)], "the autopilot's clock since its start")
    draft.vehicle = _vehicle(log)
    draft.parameters = {
        key: float(value) for key, value in log.initial_parameters.items() if isinstance(value, int | float)
    }
    _tell_damage(draft, log, path)
    data: dict[str, tuple[Array, Mapping[str, Array]]] = {}
    for one in log.data_list:
        if one.multi_id == min(d.multi_id for d in log.data_list if d.name == one.name) and "timestamp" in one.data:
            time = one.data["timestamp"].astype(float) * 1e-6
            rows = draft.in_order(time, f"{path.name}: {one.name}")
            data[one.name] = time[rows], _Ordered(one.data, rows)
            if (read := rows_of[one.msg_id]).step > 1:
                draft.problems.append(thinning.said(f"{path.name}: {one.name}", read.seen, read.step))
    for topic in TOPICS:
        if topic.name in data:
            _add(draft, topic, *data[topic.name])
    _add_altitude_command(draft, data)
    _add_events(draft, data)
    return draft.finished()


class _Ordered(Mapping[str, Array]):
    """The fields of a topic, each as numbers in the order of their times, converted at its first use."""

    def __init__(self, fields: Mapping[str, Array], rows: NDArray[np.intp]) -> None:
        self._fields, self._rows = fields, rows

    def __getitem__(self, name: str) -> Array:
        return self._fields[name][self._rows].astype(float)

    def __iter__(self) -> Iterator[str]:
        return iter(self._fields)

    def __len__(self) -> int:
        return len(self._fields)


def _add(draft: Draft, topic: Topic, time: Array, fields: Mapping[str, Array]) -> None:
    for name, what in topic.channels.items():
        if name in draft.channels:
            continue
        try:
            values = fields[what] if isinstance(what, str) else what(fields)
        except KeyError:  # this version of PX4 has another field
            continue
        if np.isfinite(values).any():
            draft.add(name, time, values, topic.basis, topic.name, topic.note)


def _add_altitude_command(draft: Draft, data: Mapping[str, tuple[Array, Mapping[str, Array]]]) -> None:
    """The commanded altitude is above sea level; the origin of the position lies `ref_alt` above it."""
    if _TECS not in data or "vehicle_local_position" not in data:
        return
    time, tecs = data[_TECS]
    reference = data["vehicle_local_position"][1].get("ref_alt")
    if "altitude_sp" in tecs and reference is not None and np.isfinite(reference).any():
        above = tecs["altitude_sp"].astype(float) - float(np.nanmedian(reference))
        draft.add("altitude_command", time, above, Basis.COMMANDED, _TECS)


def _add_events(draft: Draft, data: Mapping[str, tuple[Array, Mapping[str, Array]]]) -> None:
    if _STATUS in data:
        time, status = data[_STATUS]
        for k, state in _changes(status.get("nav_state")):
            draft.events.append(LoggedEvent(float(time[k]), f"mode {_MODES.get(state, state)}"))
        for k, failed in _changes(status.get("engine_failure")):
            if failed and draft.failure is None:
                draft.failure = LoggedEvent(float(time[k]), "the autopilot reports an engine failure")
    if _LAND in data:
        time, land = data[_LAND]
        for k, landed in _changes(land.get("landed")):
            draft.events.append(LoggedEvent(float(time[k]), "landed" if landed else "airborne"))


def _changes(values: Array | None) -> list[tuple[int, int]]:
    """The rows at which a state changes, the first too, and the state from then on."""
    if values is None or not len(values):
        return []
    return [(int(k), int(values[k])) for k in np.flatnonzero(np.append(True, np.diff(values.astype(float)) != 0.0))]


def _tell_damage(draft: Draft, log: Any, path: Path) -> None:
    if log.dropouts:
        lost = [dropout.duration * 1e-3 for dropout in log.dropouts]
        times = f"{math.fsum(lost):.2f} s in all, the longest {max(lost):.2f} s"
        draft.problems.append(f"{path.name}: {len(lost)} dropouts of the logger, {times}: nothing is known of them")
    if log.file_corruption:
        draft.problems.append(f"{path.name}: is damaged; what can be read of it is used")


def _vehicle(log: Any) -> str:
    name, version = (str(log.msg_info_dict.get(key, "")) for key in ("sys_name", "ver_sw_branch"))
    return " ".join(filter(None, (name, version)))
