"""A settings file as it was read: what it says, and where; and the flight in it."""

import re
import sys
import tomllib
import warnings
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from pathlib import Path

import aircraft
from autopilot.laws import LAWS
from harness.checks import problems
from harness.error import SettingsError
from harness.flight import Flight
from harness.margins import Assess
from harness.settings.check import checked
from harness.settings.experiment import CUSTOM, Experiment, document_table
from harness.settings.former_names import without_former_names
from harness.settings.keys import file_key, put
from harness.settings.mistake import Mistake, Place, Places, settings_error
from harness.settings.table import Table, table_of
from harness.settings.toml_locator import Key, dotted, key_lines, nearest_line


@dataclass(frozen=True, slots=True)
class SettingsFile:
    """A file as it was read, not checked yet."""

    path: Path
    document: Mapping[str, object]  # in file units, overrides merged
    lines: Mapping[Key, int]
    overrides: Mapping[Key, str]  # the texts KEY=VALUE

    def flight(self) -> Flight:
        """The file's one flight. Raises `SettingsError`."""
        matrix = self.document.get("matrix")
        if matrix and isinstance(matrix, dict):
            raise SettingsError([f"{self._place(('matrix',)).text}: matrix: many flights, not one: use `harness run`"])
        return _flight(self.document, self._place, self.path.parent)

    def experiment(self) -> Experiment:
        """Everything in the file; what its tables hold stays unchecked. Raises `SettingsError`."""
        experiment = checked(table_of(Experiment), self.document, self._place)
        assert isinstance(experiment, Experiment)
        return experiment

    def assess(self) -> Assess:
        """The margins of the verdict alone, whatever else the file says. Raises `SettingsError`."""
        only = Table({"assess": table_of(Experiment).settings["assess"]}, dict, open=True)
        made = checked(only, self.document, self._place)
        assert isinstance(made, dict)
        assess = made.get("assess", Assess())
        assert isinstance(assess, Assess)
        return assess

    def locate(self, name: str) -> str:
        """Where a field is set, by its dotted name: `FILE:LINE: flight.start.airspeed_mps` for `start.airspeed`."""
        key = file_key(name)
        return f"{self._place(key).text}: {dotted(key)}"

    def warn(self, key: Key, message: str) -> None:
        """A FutureWarning that says where the key stands."""
        warnings.warn(f"{self._place(key).text}: {dotted(key)}: {message}", FutureWarning, stacklevel=2)

    def _place(self, key: Key) -> Place:
        for length in range(len(key), 0, -1):
            if key[:length] in self.overrides:
                return Place(sys.maxsize, f"--set {' '.join(self.overrides[key[:length]].split())}")
        line = nearest_line(self.lines, key)
        return Place(line, f"{self.path}:{line}")


def load_flight(path: str | Path, overrides: Sequence[str] = ()) -> Flight:
    """The flight that a settings file (TOML) describes.

    `overrides` are texts KEY=VALUE, keys dotted below [flight], in the file's units: degrees, where a key ends so.

    Raises `SettingsError` with every mistake, each with its line and what is allowed; also when it cannot be read.

    >>> flight = harness.load_flight("experiments/stationary.toml", ["plant=kinematic", "start.heading_deg=60"])
    """
    return read_settings(Path(path), overrides).flight()


def read_settings(path: Path, overrides: Sequence[str] = ()) -> SettingsFile:
    """A file with `overrides` merged into its [flight]. Raises `SettingsError` for a text that is no TOML."""
    return settings_from_text(_text(path), path, overrides)


def settings_from_text(text: str, path: Path, overrides: Sequence[str] = ()) -> SettingsFile:
    """The same of a file's text, as a store keeps it."""
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        what, _, at = str(error).rpartition(" (at ")
        told = re.match(r"line (\d+)", at)
        line = told[1] if told else text.count("\n") + 1  # "at end of document"
        raise SettingsError([f"{path}:{line}: no valid TOML: {what}"]) from None
    except (ValueError, RecursionError) as error:  # a number of too many digits, arrays too deep
        raise SettingsError([f"{path}: no valid TOML: {error}"]) from None
    return overridden(SettingsFile(path, document, key_lines(text), {}), overrides)


def overridden(file: SettingsFile, overrides: Sequence[str]) -> SettingsFile:
    """The file with the texts KEY=VALUE merged into its [flight]. Raises `SettingsError`."""
    document = deepcopy(dict(file.document))
    merged = dict(file.overrides)
    wrong = []
    for override in overrides:
        name, equals, value = override.partition("=")
        if not equals:
            wrong.append(f"--set {override}: must be KEY=VALUE, as in law.gains=paper_1")
            continue
        try:
            key = put(document, name, _parsed(value))
        except SettingsError as error:
            wrong.append(f"--set {override}: {error}")
            continue
        merged = {k: o for k, o in merged.items() if k[: len(key)] != key}  # what it replaces
        merged[key] = override
    if wrong:
        raise SettingsError(wrong)
    changed = replace(file, document=document, overrides=merged)
    return replace(changed, document=without_former_names(document, changed.warn))


def flight_from_document(document: Mapping[str, object], folder: Path = Path()) -> Flight:
    """The flight of a [flight] table in file units; paths of a track and an airframe are from `folder`.

    Raises `SettingsError`, its lines without a place.
    """
    return _flight({"flight": without_former_names(document)}, lambda key: Place(0, ""), folder)


def _text(path: Path) -> str:
    try:
        return path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise SettingsError([f"{path}: {error.strerror or error}"]) from None
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        raise SettingsError([f"{path}:{line}: no text in UTF-8"]) from None


def _parsed(value: str) -> object:
    try:
        return tomllib.loads(f"v = {value}")["v"]
    except ValueError:
        return value.strip()


def _flight(document: Mapping[str, object], place: Places, folder: Path) -> Flight:
    """The flight, checked whole. Paths of a track and of an airframe are from `folder`, where the settings are."""
    match document:
        case {"flight": {"law": {"name": str(name), **law}}} if name in LAWS:
            table = document_table(name, law.get("gains") == CUSTOM)
        case _:
            table = document_table(None, False)
    flight = checked(table, document, place)
    assert isinstance(flight, Flight)
    if flight.target.track is not None:
        track = str(folder.absolute() / flight.target.track)
        flight = replace(flight, target=replace(flight.target, track=track))
    beside = str(folder.absolute() / flight.aircraft)
    if flight.aircraft and aircraft.is_folder(beside) and flight.aircraft not in aircraft.names():
        flight = replace(flight, aircraft=beside)
    found = [Mistake(file_key(problem.name), problem.message) for problem in problems(flight)]
    if found:
        raise settings_error(found, place)
    return flight
