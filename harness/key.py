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
from autopilot.estimator import ESTIMATORS
from autopilot.guidance import uses_response
from harness.files import content_hash, read
from harness.flight import Flight
from harness.plants.ladder import PLANTS, identification_files
from harness.settings import document
from harness.settings.laws import source_of

PHYSICS_VERSION = 4  # of plants, wind and loop: raised whenever a change there moves a trajectory
METRICS_VERSION = 7  # of the metrics: raised whenever a change moves the value of one


class Version(NamedTuple):
    """Everything that decides a flight and its metrics, besides its settings."""

    number: str  # a hash of `decides`
    decides: Mapping[str, Any]  # versions of physics, metrics and libraries, and a hash of each file's content


class Identity(NamedTuple):
    """A flight's key, and what it is a hash of."""

    key: str  # a hash of settings and version
    settings: Mapping[str, Any]  # a [flight] table in file units
    version: Version


def identity(flight: Flight) -> Identity:
    """The key of a flight with its settings and version. Raises OSError when a file that it reads is missing."""
    settings, version = document(flight), version_of(flight)
    hashed_settings = dict(settings)  # of a file or a folder its content counts, not its path
    if settings["target"]["track"] is not None:
        hashed_settings["target"] = {**settings["target"], "track": "content"}
    if own := source_of(flight.law):
        hashed_settings["law"] = {**settings["law"], "name": f"{own.main.name}:{own.class_name}"}
    if flight.aircraft not in aircraft.names():
        hashed_settings["aircraft"] = _of_folder(flight.aircraft)
    return Identity(hashed({"settings": hashed_settings, "version": version.number}), settings, version)


def _of_folder(airframe: str) -> dict[str, str]:
    """The identity of an airframe's folder, independent of its place; only its name if it is missing."""
    try:
        folder = aircraft.folder(airframe)
        data = folder if aircraft.is_recorded(folder) else folder / "airframe.toml"
        return {"name": folder.name, "data": content_hash(read(data))}
    except OSError:
        return {"name": Path(airframe).name}


def version_of(flight: Flight) -> Version:
    """Everything besides the settings that decides the flight, as it is now. Raises OSError when a file is missing."""
    libraries = {
        "plant": PLANTS[flight.plant].libraries,
        "turbulence": ("numpy", "scipy") if flight.wind.turbulence != "none" else (),
        "estimator": ESTIMATORS[flight.estimator.kind].libraries,
    }
    own = source_of(flight.law)
    content = {**_ON_BOARD, **(own.hashes if own else {}), **_hashes(_read(flight))}
    return _version(PHYSICS_VERSION, METRICS_VERSION, tuple(content.items()), tuple(libraries.items()))


def flight_key(flight: Flight) -> str:
    """32 hex digits, equal exactly for flights that have the same trajectory and the same metrics."""
    return identity(flight).key


def files(flight: Flight) -> dict[str, Path]:
    """The path of every file whose content decides the flight, by a name for its purpose, such as `target/track`."""
    own = source_of(flight.law)
    return {**_PYTHON, **(own.files if own else {}), **_read(flight)}


def _read(flight: Flight) -> dict[str, Path]:
    """The files that are read anew for each flight."""
    paths = {} if flight.target.track is None else {"target/track": Path(flight.target.track)}
    kind = PLANTS[flight.plant]
    if kind.has_airframe:
        paths |= kind.files(aircraft.folder(flight.aircraft))
    if uses_response(flight.law):
        paths |= identification_files(aircraft.folder(flight.aircraft))
    return paths


@lru_cache(maxsize=256)
def _version(
    physics: int,
    metrics: int,
    content: tuple[tuple[str, str], ...],
    libraries: tuple[tuple[str, tuple[str, ...]], ...],
) -> Version:
    """The version, from the hash of each file by its name, and the libraries by purpose."""
    decides = {
        "physics": physics,
        "metrics": metrics,
        "content": dict(content),
        **{purpose: {name: version(name) for name in names} or None for purpose, names in libraries},
    }
    return Version(hashed(decides), decides)


def hashed(content: object) -> str:
    """A hash, 32 hex digits, of a value that JSON can hold; the order of keys does not matter."""
    canonical = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.blake2b(canonical.encode(), digest_size=16).hexdigest()


def _hashes(files: Mapping[str, Path]) -> dict[str, str]:
    return {name: content_hash(read(path)) for name, path in files.items()}


# The laws and estimators as imported: what this process flies, whatever the files are edited to later.
_PYTHON = {f"autopilot/{path.name}": path for path in sorted(Path(autopilot.__file__).parent.glob("*.py"))}
_ON_BOARD = _hashes(_PYTHON)
