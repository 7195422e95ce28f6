"""A mistake in the settings and its message: place, key, what is wrong, what is allowed, did you mean."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal, NamedTuple, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt
from pydantic_core import ErrorDetails

from harness.error import SettingsError, did_you_mean
from harness.settings.mended import TOLD
from harness.settings.table import Setting, TableSchema
from harness.settings.toml_locator import Key, dotted
from harness.toml_text import shown

REFUSED = "refused"  # the type of an error whose message says all
LARGEST = 1e9  # in file units: the largest size of any number

_NOUNS: Mapping[object, str] = {float: "number", int: "whole number", str: "string"}
_COUNTS = {2: "two", 3: "three"}
_BOUNDS = {Gt: ">", Ge: ">=", Lt: "<", Le: "<="}


class Place(NamedTuple):
    """The place of a key: a message begins with its text."""

    order: int  # messages are sorted by it
    text: str  # FILE:LINE or --set KEY=VALUE; may be empty


Places = Callable[[Key], Place]  # the place of each key


class Mistake(NamedTuple):
    """A mistake at a key."""

    key: Key
    message: str  # empty if it was already reported


def settings_error(mistakes: Sequence[Mistake], place: Places) -> SettingsError:
    """The mistakes as one error, in the order of their places."""
    told = ((place(key), f"{dotted(key)}: {message}") for key, message in mistakes if message)
    placed = sorted(told, key=lambda p: p[0].order)
    return SettingsError(list(dict.fromkeys(": ".join(filter(None, (at.text, text))) for at, text in placed)))


def mistake(table: TableSchema, document: Any, details: ErrorDetails) -> Mistake:
    """A mistake that pydantic reports, in terms of the file."""
    key: Key = ()
    value = document
    setting: Setting | None = None
    for step in details["loc"]:
        if setting and not setting.table:
            break  # inside a value: the message shows the whole value
        key = (*key, step)
        if isinstance(step, int):
            value = value[step]
            continue
        if step not in table.settings:
            known = sorted(table.settings)
            return Mistake(key, f"unknown key, known here: {', '.join(known)}{did_you_mean(step, known)}")
        setting = table.settings[step]
        table = setting.table or table
        if step not in value:
            return Mistake(key, f"is missing, must be {_expected(setting)}")
        value = value[step]
    assert setting
    if details["type"] == REFUSED:
        return Mistake(key, details["msg"])
    if value is TOLD:
        return Mistake(key, "")
    expected = _expected(replace(setting, length=None) if isinstance(key[-1], int) else setting)
    if details["type"] == "finite_number":
        expected = expected.replace("number", "finite number")
    if details["type"] == "too_large":
        expected += f", of {LARGEST:g} at most in size"
    return Mistake(key, f"is {shown(value)}, must be {expected}{did_you_mean(value, _choices(setting))}")


def _expected(setting: Setting) -> str:
    if choices := _choices(setting):
        texts = [shown(choice) for choice in choices]
        return " or ".join(texts) if len(texts) < 3 else f"one of {', '.join(texts)}"
    if setting.kind is bool:
        return "true or false"
    noun = _NOUNS.get(setting.kind, "table")
    if setting.length is None:
        noun = f"a {noun}"
    elif setting.length is ...:
        noun = f"a list of {noun}s"
    else:
        noun = f"{_COUNTS.get(setting.length, setting.length)} {noun}s"
    bounds = [f"{_BOUNDS[type(b)]} {getattr(b, type(b).__name__.lower()):g}" for b in setting.bounds]
    return " ".join([noun, " and ".join(bounds)]).strip() + (" or inf" if setting.infinite else "")


def _choices(setting: Setting) -> tuple[str, ...]:
    return get_args(setting.kind) if get_origin(setting.kind) is Literal else ()
