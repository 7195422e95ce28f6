"""Former names in settings: files and stored rows that use them are still read."""

from collections.abc import Callable, Mapping
from typing import Any

from autopilot.laws import LAWS, renamed
from harness.settings.toml_locator import Key

_GAIN_SETS = {former: today for kind in LAWS.values() for former, today in kind.former_names.items()}


def without_former_names(table: Mapping[str, Any], note: Callable[[Key, str], None] | None = None) -> dict[str, Any]:
    """A document, or a table of one, with today's names. `note` gets the key of each former name, and a message."""
    return {key: _today(value, (key,), note or (lambda key, message: None)) for key, value in table.items()}


def _today(value: Any, key: Key, note: Callable[[Key, str], None]) -> Any:
    if isinstance(value, Mapping):
        return {name: _today(inner, (*key, name), note) for name, inner in value.items()}
    if isinstance(value, list):
        return [_today(inner, (*key, i), note) for i, inner in enumerate(value)]
    if isinstance(value, str) and value in _GAIN_SETS and _names_gain_set(key):
        note(key, renamed(value, _GAIN_SETS[value]))
        return _GAIN_SETS[value]
    return value


def _names_gain_set(key: Key) -> bool:
    """Whether the key is `gains`, `law.gains`, or several of a matrix such as `"law.name, law.gains"`."""
    names = [name.strip() for word in key if isinstance(word, str) for name in word.split(",")]
    return any(name.split(".")[-1] == "gains" for name in names)
