"""A row flown again: from what the store holds, although the files that it was flown with may be gone."""

import atexit
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import aircraft
from harness.flight import Flight
from harness.key import content_hash, version_of
from harness.log import FlightLog
from harness.loop import simulate
from harness.runs.row import FlightResult, result_of
from harness.runs.store import Stored, content, find
from harness.settings import SettingsFile, flight_from_document, overridden, without_former_names


class RowAddress(NamedTuple):
    """`DIR:KEY`: a row of an earlier run, by the beginning of its key."""

    folder: Path
    beginning: str


def row_address(text: str) -> RowAddress | None:
    """The row that a word of the command line names; None when it names something else."""
    folder, colon, key = text.rpartition(":")
    if not colon or Path(text).exists() or not Path(folder).is_dir():
        return None
    return RowAddress(Path(folder), key.strip().lower())


@dataclass(frozen=True, slots=True)
class Recalled:
    """A row, and its settings as they can be flown now."""

    stored: Stored
    settings: Mapping[str, Any]  # a [flight] table; what is gone or has changed is replaced by unpacked copies
    flight: Flight
    changed: tuple[str, ...]  # what is not as it was when the row was flown

    @property
    def digest(self) -> str:
        """That of the row; empty when it failed without a log."""
        return str(self.stored.row["digest"])

    def file(self, name: str, overrides: Sequence[str] = ()) -> SettingsFile:
        """The row as a settings file of that name, with overrides. Raises `SettingsError`."""
        return overridden(SettingsFile(Path(name), {"flight": dict(self.settings)}, {}, {}), overrides)


def recall(place: RowAddress) -> Recalled:
    """The row and its flight. Files that are gone or have changed come from the store. Raises `StoreError`."""
    stored = find(*place)
    settings = without_former_names(stored.row["flight"])  # a copy
    then: Mapping[str, str] = stored.version["content"]
    track = settings["target"]["track"]
    if track is not None and _hash(Path(track)) != then["target/track"]:
        name = Path(track).name
        settings["target"]["track"] = str(_unpacked(place.folder, {name: then["target/track"]}) / name)
    settings["aircraft"] = _airframe(place.folder, settings["aircraft"], then)
    flight = flight_from_document(settings)
    now = version_of(flight).decides
    changed = [name for name, digest in then.items() if now["content"].get(name) != digest]
    changed += [name for name in now["content"] if name not in then]
    changed += [name for name, value in now.items() if name != "content" and value != stored.version.get(name)]
    return Recalled(stored, settings, flight, tuple(changed))


class Again(NamedTuple):
    """A row's flight, flown now."""

    log: FlightLog
    deviation: str  # from the row: the largest, in words; empty when they are equal to the last bit


def fly_again(recalled: Recalled) -> Again:
    """Flies the row's flight and compares. ValueError when it cannot start."""
    log = simulate(recalled.flight)
    return Again(log, deviation(recalled.stored, result_of(log)))


def deviation(stored: Stored, now: FlightResult) -> str:
    """By how much a flight is not the row's, in words: at its end, and in the metric that differs most."""
    then = stored.row
    if then["digest"] == now.digest:
        return ""
    if then["outcome"] != now.outcome:
        return f"it was {then['outcome']}, it is {now.outcome}"
    said = []
    apart = {name: abs(now.final[name] - x) for name, x in stored.final.items() if name in now.final}
    if largest := max(apart, key=lambda name: apart[name] / (1.0 + abs(stored.final[name])), default=None):
        said.append(f"{largest} at the end is {apart[largest]:.3g} off (SI)")
    moved = {}
    for name, before in then["metrics"].items():
        after = now.metrics.get(name)
        if before is not None and after is not None and before != after:
            moved[name] = (abs(after - before) / (abs(after) + abs(before)), before, after)
    if moved:
        name, (_, before, after) = max(moved.items(), key=lambda item: item[1])
        said.append(f"{name} was {before:.6g}, is {after:.6g}")
    return ", ".join(said) or "within the flight, not at its end"


def _airframe(folder: Path, name: str, then: Mapping[str, str]) -> str:
    """The airframe of the row: by its name while its files are the same, else a folder unpacked from the store."""
    kept = {n.removeprefix("aircraft/"): digest for n, digest in then.items() if n.startswith("aircraft/")}
    try:
        now = aircraft.folder(name)
    except OSError:
        if not kept:
            return aircraft.names()[0]  # the flight had none
    else:
        paths = {n: aircraft.model(now) if n == "model" else now / n for n in kept}
        if all(_hash(path) == kept[n] for n, path in paths.items()):
            return name
    called = Path(name).name
    return str(_unpacked(folder, {f"{called}.xml" if n == "model" else n: d for n, d in kept.items()}, called))


def _unpacked(folder: Path, files: Mapping[str, str], called: str = "files") -> Path:
    """A temporary folder with these files of the store, until this process ends."""
    temporary = tempfile.mkdtemp(prefix="standoff-harness-")
    atexit.register(shutil.rmtree, temporary, ignore_errors=True)
    unpacked = Path(temporary) / called
    unpacked.mkdir()
    for name, digest in files.items():
        (unpacked / name).write_bytes(content(folder, digest))
    return unpacked


def _hash(path: Path) -> str | None:
    try:
        return content_hash(path.read_bytes())
    except OSError:
        return None
