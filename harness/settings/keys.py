"""The keys of a flight in its file, beside the dotted names of its fields."""

from typing import Any

from autopilot.laws import LAWS
from harness.error import SettingsError
from harness.settings.experiment import flight_table
from harness.settings.table import Table, table_of
from harness.settings.toml_locator import Key, dotted


def file_key(name: str) -> Key:
    """The key in a file of a flight's field, by the field's dotted name."""
    laws = {key: setting for kind in LAWS.values() for key, setting in table_of(kind.value).settings.items()}
    table: Table | None = flight_table(Table(laws, dict))
    key: list[str | int] = ["flight"]
    for word in name.split("."):
        if word.isdigit():
            key.append(int(word))
        else:
            known = table.settings if table else {}
            found, setting = next(((k, s) for k, s in known.items() if s.name == word), (word, None))
            key.append(found)
            table = setting.table if setting else None
    return tuple(key)


def put(document: dict[str, Any], name: str, value: object) -> Key:
    """Sets a value in the document's [flight] by the key's dotted name, as in `law.gains`, and gives its whole key.

    A name that begins with `assess.` is one of the table [assess]. Raises `SettingsError` for what cannot be a key.
    """
    words = [word.strip() for word in name.strip().removeprefix("flight.").split(".")]
    if not all(words):
        raise SettingsError(["the key must be a dotted name below [flight], as in law.gains"])
    key = tuple(words) if words[0] == "assess" else ("flight", *words)
    table = document
    for i, word in enumerate(key[:-1]):
        table = table.setdefault(word, {})
        if not isinstance(table, dict):
            raise SettingsError([f"{dotted(key[: i + 1])} is no table"])
    table[key[-1]] = value
    return key
