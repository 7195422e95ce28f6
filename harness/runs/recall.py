"""Flying a stored row again, also when the files that it was flown with have changed or are gone."""

import atexit
import json
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import aircraft
from harness.files import content_hash, read
from harness.flight import Flight
from harness.key import version_of
from harness.log import FlightLog
from harness.runs import apart
from harness.runs.journal import StoreError, reading
from harness.runs.row import FlightResult, result_of
from harness.runs.store import Stored, content, examples, find
from harness.settings import SettingsError, SettingsFile, flight_from_document, overridden, without_former_names
from harness.settings.law_source import FILES
from harness.settings.laws import is_unchanged
from harness.toml_text import shortened

_LONGEST = 250  # bytes of a name, without its ending


class RowAddress(NamedTuple):
    """`DIR:KEY`: a row of an earlier run, by the beginning of its key."""

    folder: Path
    beginning: str


def row_address(text: str) -> RowAddress | None:
    """The row that an argument of the command line names; None when it names something else."""
    folder, colon, key = text.rpartition(":")
    if not colon or Path(text).exists() or not Path(folder).is_dir():
        return None
    return RowAddress(Path(folder), key.strip().lower())


@dataclass(frozen=True, slots=True)
class Recalled:
    """A stored row, and the flight that flies it again now."""

    stored: Stored
    settings: Mapping[str, Any]  # a [flight] table; changed or missing files are replaced by stored copies
    flight: Flight
    changed: tuple[str, ...]  # names of everything that has changed since the row was flown

    @property
    def digest(self) -> str:
        """The digest of the row; empty when the flight failed without a log."""
        return str(self.stored.row["digest"])

    @property
    def changes(self) -> str:
        """The changes since the row was flown, in words."""
        return f"changed since: {', '.join(self.changed)}" if self.changed else "although nothing known has changed"

    def file(self, name: str, overrides: Sequence[str] = ()) -> SettingsFile:
        """The row as a settings file of this name, with overrides KEY=VALUE. Raises `SettingsError`."""
        return overridden(SettingsFile(Path(name), "", {"flight": dict(self.settings)}, {}, {}), overrides)


def recall(place: RowAddress) -> Recalled:
    """The row and its flight; files that changed or are gone are taken from the store. Raises `StoreError`."""
    stored = find(*place)
    settings = without_former_names(stored.row["flight"])  # a copy
    then: Mapping[str, str] = stored.version["content"]
    match settings:
        case {"target": {"track": str(track)}} if _hash(Path(track)) != then.get("target/track"):
            name = _last_name(place.folder, "target.track", track)
            settings["target"]["track"] = str(_unpacked(place.folder, {name: then.get("target/track", "")}) / name)
    match settings:
        case {"aircraft": str(name)}:
            settings["aircraft"] = _airframe(place.folder, name, then)
    try:
        is_unchanged(settings, then)
        flight = flight_from_document(settings)
    except SettingsError as error:
        raise StoreError(f"{place.folder}: the flight {stored.row['key']} cannot be flown again: {error}") from None
    return Recalled(stored, settings, flight, tuple(_changed(stored.version, version_of(flight).decides)))


def load_laws(folder: Path) -> None:
    """Loads the user-defined laws that the rows name, but for those that have changed or are gone. `StoreError`."""
    with reading(folder) as journal:
        rows = journal.execute(
            "SELECT DISTINCT json_extract(f.settings, '$.law.name'), v.decides FROM flights f "
            "JOIN versions v ON v.id = f.version WHERE v.decides LIKE ?",
            (f'%"{FILES}%',),
        ).fetchall()
        for name, decides in rows:
            with suppress(SettingsError):
                is_unchanged({"law": {"name": name}}, json.loads(decides)["content"])


def other_versions(folder: Path) -> dict[str, list[str]]:
    """By the number of each version in the store that is not today's: the names of everything that has changed since.

    A file that is gone has changed.
    """
    others = {}
    with reading(folder) as journal:
        for number, decides, settings in examples(journal):
            try:
                is_unchanged(settings, decides["content"])
                now = version_of(flight_from_document(without_former_names(settings))).decides
            except (SettingsError, OSError) as error:
                others[number] = [str(error)]
                continue
            if changed := list(_changed(decides, now)):
                others[number] = changed
    return others


def _changed(then: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    """The names of what two versions differ in; of libraries and counters with both."""
    before, after = _by_name(then), _by_name(now)
    for name in {**before, **after}:
        if before.get(name) != after.get(name):
            is_file = name in then["content"] or name in now["content"]
            yield name if is_file else f"{name} {before.get(name, 'none')} (here {after.get(name, 'none')})"


def _by_name(version: Mapping[str, Any]) -> dict[str, object]:
    flat: dict[str, object] = {}
    for name, value in version.items():
        flat |= value if isinstance(value, dict) else {} if value is None else {name: value}
    return flat


class Reflown(NamedTuple):
    """The log of a row's flight, flown now."""

    log: FlightLog
    deviation: str  # the largest one from the row, in words; empty when they agree to the last bit


def fly_again(recalled: Recalled) -> Reflown:
    """Flies the row's flight and compares it with the row. Raises ValueError when it cannot start."""
    log = apart.fly(recalled.flight)
    return Reflown(log, deviation(recalled.stored, result_of(log)))


def deviation(stored: Stored, now: FlightResult) -> str:
    """How a flight deviates from the row, in words: at its end, and in the metric that differs most; empty if equal."""
    then = stored.row
    if then["digest"] == now.digest:
        return ""
    if then["outcome"] != now.outcome:
        return f"the outcome was {then['outcome']}, is {now.outcome}"
    sentences = []
    apart = {name: abs(now.final[name] - x) for name, x in stored.final.items() if name in now.final}
    if largest := max(apart, key=lambda name: apart[name] / (1.0 + abs(stored.final[name])), default=None):
        sentences.append(f"{largest} at the end differs by {apart[largest]:.3g} (SI)")
    moved = {}
    for name, before in then["metrics"].items():
        after = now.metrics.get(name)
        if before is not None and after is not None and before != after:
            moved[name] = (abs(after - before) / (abs(after) + abs(before)), before, after)
    if moved:
        name, (_, before, after) = max(moved.items(), key=lambda item: item[1])
        sentences.append(f"{name} was {before:.6g}, is {after:.6g}")
    return ", ".join(sentences) or "during the flight, not at its end"


def _airframe(folder: Path, name: str, then: Mapping[str, str]) -> str:
    """The airframe of the row: its name while its files are unchanged, otherwise a folder unpacked from the store."""
    kept = {n.removeprefix("aircraft/"): digest for n, digest in then.items() if n.startswith("aircraft/")}
    try:
        now = aircraft.folder(name)
    except OSError:
        if not kept:
            return aircraft.names()[0]  # the flight had no airframe: any will do
    else:
        paths = {n: _file_of(now, n) for n in kept}
        if all(_hash(path) == kept[n] for n, path in paths.items()):
            return name
    base = _last_name(folder, "aircraft", name)
    unpacked = _unpacked(folder, {f"{base}.xml" if n == "model" else n: d for n, d in kept.items()}, base)
    if aircraft.RECORDED in kept:
        return str(unpacked / aircraft.RECORDED)
    with suppress(aircraft.AirframeError):  # its files say what is wrong with them when they are read
        aircraft.keep_written(unpacked)
    return str(unpacked)


def _file_of(airframe: Path, name: str) -> Path:
    """The file of an airframe that a store knows by this name."""
    if name == aircraft.RECORDED:
        return airframe
    return aircraft.model(airframe) if name == "model" else airframe / name


def _unpacked(folder: Path, files: Mapping[str, str], base: str = "files") -> Path:
    """A temporary folder named `base` with these files of the store; it is removed when this process ends."""
    temporary = tempfile.mkdtemp(prefix="standoff-harness-")
    atexit.register(shutil.rmtree, temporary, ignore_errors=True)
    unpacked = Path(temporary) / base
    unpacked.mkdir()
    for name, digest in files.items():
        (unpacked / Path(name).name).write_bytes(content(folder, digest))  # a foreign name leads nowhere else
    return unpacked


def _last_name(folder: Path, key: str, path: str) -> str:
    """The name at the end of a path that a row has. Raises `StoreError` where no file can have it."""
    name = Path(path).name
    if name in ("", "..") or "\0" in path or len(name.encode(errors="replace")) > _LONGEST:
        raise StoreError(f"{folder}: a flight has {key} = {shortened(path)!r}, which is no path of a file or a folder")
    return name


def _hash(path: Path) -> str | None:
    try:
        return content_hash(read(path))
    except (OSError, ValueError):  # the latter of what is no path
        return None
