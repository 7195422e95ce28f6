"""A settings file: its content, the line of each key, and the flight that it describes."""

import re
import sys
import tomllib
import warnings
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import aircraft
from autopilot.laws import LAWS
from autopilot.rules import RuleError
from autopilot.standoff import StandoffLaw
from harness.checks import problems, start_problems
from harness.error import SettingsError
from harness.files import file_name
from harness.flight import Flight
from harness.margins import Assess
from harness.settings.check import Checked, check, checked
from harness.settings.experiment import CUSTOM, Experiment, document_table, without_law
from harness.settings.former_names import without_former_names
from harness.settings.gains import by_rule
from harness.settings.keys import file_key, put
from harness.settings.law_source import LawError
from harness.settings.laws import absolute, is_own, kind_of
from harness.settings.mended import concerns, mended
from harness.settings.mistake import Mistake, Place, Places, settings_error
from harness.settings.speed import at_own_speed
from harness.settings.table import TableSchema, schema_of
from harness.settings.toml_locator import Key, dotted, key_lines, nearest_line
from harness.toml_text import shortened, tables_of, value_of

_LARGEST = 1 << 24  # bytes: largest settings file


@dataclass(frozen=True, slots=True)
class SettingsFile:
    """A settings file that has been read but not checked."""

    path: Path
    text: str  # as it was read, once: a pipe has no second time
    document: Mapping[str, object]  # in file units, with the overrides
    lines: Mapping[Key, int]  # the line of each key, from 1
    overrides: Mapping[Key, str]  # by key, what sets it: `--set KEY=VALUE`

    def flight(self, *, started: bool = False) -> Flight:
        """The file's one flight; with `started` it is tried whether it can start. Raises `SettingsError`."""
        matrix = self.document.get("matrix")
        if matrix and isinstance(matrix, dict):
            place = self._place(("matrix",)).text
            many = "describes many flights, must be one: fix each axis by --set, or use `harness run`"
            raise SettingsError([f"{place}: matrix: {many}"])
        return _flight(self.document, self._place, self.path.parent, started=started, run=True)

    def experiment(self) -> Experiment:
        """Everything in the file; the content of [flight] and of [matrix] stays unchecked. Raises `SettingsError`."""
        experiment, mistakes = self.draft()
        if mistakes:
            raise SettingsError(mistakes)
        return experiment

    def draft(self) -> tuple[Experiment, list[str]]:
        """The valid part of the file, and the mistakes."""
        experiment, mistakes = check(schema_of(Experiment), self.document)
        if mistakes:
            rest = mended(self.document, [mistake.key for mistake in mistakes])
            experiment, _ = check(schema_of(Experiment), rest)
        assert isinstance(experiment, Experiment)
        return experiment, settings_error(mistakes, self._place).lines

    def assess(self) -> Assess:
        """The margins of the verdict, from the table [assess] alone. Raises `SettingsError`."""
        only = TableSchema({"assess": schema_of(Experiment).settings["assess"]}, dict, open=True)
        made = checked(only, self.document, self._place)
        assert isinstance(made, dict)
        assess = made.get("assess", Assess())
        assert isinstance(assess, Assess)
        return assess

    def locate(self, name: str) -> str:
        """Place and key of a field by its dotted name: `FILE:LINE: flight.start.airspeed_mps` for `start.airspeed`."""
        key = file_key(name)
        return f"{self._place(key).text}: {dotted(key)}"

    def order(self, message: str) -> int:
        """By which the messages about this file are sorted: the line, from 0; those of `--set` come last."""
        line = message.removeprefix(f"{self.path}:").partition(":")[0]
        return int(line) if line.isdecimal() else sys.maxsize

    def warn(self, key: Key, message: str) -> None:
        """A FutureWarning that says where the key stands."""
        warnings.warn(f"{self._place(key).text}: {dotted(key)}: {message}", FutureWarning, stacklevel=2)

    def _place(self, key: Key) -> Place:
        for length in range(len(key), 0, -1):
            if key[:length] in self.overrides:
                return Place(sys.maxsize, self.overrides[key[:length]])
        line = nearest_line(self.lines, key)
        return Place(line, f"{self.path}:{line}")


def load_flight(path: str | Path, overrides: Sequence[str] = ()) -> Flight:
    """The flight that a settings file (TOML) describes.

    `overrides` are texts KEY=VALUE, keys dotted below [flight], in the file's units: degrees, where a key ends so.
    Relative paths start at the folder of the file, those of `overrides` at the working folder.

    Raises `SettingsError` with every mistake, each with its line and what is allowed; also when it cannot be read.

    >>> flight = harness.load_flight("experiments/stationary.toml", ["plant=kinematic", "start.heading_deg=60"])
    """
    return read_settings(Path(path), overrides).flight()


def read_settings(path: Path, overrides: Sequence[str] = ()) -> SettingsFile:
    """The file with `overrides` merged into its [flight]. Raises `SettingsError` if it is unreadable or not TOML."""
    return settings_from_text(_text(path), path, overrides)


def settings_from_text(text: str, path: Path, overrides: Sequence[str] = ()) -> SettingsFile:
    """Like `read_settings`, from the text of a file, as a store keeps it; `path` is for messages."""
    try:
        document = tables_of(text)
    except tomllib.TOMLDecodeError as error:
        what, _, at = str(error).rpartition(" (at ")
        located = re.match(r"line (\d+)", at)
        line = located[1] if located else text.count("\n") + 1  # "at end of document"
        raise SettingsError([f"{path}:{line}: not valid TOML: {what}"]) from None
    except ValueError as error:  # a number with too many digits, tables nested too deep
        raise SettingsError([f"{path}: cannot be used: {error}"]) from None
    return overridden(SettingsFile(path, text, document, key_lines(text), {}), overrides)


def overridden(file: SettingsFile, overrides: Sequence[str], option: str = "--set") -> SettingsFile:
    """The file with the texts KEY=VALUE merged into its [flight]; their paths start at the working folder.

    `option` of the command line gave them: it stands in messages.

    Raises `SettingsError`.
    """
    document = deepcopy(dict(file.document))
    merged = dict(file.overrides)
    wrong = []
    for override in overrides:
        name, equals, value = override.partition("=")
        if not equals:
            wrong.append(f"{option} {shortened(override)}: must be KEY=VALUE, as in law.gains=paper_1")
            continue
        try:
            given = value_of(value)
            key = put(document, name, given)
            put(
                document,
                name,
                [_absolute(key, one) for one in given] if isinstance(given, list) else _absolute(key, given),
            )
        except SettingsError as error:
            wrong.append(f"{option} {shortened(override)}: {error}")
            continue
        merged = {k: o for k, o in merged.items() if k[: len(key)] != key}  # without those that it replaces
        merged[key] = f"{option} {shortened(override)}"
    if wrong:
        raise SettingsError(wrong)
    changed = replace(file, document=document, overrides=merged)
    _leave_out_gains_of_another_law(file.document, changed)
    return replace(changed, document=without_former_names(document, changed.warn))


def _leave_out_gains_of_another_law(before: Mapping[str, Any], changed: SettingsFile) -> None:
    """Where an override names another law, what the file gives for its own law's gains is left out, with a warning."""
    former, law = (_within(_within(document, "flight"), "law") for document in (before, changed.document))
    if ("flight", "law", "name") not in changed.overrides or former.get("name") in (None, law["name"]):
        return
    names = law["name"] if isinstance(law["name"], list) else [law["name"]]
    if not all(isinstance(name, str) and (name in LAWS or is_own(name)) for name in names):
        return  # a mistake, which the check reports
    shared = {"name", *schema_of(StandoffLaw).settings}
    left_out = [key for key in law if key not in shared and ("flight", "law", key) not in changed.overrides]
    for key in left_out:
        del law[key]
    if left_out:
        override = changed.overrides["flight", "law", "name"]
        what = f"{', '.join(left_out)} of {former['name']} in {changed.path}"
        warnings.warn(f"{override}: leaves out {what}, which are another law's", stacklevel=3)


def _within(document: Mapping[str, Any], name: str) -> dict[str, Any]:
    table = document.get(name)
    return table if isinstance(table, dict) else {}


def flight_from_document(document: Mapping[str, object], folder: Path = Path(), *, run: bool = False) -> Flight:
    """The flight of a [flight] table in file units; relative paths of a track or an airframe start at `folder`.

    With `run` the table is the user's own: the file of a law that it names may be run. Without, that law was loaded
    before, or is refused. Raises `SettingsError`, whose lines name the key but no file.
    """
    return _flight({"flight": without_former_names(document)}, lambda key: Place(0, ""), folder, run=run)


def _text(path: Path) -> str:
    try:
        with path.open("rb") as file:  # may be a pipe; from a device it would never end
            content = file.read(_LARGEST + 1)
        if len(content) > _LARGEST:
            raise SettingsError([f"{path}: has more than {_LARGEST >> 20} MB, which no settings file has"])
        return content.decode("utf-8-sig")
    except OSError as error:
        raise SettingsError([f"{path}: {error.strerror or error}"]) from None
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        raise SettingsError([f"{path}:{line}: not text in UTF-8"]) from None


def _flight(document: Mapping[str, object], place: Places, folder: Path, *, started: bool = False, run: bool) -> Flight:
    """The flight of a document, completely checked; relative paths of a track or an airframe start at `folder`.

    With `started` it is tried whether it can start. Raises `SettingsError`.
    """
    value, found = _described(document, folder, run=run)
    wrong = [mistake.key for mistake in found]
    if wrong:
        value, _ = _described(mended(document, wrong), folder, run=run)
    if not isinstance(value, Flight):
        raise settings_error(found, place)
    mistakes = [*found]
    for problem in [*problems(value), *(start_problems(value) if started else ())]:
        keys = [file_key(name) for name in (problem.name, *problem.others)]
        if not any(concerns(key, wrong) for key in keys):
            mistakes.append(Mistake(keys[0], problem.message))
    if mistakes:
        raise settings_error(mistakes, place)
    return value


def _described(document: Mapping[str, object], folder: Path, *, run: bool) -> Checked:
    """The flight of a document, each of its values checked on its own; the paths of files in it are absolute."""
    given = document.get("flight")
    if isinstance(given, Mapping):
        given = _with_paths(given, folder)
        document = {**document, "flight": given}
    table, refused = _table(document, run=run)
    schema = table.settings["flight"].table
    if isinstance(given, Mapping) and schema is not None:
        document = {**document, "flight": at_own_speed(given, schema)}
    if refused:
        return Checked(None, [*refused, *check(table, document).mistakes])
    return _with_gains_by_rule(check(table, document), document)


def _table(document: Mapping[str, object], *, run: bool) -> tuple[TableSchema, list[Mistake]]:
    """The schema of a document with its law, and what is wrong with a user-defined law."""
    match document:
        case {"flight": {"law": {"name": str(name), **law}}} if name in LAWS or is_own(name):
            try:
                return document_table(kind_of(name, run=run).value, law.get("gains") == CUSTOM), []
            except LawError as error:
                return without_law(), [Mistake(("flight", "law", "name"), str(error))]
    return document_table(None, False), []


def _with_gains_by_rule(described: Checked, document: Mapping[str, Any]) -> Checked:
    """The flight with the gains decided by its rule, except those that the document gives."""
    flight = described.value
    if not isinstance(flight, Flight):
        return described
    given = document["flight"]["law"]
    names = [setting.name for key, setting in schema_of(type(flight.law)).settings.items() if key in given]
    try:
        return Checked(by_rule(flight, names), described.mistakes)
    except RuleError as error:
        message = f"{given['gains']} follows from a rule that has no answer here: {error}"
        return Checked(None, [*described.mistakes, Mistake(("flight", "law", "gains"), message)])


def _with_paths(flight: Mapping[str, object], folder: Path) -> Mapping[str, object]:
    """A [flight] table whose paths are absolute."""
    flight = {key: _absolute(("flight", key), value, folder) for key, value in flight.items()}
    for part in ("target", "law"):
        if isinstance(table := flight.get(part), Mapping):
            flight[part] = {k: _absolute(("flight", part, k), value, folder) for k, value in table.items()}
    return flight


def _absolute(key: Key, value: object, folder: Path = Path()) -> object:
    """The value of a key; a file of a track, a law or a recorded flight, or an airframe's folder, as a path."""
    if not isinstance(value, str) or not value:
        return value
    if key == ("flight", "law", "name"):
        return absolute(file_name(value), folder)
    path = str(folder.absolute() / file_name(value))
    if (
        key == ("flight", "aircraft")
        and value not in aircraft.names()
        and (aircraft.is_folder(path) or aircraft.is_recorded(path))
    ):
        return path
    return path if key == ("flight", "target", "track") else value
