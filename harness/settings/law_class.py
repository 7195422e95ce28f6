"""The requirements on the class of a law: all that a user-defined class lacks is reported at once."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from inspect import isclass
from types import ModuleType
from typing import Any, Literal, get_origin

from autopilot.laws import LawKind
from harness.error import did_you_mean
from harness.settings.law_source import LawError, Source
from harness.settings.table import Setting, schema_of

_MEMBERS = ("start", "command", "broken_conditions")  # besides the fields
_FIELDS = ("standoff", "max_heading_rate")  # numbers that every result has


def kind_in(source: Source, module: ModuleType) -> LawKind:
    """The law of a module. Raises `LawError` with everything that it lacks."""
    value: Any = getattr(module, source.class_name, None)
    if not isinstance(value, type):
        laws = [name for name, one in vars(module).items() if isclass(one) and one.__module__ == module.__name__]
        there = f"it has {', '.join(laws)}" if laws else "it has no class"
        raise LawError(
            f"{source.main}: there is no class {source.class_name}, {there}{did_you_mean(source.class_name, laws)}"
        )
    sets = getattr(value, "gain_sets", getattr(module, "GAIN_SETS", {}))
    wrong = [*_wrong_with(value), *_wrong_sets(value, sets)]
    if wrong:
        raise LawError(f"{source.main}: {source.class_name} is not a law yet: {'; '.join(wrong)}")
    return LawKind(value, sets, next(iter(sets), ""), getattr(module, "RULES", {}))


def _wrong_with(value: type) -> Iterator[str]:
    """Everything that a class lacks to be a law, and what is wrong with its fields."""
    own = vars(value)
    params = getattr(value, "__dataclass_params__", None)
    if not is_dataclass(value) or ("__dataclass_params__" not in own and own.get("__annotations__")):
        yield "it is no dataclass: write @dataclass(frozen=True) above it"
    elif params and not params.frozen:
        yield "it is not frozen: write @dataclass(frozen=True)"
    for member in _MEMBERS:
        if not hasattr(value, member) and member not in _names(value):
            yield f"it lacks {_wanted(member)}"
    for name in _FIELDS:
        if name not in _names(value):
            yield f"it lacks {_wanted(name)}"
    if is_dataclass(value):
        yield from _wrong_fields(value)


def _wanted(member: str) -> str:
    return {
        "start": "start(self, context), which returns the function from an Observation to a Guidance",
        "command": 'command = "heading_rate", the quantity that it limits',
        "broken_conditions": "broken_conditions(self, speed_ratio), a list of sentences, perhaps empty",
        "standoff": "the field standoff: float = 200.0, in m",
        "max_heading_rate": "the field max_heading_rate: float = 0.087, in rad/s",
    }[member]


def _names(value: type) -> list[str]:
    return [field.name for field in fields(value)] if is_dataclass(value) else []


def _wrong_fields(value: type) -> Iterator[str]:
    try:
        settings = schema_of(value).settings.values()
    except Exception as error:  # of an annotation that means nothing here
        yield f"the annotations of its fields cannot be read: {error}"
        return
    for setting in settings:
        if setting.name == "name":
            yield "a field cannot be called name: that is the law's own in [flight.law]"
        if setting.table or not _is_plain(setting):
            yield f"the field {setting.name} must be a float, int, bool, str, Literal or a tuple of these"
        if setting.name in _FIELDS and setting.kind is not float:
            yield f"the field {setting.name} must be a float"
        if setting.name == "gains" and setting.kind is not str:
            yield 'the field gains must be text: gains: str = "custom"'


def _is_plain(setting: Setting) -> bool:
    return setting.kind in (float, int, bool, str) or get_origin(setting.kind) is Literal


def _wrong_sets(value: type, sets: Any) -> Iterator[str]:
    if not isinstance(sets, Mapping) or not all(isinstance(numbers, Mapping) for numbers in sets.values()):
        yield "its gain_sets must be numbers by the name of a field, by the name of a set"
        return
    for label, numbers in sets.items():
        for name, number in numbers.items():
            if name not in _names(value):
                yield f"its gain set {label} sets {name}, which is no field{did_you_mean(name, _names(value))}"
            elif not isinstance(number, int | float) or not math.isfinite(number):
                yield f"its gain set {label} has {name} = {number!r}, must be a finite number"
