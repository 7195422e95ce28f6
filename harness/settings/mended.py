"""A document whose mistaken settings are replaced, so that the rest of it can be checked in the same round."""

from collections.abc import Collection, Mapping
from copy import deepcopy
from enum import Enum
from typing import Any

from harness.settings.toml_locator import Key


class ToldBefore(Enum):
    """Stands for a wrong value whose mistake was already reported."""

    TOLD = "told"


TOLD = ToldBefore.TOLD

# What stands for a mistaken setting that has no default, and changes nothing
_PLANT, _LAW = "kinematic", {"name": "nftsm"}
_ELEMENTS: Mapping[str, Mapping[str, object]] = {
    "segments": {"from_s": 0.0, "to_s": 1.0},
    "gusts": {"from_s": 0.0, "to_s": 1.0, "velocity_mps": [0.0, 0.0, 0.0]},
}


def mended(document: Mapping[str, object], wrong: Collection[Key]) -> dict[str, Any]:
    """The document with defaults in place of the settings at these keys; its law is replaced as a whole."""
    whole: dict[str, Any] = deepcopy(dict(document))
    for key in wrong:
        if key[0] == "flight":
            _mend(whole, key)
        else:
            whole.pop(str(key[0]), None)
    flight = whole.setdefault("flight", {})
    flight.setdefault("plant", _PLANT)
    if "law" not in flight or any(key[:2] == ("flight", "law") for key in wrong):
        flight["law"] = dict(_LAW)
    return whole


def concerns(name: Key, wrong: Collection[Key]) -> bool:
    """Whether one of these keys is this key, lies below it, or is a table around it."""
    return any(name[: len(key)] == key[: len(name)] for key in wrong)


def _mend(table: Any, key: Key) -> None:
    for i, word in enumerate(key[:-1]):
        if isinstance(key[i + 1], int):  # in a list
            if isinstance(word, str) and word in _ELEMENTS:
                table[word][key[i + 1]] = dict(_ELEMENTS[word])
            else:
                table.pop(word, None)
            return
        table = table.get(word)
        if not isinstance(table, dict):
            return
    table.pop(key[-1], None)
