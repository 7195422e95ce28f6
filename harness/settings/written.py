"""A flight as the [flight] table of a settings file."""

import math
from typing import Any

from autopilot.laws import LAWS
from harness.error import SettingsError
from harness.flight import Flight
from harness.settings.number import in_file
from harness.settings.table import Setting, schema_of


def document(flight: Flight) -> dict[str, Any]:
    """The flight as a [flight] table in file units, all keys, fit for JSON. `flight_from_document` is the inverse.

    Raises `SettingsError` for a law without a name.
    """
    name = next((name for name, kind in LAWS.items() if kind.value is type(flight.law)), None)
    if name is None:
        own = type(flight.law).__name__
        raise SettingsError([f"flight.law: {own} has no name in autopilot/laws.py, by which a file could keep it"])
    return {**written(flight), "law": {"name": name, **written(flight.law)}}


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
