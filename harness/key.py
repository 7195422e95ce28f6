"""The key of a flight: a hash of its settings and of the content of everything else that decides it."""

import hashlib
import json
from collections.abc import Mapping
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import aircraft
import autopilot
from harness.flight import Flight
from harness.plants.ladder import PLANTS
from harness.settings import document

PHYSICS_VERSION = 3  # of the plants, the wind and the loop: raised whenever a change there moves a trajectory
METRICS_VERSION = 3  # of what a log is judged by: raised whenever a change there moves a metric


class Version(NamedTuple):
    """All that decides a flight, and how it is judged, beside its settings."""

    number: str  # a hash of it
    decides: Mapping[str, Any]  # of the physics, of the libraries, and a hash of each file's content


class Identity(NamedTuple):
    """What makes a flight this one."""

    key: str  # a hash of both
    settings: Mapping[str, Any]  # a [flight] table in file units
    version: Version


def identity(flight: Flight) -> Identity:
    """What makes the flight this one. OSError when a file that it reads is gone."""
    settings, version = document(flight), version_of(flight)
    hashed_ones = settings
    if settings["target"]["track"] is not None:  # its content counts, not where it lies
        hashed_ones = {**settings, "target": {**settings["target"], "track": "content"}}
    return Identity(hashed({"settings": hashed_ones, "version": version.number}), settings, version)


def version_of(flight: Flight) -> Version:
    """All that decides the flight beside its settings, as it is now. OSError when a file is gone."""
    libraries = {
        "plant": PLANTS[flight.plant].libraries,
        "turbulence": ("numpy", "scipy") if flight.wind.turbulence != "none" else (),
        "filterpy": ("filterpy",) if flight.estimator.kind == "ekf" else (),
    }
    paths = _paths(flight.plant, flight.aircraft, flight.target.track)
    changed = tuple((name, path, path.stat().st_mtime_ns) for name, path in paths)
    return _version(PHYSICS_VERSION, METRICS_VERSION, changed, tuple(libraries.items()))


def flight_key(flight: Flight) -> str:
    """32 hex digits, equal exactly when the same flight would be flown, and judged alike."""
    return identity(flight).key


def files(flight: Flight) -> dict[str, Path]:
    """Every file whose content decides the flight, by a name that says what it is for."""
    return dict(_paths(flight.plant, flight.aircraft, flight.target.track))


@lru_cache(maxsize=256)
def _paths(plant: str, name: str, track: str | None) -> tuple[tuple[str, Path], ...]:
    on_board = Path(autopilot.__file__).parent
    found = {f"autopilot/{path.name}": path for path in sorted(on_board.glob("*.py"))}
    if track is not None:
        found["target/track"] = Path(track)
    kind = PLANTS[plant]
    if kind.has_airframe:
        found |= kind.files(aircraft.folder(name))
    return tuple(found.items())


@lru_cache(maxsize=256)
def _version(
    physics: int,
    metrics: int,
    files: tuple[tuple[str, Path, int], ...],
    libraries: tuple[tuple[str, tuple[str, ...]], ...],
) -> Version:
    """Of files by name, path and time of change, and of the libraries for each purpose."""
    decides = {
        "physics": physics,
        "metrics": metrics,
        "content": {name: content_hash(path.read_bytes()) for name, path, _ in files},
        **{purpose: {name: version(name) for name in names} or None for purpose, names in libraries},
    }
    return Version(hashed(decides), decides)


def hashed(content: object) -> str:
    """32 hex digits of what JSON can hold, whatever the order of its keys."""
    canonical = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.blake2b(canonical.encode(), digest_size=16).hexdigest()


def content_hash(content: bytes) -> str:
    """32 hex digits of a file's content."""
    return hashlib.blake2b(content, digest_size=16).hexdigest()
