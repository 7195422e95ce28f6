"""The key of a flight: a hash of its settings and of the content of everything else that decides it."""

import hashlib
import json
from collections.abc import Mapping
from functools import cache, lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import aircraft
import autopilot
from harness.flight import IDENTIFIED_PLANTS, Flight
from harness.settings import document

PHYSICS = 1  # of the plants, the wind and the loop: raised whenever a change there moves a trajectory
METRICS = 1  # of what a log is judged by: raised whenever a change there moves a metric


class Identity(NamedTuple):
    """What makes a flight this one."""

    settings: Mapping[str, Any]  # a [flight] table in file units
    version: Mapping[str, Any]  # all else: of the physics, of the libraries, and a hash of each file's content

    @property
    def key(self) -> str:
        settings = self.settings
        if settings["target"]["track"] is not None:  # its content counts, not where it lies
            settings = {**settings, "target": {**settings["target"], "track": "content"}}
        return hashed({"settings": settings, **self.version})


def identity(flight: Flight) -> Identity:
    """What makes the flight this one. OSError when a file that it reads is gone."""
    return Identity(document(flight), version_of(flight))


def version_of(flight: Flight) -> dict[str, Any]:
    """All that decides the flight beside its settings, as it is now."""
    return {
        "physics": PHYSICS,
        "metrics": METRICS,
        "content": {name: _digest(path, path.stat().st_mtime_ns) for name, path in files(flight).items()},
        "jsbsim": _installed("jsbsim") if flight.plant == "sixdof" else None,
        "turbulence": [_installed("numpy"), _installed("scipy")] if flight.wind.turbulence != "none" else None,
        "filterpy": _installed("filterpy") if flight.estimator.kind == "ekf" else None,
    }


def flight_key(flight: Flight) -> str:
    """32 hex digits, equal exactly when the same flight would be flown, and judged alike."""
    return identity(flight).key


def files(flight: Flight) -> dict[str, Path]:
    """Every file whose content decides the flight, by a name that says what it is for."""
    on_board = Path(autopilot.__file__).parent
    found = {f"autopilot/{name}": on_board / name for name in _sources(on_board)}
    if flight.target.track is not None:
        found["target/track"] = Path(flight.target.track)
    if flight.plant == "sixdof":
        found["autopilot/inner_loop.xml"] = on_board / "inner_loop.xml"
        found["harness/plants/planet.xml"] = Path(__file__).parent / "plants" / "planet.xml"
    if flight.plant != "kinematic":
        airframe = aircraft.folder(flight.aircraft)
        found["aircraft/model"] = aircraft.model(airframe)
        names = ["airframe.toml", "inner_loop.toml"]
        if flight.plant in IDENTIFIED_PLANTS:
            names.append(aircraft.identified(airframe).name)
        found |= {f"aircraft/{name}": airframe / name for name in names}
    return found


def hashed(content: object) -> str:
    """32 hex digits of what JSON can hold, whatever the order of its keys."""
    canonical = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.blake2b(canonical.encode(), digest_size=16).hexdigest()


def content_hash(content: bytes) -> str:
    """32 hex digits of a file's content."""
    return hashlib.blake2b(content, digest_size=16).hexdigest()


@cache
def _sources(on_board: Path) -> tuple[str, ...]:
    """The Python files of the autopilot: a process runs those that it found when it began."""
    return tuple(sorted(path.name for path in on_board.glob("*.py")))


_installed = cache(version)


@lru_cache(maxsize=256)
def _digest(path: Path, modified: int) -> str:
    return content_hash(path.read_bytes())
