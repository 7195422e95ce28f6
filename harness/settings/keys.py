"""Keys of a settings file: from the name of a flight's field to its key, and setting the value of a key."""

from collections.abc import Sequence
from dataclasses import MISSING, fields
from typing import Any

from autopilot.laws import LAWS
from harness.error import SettingsError
from harness.settings.experiment import flight_table
from harness.settings.number import in_file
from harness.settings.table import Setting, TableSchema, schema_of
from harness.settings.toml_locator import Key, dotted
from harness.toml_text import DEEPEST

COMPONENTS = ("north", "east", "down")  # of a vector: `wind.steady_mps.north` is one number of `wind.steady_mps`


def file_key(name: str) -> Key:
    """The key in a file of a field of `Flight`: `start.airspeed` gives flight.start.airspeed_mps."""
    laws = {key: setting for kind in LAWS.values() for key, setting in schema_of(kind.value).settings.items()}
    table: TableSchema | None = flight_table(TableSchema(laws, dict))
    key: list[str | int] = ["flight"]
    for word in name.split("."):
        if word.isdigit():
            key.append(int(word))
        else:
            known = table.settings if table else {}
            name_in_file, setting = next(((k, s) for k, s in known.items() if s.name == word), (word, None))
            key.append(name_in_file)
            table = setting.table if setting else None
    return tuple(key)


def is_list(name: str) -> bool:
    """Whether the setting of this dotted key in a file is a list itself, as `wind.steady_mps` is."""
    setting, _ = _setting(name.split("."))
    return setting is not None and setting.length is not None


def vector_of(name: str) -> str:
    """The vector of which a key is one component: `wind.steady_mps` of `wind.steady_mps.north`; empty if it is none."""
    vector, _, last = name.rpartition(".")
    return vector if last in COMPONENTS and is_list(vector) else ""


def _setting(words: Sequence[str]) -> tuple[Setting | None, object]:
    """A setting by the words of its key in a file, and its default as a file has it; None where there is none."""
    table: TableSchema | None = flight_table(TableSchema({}, dict))
    setting, default = None, None
    for word in words:
        setting = table.settings.get(word) if table else None
        if setting and table and isinstance(table.make, type):
            default = next((f.default for f in fields(table.make) if f.name == setting.name), None)
        table = setting.table if setting else None
    if setting and isinstance(default, tuple):
        return setting, [in_file(element, setting.unit) for element in default]
    return setting, None if default is MISSING else default


def put(document: dict[str, Any], name: str, value: object) -> Key:
    """Sets a value in the [flight] of a document by its dotted name, as in `law.gains`; returns its key in the file.

    A name that begins with `assess.` belongs to the table [assess]; of a name that ends with a component of a vector
    the key is the vector's. Raises `SettingsError` for a name that cannot be a key.
    """
    words = [word.strip() for word in name.strip().removeprefix("flight.").split(".")]
    if not all(words) or len(words) > DEEPEST:
        raise SettingsError(["the key must be a dotted name below [flight], as in law.gains"])
    if vector := vector_of(".".join(words)):
        return _put_component(document, vector, words[-1], value)
    key = tuple(words) if words[0] == "assess" else ("flight", *words)
    table = _table(document, key)
    table[key[-1]] = value
    return key


def _put_component(document: dict[str, Any], vector: str, component: str, value: object) -> Key:
    words = vector.split(".")
    table = _table(document, ("flight", *words))
    _, default = _setting(words)
    elements = table.get(words[-1], default)
    i = COMPONENTS.index(component)
    if not isinstance(elements, list) or len(elements) <= i:
        raise SettingsError([f"{vector} has no such component: it must be given as a list first"])
    table[words[-1]] = [*elements[:i], value, *elements[i + 1 :]]
    return ("flight", *words)


def _table(document: dict[str, Any], key: Sequence[str]) -> dict[str, Any]:
    """The table of a key, made where there is none. Raises `SettingsError`."""
    table = document
    for i, word in enumerate(key[:-1]):
        table = table.setdefault(word, {})
        if not isinstance(table, dict):
            raise SettingsError([f"{dotted(tuple(key[: i + 1]))} is not a table"])
    return table
