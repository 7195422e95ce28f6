"""The airframes: one folder each, with a JSBSim model and the data from which it was written."""

import tomllib
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

FOLDER = Path(__file__).parent


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
    """The folder of an airframe, by its name or by a path to a folder with the same files. Else FileNotFoundError."""
    for candidate in (FOLDER / name, Path(name)):
        if (candidate / "airframe.toml").is_file() and model(candidate).is_file():
            return candidate.resolve()
    raise FileNotFoundError(f"no airframe {name!r}: needs airframe.toml and a JSBSim model named as its folder")


def is_folder(name: str | Path) -> bool:
    """Whether it is the path of a folder; False also for text that cannot be a path (too long, or with a null)."""
    try:
        return Path(name).is_dir()
    except (OSError, ValueError):
        return False


def model(airframe: Path) -> Path:
    """The path of the JSBSim model in the folder of an airframe."""
    return airframe / f"{airframe.name}.xml"


def identified(airframe: Path) -> Path:
    """The path of the file in which `harness identify` keeps its results for an airframe."""
    return airframe / "identified.toml"


def data(airframe: Path) -> dict[str, Any]:
    """The published data of an airframe; SI, rad; each number with its source. Raises `AirframeError`."""
    return _read(airframe / "airframe.toml")


def inner_loop(airframe: Path) -> dict[str, Any]:
    """The gains and limits of an airframe's inner loop. Raises `AirframeError`."""
    return _read(airframe / "inner_loop.toml")


def limits(airframe: Path) -> Limits:
    """The limits of an airframe. Raises `AirframeError` when its files lack one."""
    published, loop = _numbers(airframe / "airframe.toml"), _numbers(airframe / "inner_loop.toml")
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


def _read(file: Path) -> dict[str, Any]:
    try:
        if file.exists() and not file.is_file():
            raise AirframeError(f"{file}: must be a file")
        return _parsed(file.read_text(encoding="utf-8"))
    except AirframeError:
        raise
    except OSError as error:
        raise AirframeError(f"{file}: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise AirframeError(f"{file}: not valid TOML: {error}") from None


@lru_cache(maxsize=16)
def _parsed(text: str) -> dict[str, Any]:
    return tomllib.loads(text)
