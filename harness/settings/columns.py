"""The settings of flights as columns of a table: which column is a setting, by the declaration of a flight."""

import json
import math
from collections.abc import Mapping
from typing import Any

from harness.flight import Flight
from harness.settings.table import schema_of

DRAWN = "drawn"  # in the `attrs` of a table: whether any setting of its run is drawn from the seed
DIRECTORY = "directory"  # no setting: where a flight lies, in a table of the flights of several directories
_LISTS_OF_TABLES = ("segments", "gusts")


def nested(columns: Mapping[str, Any]) -> dict[str, Any]:
    """The inverse of `by_column`: a [flight] table of settings by their dotted keys."""
    table: dict[str, Any] = {}
    for key, value in columns.items():
        *within, last = key.split(".")
        inner = table
        for name in within:
            inner = inner.setdefault(name, {})
        if last in _LISTS_OF_TABLES and isinstance(value, str):
            value = json.loads(value)
        elif isinstance(value, float) and math.isinf(value):
            value = "inf"
        inner[last] = list(value) if isinstance(value, tuple) else value
    return table


def is_setting(column: str) -> bool:
    """Whether a column of results is a setting: a key, or below a table, of [flight]. Everything else is a result."""
    return column.partition(".")[0] in schema_of(Flight).settings


def by_column(settings: Mapping[str, Any], within: str = "") -> dict[str, Any]:
    """The settings of a flight by dotted key. A list of tables becomes JSON text; the text "inf" becomes infinity."""
    columns: dict[str, Any] = {}
    for key, value in settings.items():
        if isinstance(value, dict):
            columns.update(by_column(value, f"{within}{key}."))
        elif key in _LISTS_OF_TABLES:
            columns[within + key] = json.dumps(value)
        else:
            columns[within + key] = math.inf if value == "inf" else value
    return columns
