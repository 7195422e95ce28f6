"""TOML that a user gives: a text as tables, a value of the command line, and a value as messages show it."""

import json
import os
import tomllib
from collections.abc import Mapping
from typing import Any

DEEPEST = 30  # tables and lists within one another; what the harness reads has five
_TOO_DEEP = f"it has more than {DEEPEST} tables or lists within one another"
_LONGEST = 60  # characters of a text in a message
_LONGEST_PATH = 4096  # the system knows no longer one


def tables_of(text: str) -> dict[str, Any]:
    """The tables of a text. Raises ValueError: `tomllib.TOMLDecodeError`, or one without a place in the text."""
    try:
        tables = tomllib.loads(text)
    except RecursionError:
        raise ValueError(_TOO_DEEP) from None
    inside: list[Any] = [tables]
    for _ in range(DEEPEST):
        inside = [value for table in inside for value in _values(table) if isinstance(value, dict | list)]
    if inside:
        raise ValueError(_TOO_DEEP)
    return tables


def value_of(text: str) -> Any:
    """The value that a text on the command line stands for: as TOML has it, otherwise the text itself."""
    try:
        tables = tables_of(f"value = {text}")
    except ValueError:
        return text.strip()
    return tables["value"] if len(tables) == 1 else text.strip()


def shown(value: object) -> str:
    """A value as a file has it, for a message: shortened where it is long."""
    return shortened(_written(value))


def shortened(text: str) -> str:
    """The text on one line, its beginning where it is long; a path is kept whole."""
    line = " ".join(text.split())
    most = _LONGEST_PATH if os.sep in line else _LONGEST
    return line if len(line) <= most else f"{line[: most - 3]}..."


def _values(table: Any) -> Any:
    return table.values() if isinstance(table, dict) else table


def _written(value: object) -> str:
    match value:
        case bool():
            return str(value).lower()
        case str():
            return json.dumps(value, ensure_ascii=False)
        case Mapping():
            return f"{{ {', '.join(f'{key} = {_written(inner)}' for key, inner in value.items())} }}"
        case list() | tuple():
            return f"[{', '.join(map(_written, value))}]"
    return str(value)
