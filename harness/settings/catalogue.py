"""Every key of a settings file in words, read from the declarations: for `harness list` and the reference."""

from collections.abc import Iterator, Mapping
from dataclasses import MISSING, fields
from types import EllipsisType, MappingProxyType
from typing import Literal, NamedTuple, get_args, get_origin, get_type_hints

from annotated_types import Ge, Gt, Le, Lt

from autopilot.laws import LAWS
from autopilot.quantities import About, Unit
from autopilot.standoff import StandoffLaw
from harness.flight import Flight
from harness.margins import Assess
from harness.settings.experiment import CUSTOM
from harness.settings.table import Setting, schema_of
from harness.toml_text import shown
from harness.world.target import Segment
from harness.world.wind import Gust

UNITS = {
    "": "",
    "s": "s",
    "m": "m",
    "m2": "m²",
    "mps": "m/s",
    "mps2": "m/s²",
    "mps_per_m": "(m/s)/m",
    "m2_s2": "m²/s²",
    "deg": "°",
    "deg_s": "°/s",
    "deg_s2": "°/s²",
    "rad2": "rad²",
}
REQUIRED = "–"  # instead of a default
TRUTH = "true or false"
_KINDS: Mapping[object, str] = MappingProxyType({float: "number", int: "whole number", str: "text", bool: TRUTH})
_BOUNDS = {Gt: ">", Ge: "≥", Lt: "<", Le: "≤"}


class SettingsKey(NamedTuple):
    """A key and what there is to say of it."""

    key: str  # in its table
    unit: str
    default: str  # as a file has it; `REQUIRED` where there is none, in brackets where it is no value
    allowed: str  # in words; empty where it is one of `choices`
    choices: tuple[str, ...]
    meaning: str


class SettingsTable(NamedTuple):
    """A table of a settings file."""

    name: str  # its heading
    prefix: str  # of its keys in their dotted names
    kind: type
    inherited: type | None = None  # what its keys share with others, which has an entry
    is_list: bool = False  # whether it is an entry of a list of tables: `--set` cannot name its keys


TABLES = (
    SettingsTable("[flight]", "", Flight),
    SettingsTable("[flight.law]", "law.", StandoffLaw),
    *(
        SettingsTable(f'[flight.law] with name = "{name}"', "law.", law.value, StandoffLaw)
        for name, law in LAWS.items()
    ),
    *(
        SettingsTable(f"[flight.{key}]", f"{key}.", setting.table.make)
        for key, setting in schema_of(Flight).settings.items()
        if setting.table and isinstance(setting.table.make, type)
    ),
    SettingsTable("An entry of flight.target.segments", "target.segments.", Segment, is_list=True),
    SettingsTable("An entry of flight.wind.gusts", "wind.gusts.", Gust, is_list=True),
    SettingsTable("[assess]", "assess.", Assess),
)


def keys_of(table: SettingsTable) -> Iterator[SettingsKey]:
    """The keys of a table, without tables that have an entry of their own."""
    if table.kind is StandoffLaw:
        yield SettingsKey("name", "", REQUIRED, "", tuple(LAWS), "the guidance law; a user-defined one: FILE.py:CLASS")
        sets = dict.fromkeys([*(gains for law in LAWS.values() for gains in law.sets), CUSTOM])
        defaults = ", ".join(f"{law.default} for {name}" for name, law in LAWS.items())
        yield SettingsKey("gains", "", "(of the law)", "", tuple(sets), f"a named set of gains; default: {defaults}")
    elsewhere = schema_of(table.inherited).settings if table.inherited else {}
    given = {field.name: field.default for field in fields(table.kind)}
    for key, setting in schema_of(table.kind).settings.items():
        meaning = about(table.kind, setting.name)
        if key in elsewhere or key == "gains" or not meaning.text:  # a table without a meaning has an entry
            continue
        default = "(of the set)" if elsewhere else _default(setting, given[setting.name])
        choices = get_args(setting.kind) if get_origin(setting.kind) is Literal else ()
        yield SettingsKey(
            key,
            UNITS[setting.unit.suffix] or meaning.unit,
            default,
            "" if choices else _allowed(setting),
            choices,
            meaning.text,
        )


def about(kind: type, name: str) -> About:
    """A field's meaning, from its declaration; empty without one."""
    marks = get_args(get_type_hints(kind, include_extras=True)[name])
    return next((mark for mark in marks if isinstance(mark, About)), About(""))


def _default(setting: Setting, default: object) -> str:
    if setting.required:
        return REQUIRED
    if default is None:
        return "(none)"
    return "" if default is MISSING else shown(_in_file(default, setting.unit))


def _in_file(value: object, unit: Unit) -> object:
    if isinstance(value, tuple):
        return [_in_file(element, unit) for element in value]
    return round(value / unit.si, 10) if isinstance(value, float) else value


def _allowed(setting: Setting) -> str:
    """The allowed values, in words."""
    kind = _KINDS.get(setting.kind, "table")
    bounds = " and ".join(f"{_BOUNDS[type(b)]} {_plain(getattr(b, type(b).__name__.lower()))}" for b in setting.bounds)
    words = f"{kind} {bounds}".strip()
    if setting.infinite:
        words += ", or inf"
    if isinstance(setting.length, EllipsisType):
        return f"list of {words}s"
    return f"{setting.length} × {words}" if setting.length else words


def _plain(bound: float) -> str:
    return f"{bound:g}".replace("e+0", "e").replace("e-0", "e-").replace("e+", "e")
