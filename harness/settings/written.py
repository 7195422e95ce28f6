"""A flight as the [flight] table of a settings file, and as its text."""

import json
import math
from collections.abc import Iterator, Mapping
from typing import Any

from harness.error import SettingsError
from harness.flight import Flight
from harness.settings.laws import NotRun, kind_of_class
from harness.settings.number import in_file
from harness.settings.table import Setting, schema_of


def document(flight: Flight) -> dict[str, Any]:
    """The flight as a [flight] table in file units, all keys, fit for JSON. `flight_from_document` is the inverse.

    Raises `SettingsError` for a law without a name.
    """
    if isinstance(flight.law, NotRun):
        return {**written(flight), "law": dict(flight.law.table)}
    known = kind_of_class(type(flight.law))
    if known is None:
        own = type(flight.law).__name__
        how = f'harness.law("FILE.py:{own}") gives it one'
        raise SettingsError(
            [f"flight.law: {own} has no name in autopilot/laws.py, by which a file could keep it; {how}"]
        )
    return {**written(flight), "law": {"name": known[0], **written(flight.law)}}


def toml(flight: Flight) -> str:
    """The [flight] of a settings file, every key written out. Raises `SettingsError` for a law without a name."""
    return "\n".join(_toml(document(flight), "flight")) + "\n"


def _toml(table: Mapping[str, Any], name: str) -> Iterator[str]:
    """A table and those within it; a key without a value is left out."""
    yield f"[{name}]"
    for key, value in table.items():
        if value is not None and not isinstance(value, Mapping):
            yield f"{key} = {_toml_value(value)}"
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield ""
            yield from _toml(value, f"{name}.{key}")


def _toml_value(value: object) -> str:
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{key} = {_toml_value(inner)}' for key, inner in value.items())} }}"
    if isinstance(value, list):
        return f"[{', '.join(map(_toml_value, value))}]"
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def written(part: object) -> dict[str, Any]:
    """The fields of a dataclass as a table in file units, fit for JSON."""
    return {key: _written_value(getattr(part, s.name), s) for key, s in schema_of(type(part)).settings.items()}


def _written_value(value: object, setting: Setting) -> object:
    if isinstance(value, tuple):
        return [_written_value(element, setting) for element in value]
    if setting.table:
        return written(value)
    if setting.kind is float and isinstance(value, int | float) and not isinstance(value, bool):
        number = float(value) + 0.0  # in Python 100 may stand for 100.0, and -0.0 for 0.0: it is the same flight
        return "inf" if math.isinf(number) else in_file(number, setting.unit)
    return value
