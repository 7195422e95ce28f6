"""The schema of a table in a settings file, read from a dataclass: annotations give key, unit, bounds, choices."""

from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, fields, is_dataclass, replace
from functools import cache
from types import EllipsisType, NoneType, UnionType
from typing import Annotated, Literal, Union, get_args, get_origin, get_type_hints

from annotated_types import Ge, Gt, Le, Lt

from autopilot.quantities import OneOf, Unit, Unlimited
from autopilot.standoff import StandoffLaw
from harness.settings.number import in_file

_PLAIN = Unit("", 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class TableSchema:
    """The schema of a table: its settings by key, and the function that builds a value from them by field name."""

    settings: Mapping[str, "Setting"]
    make: Callable[..., object]
    open: bool = False  # whether unknown keys are allowed


@dataclass(frozen=True, slots=True)
class Setting:
    """The schema of one key: a field of a dataclass as a file holds it."""

    kind: object  # float, str, a Literal, ...; of each element if there is a length
    name: str = ""  # of the field
    unit: Unit = _PLAIN
    bounds: tuple[Gt | Ge | Lt | Le, ...] = ()  # in file units
    length: int | EllipsisType | None = None  # of a list; `...` stands for any length
    table: TableSchema | None = None  # the schema, if the value is a table or a list of tables
    optional: bool = False  # whether the field may be None
    required: bool = True
    infinite: bool = False  # whether infinity is allowed


def _read(part: type) -> TableSchema:
    hints = get_type_hints(part, include_extras=True)
    settings = {}
    shared = get_type_hints(StandoffLaw, include_extras=True)  # a user-defined law may write a plain `standoff: float`
    for f in fields(part):
        required = f.default is MISSING and f.default_factory is MISSING
        hint = shared.get(f.name, float) if hints[f.name] is float else hints[f.name]
        setting = replace(_annotated(hint), name=f.name, required=required)
        key = f"{f.name.rstrip('_')}_{setting.unit.suffix}".rstrip("_")
        settings[key] = setting
    return TableSchema(settings, part)


schema_of: Callable[[type], TableSchema] = cache(
    _read
)  # not as a decorator: mypy would not accept a class as an argument


def _annotated(hint: object) -> Setting:
    """The schema that a field's annotation gives."""
    if get_origin(hint) is Annotated:
        inner, *marks = get_args(hint)
        setting = _annotated(inner)
        unit = next((mark for mark in marks if isinstance(mark, Unit)), setting.unit)
        bounds = (
            type(mark)(in_file(getattr(mark, type(mark).__name__.lower()), unit))
            for mark in marks
            if isinstance(mark, Gt | Ge | Lt | Le)
        )
        infinite = setting.infinite or Unlimited() in marks
        for mark in marks:
            if isinstance(mark, OneOf):
                setting = replace(setting, kind=Literal[mark.names])
        return replace(setting, unit=unit, bounds=(*setting.bounds, *bounds), infinite=infinite)
    if get_origin(hint) in (Union, UnionType):
        (inner,) = (member for member in get_args(hint) if member is not NoneType)
        return replace(_annotated(inner), optional=True)
    if get_origin(hint) is tuple:
        element, *others = get_args(hint)
        return replace(_annotated(element), length=... if others == [...] else 1 + len(others))
    return Setting(hint, table=schema_of(hint) if isinstance(hint, type) and is_dataclass(hint) else None)
