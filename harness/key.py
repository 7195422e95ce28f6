"""The key of a flight: a hash of its settings and of the content of everything else that decides it."""

import hashlib
import json
from collections.abc import Iterator
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path

import aircraft
import autopilot
from harness.flight import Flight
from harness.settings import document

PHYSICS = 1  # of the plants, the wind and the loop: raised whenever a change there moves a trajectory


def flight_key(flight: Flight) -> str:
    """32 hex digits, equal exactly when the same flight would be flown."""
    settings = document(flight)
    if flight.target.track is not None:
        settings["target"]["track"] = "content"  # counts, not where it lies
    decides = {
        "settings": settings,
        "physics": PHYSICS,
        "content": {name: _digest(path, path.stat().st_mtime_ns) for name, path in _files(flight)},
        "jsbsim": version("jsbsim") if flight.plant == "sixdof" else None,
        "filterpy": version("filterpy") if flight.estimator.kind == "ekf" else None,
    }
    canonical = json.dumps(decides, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.blake2b(canonical.encode(), digest_size=16).hexdigest()


def _files(flight: Flight) -> Iterator[tuple[str, Path]]:
    on_board = Path(autopilot.__file__).parent
    for path in sorted(on_board.glob("*.py")):
        yield f"autopilot/{path.name}", path
    if flight.target.track is not None:
        yield "target/track", Path(flight.target.track)
    if flight.plant == "sixdof":
        yield "autopilot/inner_loop.xml", on_board / "inner_loop.xml"
        yield "harness/plants/planet.xml", Path(__file__).parent / "plants" / "planet.xml"
        airframe = aircraft.folder(flight.aircraft)
        yield "aircraft/model", aircraft.model(airframe)
        yield "aircraft/airframe.toml", airframe / "airframe.toml"


@lru_cache(maxsize=256)
def _digest(path: Path, modified: int) -> str:
    return hashlib.blake2b(path.read_bytes(), digest_size=16).hexdigest()
