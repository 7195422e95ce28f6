"""The airframes: one folder each, with a JSBSim model and the data from which it was written.

The aircraft of a recorded flight is a file with the response fitted to its log, without a 6-DOF model.
"""

import hashlib
import json
import math
import re
import tomllib
from collections.abc import Callable
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, NamedTuple

FOLDER = Path(__file__).parent
RECORDED = "recorded.toml"  # how a store names the aircraft of a recorded flight


class AirframeError(ValueError):
    """A mistake in the files of an airframe, in one line: `FILE: what is wrong`."""


class Limits(NamedTuple):
    """The limits of an airframe. SI, rad."""

    slowest: float  # airspeed
    design_airspeed: float
    fastest: float  # airspeed
    stall: float  # angle of attack
    bank: float  # the largest bank that its inner loop commands


def names() -> list[str]:
    """The names of the airframes that are shipped with the harness."""
    return sorted(data.parent.name for data in FOLDER.glob("*/airframe.toml"))


def folder(name: str) -> Path:
    """The folder of an airframe, by its name or by a path to a folder with the same files. Else FileNotFoundError.

    For the aircraft of a recorded flight it is the file.
    """
    if name in _shipped():
        return _shipped()[name]
    path = Path(name)
    if is_recorded(name) or ((path / "airframe.toml").is_file() and model(path).is_file()):
        return path.resolve()
    raise FileNotFoundError(f"no airframe {name!r}: needs airframe.toml and a JSBSim model named as its folder")


@cache  # called for every flight
def _shipped() -> dict[str, Path]:
    """The folders of the airframes that are shipped with the harness, by name."""
    return {name: (FOLDER / name).resolve() for name in names()}


def is_folder(name: str | Path) -> bool:
    """Whether it is the path of a folder; False also for text that cannot be a path (too long, or with a null)."""
    try:
        return Path(name).is_dir()
    except (OSError, ValueError):
        return False


def is_recorded(name: str | Path) -> bool:
    """Whether it is the path of a file, with the aircraft of a recorded flight; False for text that is no path."""
    try:
        return str(name).endswith(".toml") and Path(name).suffix == ".toml" and Path(name).is_file()
    except (OSError, ValueError):
        return False


def model(airframe: Path) -> Path:
    """The path of the JSBSim model in the folder of an airframe."""
    return airframe / f"{airframe.name}.xml"


def identified(airframe: Path) -> Path:
    """The path of the file in which `harness identify` keeps its results for an airframe."""
    return airframe if is_recorded(airframe) else airframe / "identified.toml"


def argument(airframe: Path) -> str:
    """The airframe as typed by a user: the name of a shipped one, otherwise its folder."""
    return airframe.name if airframe.parent == FOLDER else str(airframe)


def written(airframe: Path) -> Path:
    """The path of the file that records the data from which the model was written."""
    return airframe / "written.toml"


def keep_written(airframe: Path) -> None:
    """Records that the model matches the present data. Raises `AirframeError` and OSError."""
    about = "# Written with the model: a hash of airframe.toml and inner_loop.toml, so that changes are detected.\n"
    partial = written(airframe).with_suffix(".partial")
    partial.write_text(f'{about}data = "{_data_hash(airframe)}"\n', encoding="utf-8")
    partial.replace(written(airframe))


def is_stale(airframe: Path) -> bool:
    """Whether the data have changed since the model was written from them. Raises `AirframeError`.

    The model itself may be edited. Where nothing says from which data it was written, it is compared with the model
    that they make.
    """
    if is_recorded(airframe):
        return False
    files = (airframe / "airframe.toml", airframe / "inner_loop.toml", written(airframe), model(airframe))
    return _is_stale(airframe, tuple(map(_changed, files)))


def _changed(file: Path) -> tuple[int, int] | None:
    """When the file was changed, ns, and its size; None where there is none."""
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size


@lru_cache(maxsize=64)  # called for each flight of a run
def _is_stale(airframe: Path, changed: tuple[tuple[int, int] | None, ...]) -> bool:
    if written(airframe).is_file():
        return bool(_read(written(airframe)).get("data") != _data_hash(airframe))
    if adopted(airframe):
        return False
    from aircraft.write_models import jsbsim_model  # imported when used: no other airframe needs the template

    now = model(airframe).read_text(encoding="utf-8", errors="replace")
    return _nameless(now) != _nameless(jsbsim_model(airframe))


def _nameless(model: str) -> str:
    """The model without its name, for a folder may be renamed."""
    return re.sub('<fdm_config name="[^"]*"', "<fdm_config", model)


def _data_hash(airframe: Path) -> str:
    """A hash, 32 hex digits, of the data: of what they say, not of their comments."""
    texts = [_text(airframe / name) for name in ("airframe.toml", "inner_loop.toml")]
    try:
        return _hashed(*texts)
    except (ValueError, RecursionError):
        data(airframe), inner_loop(airframe)  # says which of them is no data
        raise


def data(airframe: Path) -> dict[str, Any]:
    """The published data of an airframe; SI, rad; each number with its source. Raises `AirframeError`."""
    return _read(airframe / "airframe.toml")


def adopted(airframe: Path) -> dict[str, Any] | None:
    """The adoption data of a third-party model; None for one of the harness's own airframes."""
    found = data(airframe).get("adopted")
    return found if isinstance(found, dict) else None


def adopted_lag(airframe: Path) -> float | None:
    """Lag of an adopted aircraft's bank behind its command, s; None for one of the harness's own airframes.

    Raises `AirframeError` where its data do not say.
    """
    if (found := adopted(airframe)) is None:
        return None
    loop = found.get("loop")
    lag = loop.get("lag") if isinstance(loop, dict) else None
    if not isinstance(lag, float | int) or not 0.0 < lag < math.inf:
        file = airframe / "airframe.toml"
        raise AirframeError(f"{file}: adopted.loop.lag must be a number above 0: run `harness adopt` again")
    return float(lag)


def inner_loop(airframe: Path) -> dict[str, Any]:
    """The gains and limits of an airframe's inner loop. Raises `AirframeError`."""
    return _read(airframe / "inner_loop.toml")


def limits(airframe: Path) -> Limits:
    """The limits of an airframe. Raises `AirframeError` when its files lack one."""
    if is_recorded(airframe):
        flown = {name: _recorded_limit(airframe, name) for name in Limits._fields if name != "stall"}
        return Limits(**flown, stall=math.inf)
    files = (airframe / "airframe.toml", airframe / "inner_loop.toml")
    return _limits(*files, tuple(map(_changed, files)))


@lru_cache(maxsize=64)  # called for each flight of a run
def _limits(data: Path, inner_loop: Path, changed: tuple[tuple[int, int] | None, ...]) -> Limits:
    published, loop = _numbers(data), _numbers(inner_loop)
    return Limits(
        slowest=published("envelope", "V_min"),
        design_airspeed=published("envelope", "V_design"),
        fastest=published("envelope", "V_max"),
        stall=published("aero", "alpha_stall"),
        bank=loop("limit", "bank-rad"),
    )


def _numbers(file: Path) -> Callable[..., float]:
    """A function that gives the value `v` of an entry of a file, by its keys."""
    table = _read(file)

    def number(*keys: str) -> float:
        value: Any = table
        for key in (*keys, "v"):
            value = value.get(key) if isinstance(value, dict) else None
        if not isinstance(value, float | int):
            raise AirframeError(f"{file}: {'.'.join(keys)}.v must be a number")
        return float(value)

    return number


def _recorded_limit(file: Path, name: str) -> float:
    table = _read(file).get("limits")
    value = table.get(name) if isinstance(table, dict) else None
    if isinstance(value, bool) or not isinstance(value, float | int) or not math.isfinite(value):
        raise AirframeError(f"{file}: limits.{name} must be a number: not a file written by harness assess --fit")
    return float(value)


def _read(file: Path) -> dict[str, Any]:
    text = _text(file)
    try:
        return _parsed(text)
    except (ValueError, RecursionError) as error:
        raise AirframeError(f"{file}: not valid TOML: {error}") from None


def _text(file: Path) -> str:
    try:
        if not file.is_file() and file.exists():
            raise AirframeError(f"{file}: must be a file")
        return file.read_text(encoding="utf-8")
    except OSError as error:
        raise AirframeError(f"{file}: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise AirframeError(f"{file}: not valid TOML: {error}") from None


@lru_cache(maxsize=16)
def _parsed(text: str) -> dict[str, Any]:
    return tomllib.loads(text)


@lru_cache(maxsize=16)
def _hashed(*texts: str) -> str:
    content = json.dumps([tomllib.loads(text) for text in texts], sort_keys=True, default=str)
    return hashlib.blake2b(content.encode(), digest_size=16).hexdigest()
