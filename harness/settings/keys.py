"""Keys of a settings file: from the name of a flight's field to its key, and setting the value of a key."""

from typing import Any

from autopilot.laws import LAWS
from harness.error import SettingsError
from harness.settings.experiment import flight_table
from harness.settings.table import TableSchema, schema_of
from harness.settings.toml_locator import Key, dotted
from harness.toml_text import DEEPEST


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
    table: TableSchema | None = flight_table(TableSchema({}, dict))
    setting = None
    for word in name.split("."):
        setting = table.settings.get(word) if table else None
        table = setting.table if setting else None
    return setting is not None and setting.length is not None


def put(document: dict[str, Any], name: str, value: object) -> Key:
    """Sets a value in the [flight] of a document by its dotted name, as in `law.gains`; returns its key in the file.

    A name that begins with `assess.` belongs to the table [assess]. Raises `SettingsError` for a name that cannot be a
    key.
    """
    words = [word.strip() for word in name.strip().removeprefix("flight.").split(".")]
    if not all(words) or len(words) > DEEPEST:
        raise SettingsError(["the key must be a dotted name below [flight], as in law.gains"])
    key = tuple(words) if words[0] == "assess" else ("flight", *words)
    table = document
    for i, word in enumerate(key[:-1]):
        table = table.setdefault(word, {})
        if not isinstance(table, dict):
            raise SettingsError([f"{dotted(key[: i + 1])} is not a table"])
    table[key[-1]] = value
    return key
