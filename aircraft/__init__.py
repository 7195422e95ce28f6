"""Where the airframes are: one folder each, with a JSBSim model and the data it was written from."""

import tomllib
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent


def names() -> list[str]:
    """The airframes that come with the harness."""
    return sorted(data.parent.name for data in FOLDER.glob("*/airframe.toml"))


def folder(name: str) -> Path:
    """The folder of an airframe: one of `names()`, or a path to a folder laid out alike. Else FileNotFoundError."""
    for candidate in (FOLDER / name, Path(name)):
        if (candidate / "airframe.toml").is_file() and model(candidate).is_file():
            return candidate.resolve()
    raise FileNotFoundError(f"no airframe {name!r}: needs airframe.toml and a JSBSim model named as its folder")


def model(airframe: Path) -> Path:
    """The JSBSim model in an airframe's folder."""
    return airframe / f"{airframe.name}.xml"


def data(airframe: Path) -> dict[str, Any]:
    """An airframe's published data; SI, rad; each number with its source."""
    return tomllib.loads((airframe / "airframe.toml").read_text(encoding="utf-8"))


def inner_loop(airframe: Path) -> dict[str, Any]:
    """The gains and limits of an airframe's inner loop."""
    return tomllib.loads((airframe / "inner_loop.toml").read_text(encoding="utf-8"))


def bank_limit(airframe: Path) -> float:
    """The largest bank that the inner loop commands, rad."""
    return float(inner_loop(airframe)["limit"]["bank-rad"]["v"])
