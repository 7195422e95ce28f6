"""Settings: the border between a TOML file (keys with unit suffixes, degrees) and a flight (SI, radians).

What a file may hold is read off the dataclasses: a field's annotation gives its key, unit and bounds. Only the law is
told here, because its class follows from its `name` and most of its values from a named set of gains.
"""

import json
import math
import re
import sys
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields, is_dataclass, replace
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from types import EllipsisType, GenericAlias, NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin, get_type_hints

from annotated_types import Ge, Gt, Le, Lt
from pydantic import (
    AfterValidator,
    AllowInfNan,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Strict,
    ValidationError,
    create_model,
)
from pydantic_core import ErrorDetails

from autopilot.laws import LAWS
from autopilot.quantities import About, Unit, Unlimited
from harness.flight import Flight, problems
from harness.toml_locator import Key, key_lines, nearest_line


class SettingsError(Exception):
    """What is wrong with the settings, one line for each mistake."""

    def __init__(self, lines: Sequence[str]) -> None:
        super().__init__("\n".join(lines))
        self.lines = list(lines)


@dataclass(frozen=True, slots=True, kw_only=True)
class Experiment:
    """What a file may hold; its tables as they stand there."""

    title: Annotated[str, About("heads the results")] = ""
    question: Annotated[str, About("what the results are to answer")] = ""
    flight: Annotated[Mapping[str, object], About("one flight, or what all have in common")]
    matrix: Annotated[Mapping[str, object], About("every key an axis, with its values")] = field(default_factory=dict)
    exclude: Annotated[tuple[Mapping[str, object], ...], About("flights to leave out")] = ()
    include: Annotated[tuple[Mapping[str, object], ...], About("flights to add")] = ()
    assess: Annotated[Mapping[str, object], About("margins of the verdict")] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class SettingsFile:
    """A file as it was read, not checked yet: what it says, and where."""

    path: Path
    document: Mapping[str, object]  # in file units, overrides merged
    lines: Mapping[Key, int]
    overrides: Mapping[Key, str]  # the texts KEY=VALUE

    def flight(self) -> Flight:
        """The file's one flight. Raises `SettingsError`."""
        matrix = self.document.get("matrix")
        if matrix and isinstance(matrix, dict):
            raise SettingsError([f"{self._place(('matrix',)).text}: matrix: many flights, not one: use `harness run`"])
        return _flight(self.document, self._place, self.path.parent)

    def experiment(self) -> Experiment:
        """Everything in the file; what its tables hold stays unchecked. Raises `SettingsError`."""
        experiment = _checked(_table(Experiment), self.document, self._place)
        assert isinstance(experiment, Experiment)
        return experiment

    def locate(self, name: str) -> str:
        """Where a field is set, by its dotted name: `FILE:LINE: flight.start.airspeed_mps` for `start.airspeed`."""
        key = file_key(name)
        return f"{self._place(key).text}: {_dotted(key)}"

    def _place(self, key: Key) -> "_Place":
        for length in range(len(key), 0, -1):
            if key[:length] in self.overrides:
                return _Place(sys.maxsize, f"--set {self.overrides[key[:length]]}")
        line = nearest_line(self.lines, key)
        return _Place(line, f"{self.path}:{line}")


def load_flight(path: Path, overrides: Sequence[str] = ()) -> Flight:
    """The flight that a file describes. `overrides` are texts KEY=VALUE, keys dotted below [flight], in file units.

    Raises `SettingsError` with every mistake.
    """
    return read_settings(path, overrides).flight()


def read_settings(path: Path, overrides: Sequence[str] = ()) -> SettingsFile:
    """A file with `overrides` merged into its [flight]. Raises `SettingsError` for a text that is no TOML."""
    text = _text(path)
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        what, _, at = str(error).rpartition(" (at ")
        told = re.match(r"line (\d+)", at)
        line = told[1] if told else text.count("\n") + 1  # "at end of document"
        raise SettingsError([f"{path}:{line}: no valid TOML: {what}"]) from None
    except (ValueError, RecursionError) as error:  # a number of too many digits, arrays too deep
        raise SettingsError([f"{path}: no valid TOML: {error}"]) from None
    merged: dict[Key, str] = {}
    wrong = []
    for override in overrides:
        name, equals, value = override.partition("=")
        if not equals:
            wrong.append(f"--set {override}: must be KEY=VALUE, as in law.gains=paper_1")
            continue
        try:
            key = put(document, name, _parsed(value))
        except SettingsError as error:
            wrong.append(f"--set {override}: {error}")
            continue
        merged = {k: o for k, o in merged.items() if k[: len(key)] != key}  # what it replaces
        merged[key] = override
    if wrong:
        raise SettingsError(wrong)
    return SettingsFile(path, document, key_lines(text), merged)


def flight_from_document(document: Mapping[str, object], folder: Path = Path()) -> Flight:
    """The flight of a [flight] table in file units; a track's path is from `folder`.

    Raises `SettingsError`, its lines without a place.
    """
    return _flight({"flight": dict(document)}, lambda key: _Place(0, ""), folder)


def document(flight: Flight) -> dict[str, Any]:
    """The flight as a [flight] table in file units: every key, fit for JSON. `flight_from_document` undoes it."""
    name = next(name for name, kind in LAWS.items() if kind.value is type(flight.law))
    return {**_written(flight), "law": {"name": name, **_written(flight.law)}}


def put(document: dict[str, Any], name: str, value: object) -> Key:
    """Sets a value in the document's [flight] by the key's dotted name, as in `law.gains`, and gives its whole key.

    Raises `SettingsError` for what cannot be a key.
    """
    words = [word.strip() for word in name.strip().removeprefix("flight.").split(".")]
    if not all(words):
        raise SettingsError(["the key must be a dotted name below [flight], as in law.gains"])
    key = ("flight", *words)
    table = document
    for i, word in enumerate(key[:-1]):
        table = table.setdefault(word, {})
        if not isinstance(table, dict):
            raise SettingsError([f"{_dotted(key[: i + 1])} is no table"])
    table[key[-1]] = value
    return key


def file_key(name: str) -> Key:
    """The key in a file of a flight's field, by the field's dotted name."""
    laws = {key: setting for kind in LAWS.values() for key, setting in _table(kind.value).settings.items()}
    table: _Table | None = _flight_table(_Table(laws, dict))
    key: list[str | int] = ["flight"]
    for word in name.split("."):
        if word.isdigit():
            key.append(int(word))
        else:
            known = table.settings if table else {}
            found, setting = next(((k, s) for k, s in known.items() if s.name == word), (word, None))
            key.append(found)
            table = setting.table if setting else None
    return tuple(key)


class _Place(NamedTuple):
    order: int  # in which mistakes are told
    text: str


def _text(path: Path) -> str:
    try:
        return path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise SettingsError([f"{path}: {error.strerror or error}"]) from None
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        raise SettingsError([f"{path}:{line}: no text in UTF-8"]) from None


def _parsed(value: str) -> object:
    try:
        return tomllib.loads(f"v = {value}")["v"]
    except ValueError:
        return value.strip()


def _flight(document: Mapping[str, object], place: Callable[[Key], _Place], folder: Path) -> Flight:
    """The flight, checked whole. A track's path is from `folder`, where the settings are."""
    match document:
        case {"flight": {"law": {"name": str(name), **law}}} if name in LAWS:
            table = _flight_document_table(name, law.get("gains") == _CUSTOM)
        case _:
            table = _flight_document_table(None, False)
    flight = _checked(table, document, place)
    assert isinstance(flight, Flight)
    if flight.target.track is not None:
        track = str(folder.absolute() / flight.target.track)
        flight = replace(flight, target=replace(flight.target, track=track))
    found = [_Mistake(file_key(problem.name), problem.message) for problem in problems(flight)]
    if found:
        raise _error(found, place)
    return flight


# What a file may hold

_CUSTOM = "custom"  # in the place of a named set: every gain is given
_PLAIN = Unit("", 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class _Table:
    """A table of a file: its keys, and what is made of their values, given by field name."""

    settings: Mapping[str, "_Setting"]
    make: Callable[..., object]
    open: bool = False  # to keys that it does not know


@dataclass(frozen=True, slots=True)
class _Setting:
    """A field of a dataclass, as a file has it."""

    kind: object  # float, str, a Literal…; of each element when there is a length
    name: str = ""
    unit: Unit = _PLAIN
    bounds: tuple[Gt | Ge | Lt | Le, ...] = ()  # in file units
    length: int | EllipsisType | None = None  # of a list; `...` for any
    table: _Table | None = None  # it is a table, or a list of such
    optional: bool = False  # None is a value
    required: bool = True
    infinite: bool = False  # infinity is a value


def _read_table(part: type) -> _Table:
    hints = get_type_hints(part, include_extras=True)
    settings = {}
    for f in fields(part):
        required = f.default is MISSING and f.default_factory is MISSING
        setting = replace(_annotated(hints[f.name]), name=f.name, required=required)
        key = f"{f.name.rstrip('_')}_{setting.unit.suffix}".rstrip("_")
        settings[key] = setting
    return _Table(settings, part)


_table: Callable[[type], _Table] = cache(_read_table)  # no decorator: to mypy a class is not hashable


def _annotated(hint: object) -> _Setting:
    """What an annotation says of a setting."""
    if get_origin(hint) is Annotated:
        inner, *marks = get_args(hint)
        setting = _annotated(inner)
        unit = next((mark for mark in marks if isinstance(mark, Unit)), setting.unit)
        bounds = (
            type(mark)(_in_file(getattr(mark, type(mark).__name__.lower()), unit))
            for mark in marks
            if isinstance(mark, Gt | Ge | Lt | Le)
        )
        infinite = setting.infinite or Unlimited() in marks
        return replace(setting, unit=unit, bounds=(*setting.bounds, *bounds), infinite=infinite)
    if get_origin(hint) in (Union, UnionType):
        (inner,) = (member for member in get_args(hint) if member is not NoneType)
        return replace(_annotated(inner), optional=True)
    if get_origin(hint) is tuple:
        element, *others = get_args(hint)
        return replace(_annotated(element), length=... if others == [...] else 1 + len(others))
    return _Setting(hint, table=_table(hint) if isinstance(hint, type) and is_dataclass(hint) else None)


@cache
def _flight_document_table(law: str | None, gains_given: bool) -> _Table:
    table = _table(Experiment)
    flight = _Setting(Flight, "flight", table=_flight_table(_law_table(law, gains_given)))
    return _Table({**table.settings, "flight": flight}, lambda flight, **others: flight)


def _flight_table(law: _Table) -> _Table:
    table = _table(Flight)
    return _Table({**table.settings, "law": replace(table.settings["law"], table=law)}, table.make)


def _law_table(name: str | None, gains_given: bool) -> _Table:
    """The table of a law; while its name is not known, that is all it asks for."""
    named = {"name": _Setting(Literal[*LAWS], "name")}
    if name is None:
        return _Table(named, dict, open=True)
    value, sets = LAWS[name].value, {**LAWS[name].gain_sets, _CUSTOM: {}}

    def make(name: str, gains: str = "paper", **given: float | str) -> object:
        return value(**{"gains": gains, **sets[gains], **given})

    own = {key: replace(s, required=s.required and gains_given) for key, s in _table(value).settings.items()}
    return _Table({**named, **own, "gains": _Setting(Literal[*sets], "gains", required=False)}, make)


# From a file, with pydantic


def _checked(table: _Table, document: Mapping[str, object], place: Callable[[Key], _Place]) -> object:
    try:
        return _made(table, _model(table).model_validate(document))
    except ValidationError as error:
        raise _error([_mistake(table, document, details) for details in error.errors()], place) from None


@cache
def _model(table: _Table) -> type[BaseModel]:
    keys: dict[str, Any] = {key: (_type(s), ... if s.required else None) for key, s in table.settings.items()}
    return create_model("Table", __config__=ConfigDict(extra="ignore" if table.open else "forbid"), **keys)


def _made(table: _Table, model: BaseModel) -> object:
    given = model.model_fields_set
    return table.make(**{s.name: getattr(model, key) for key, s in table.settings.items() if key in given})


def _type(setting: _Setting) -> Any:
    """The annotation that pydantic checks the value by, and makes it SI."""
    one: Any
    if table := setting.table:
        one = Annotated[_model(table), AfterValidator(lambda model: _made(table, model))]
    elif setting.kind is float:
        si = AfterValidator(lambda number: number * setting.unit.si)
        one = Annotated[float, Strict(), AllowInfNan(setting.infinite), *setting.bounds, si]
        if setting.infinite:  # JSON has no infinity
            one = Annotated[one, BeforeValidator(lambda given: math.inf if given == "inf" else given)]
    elif setting.kind in (int, bool, str):
        one = Annotated[setting.kind, Strict(), *setting.bounds]
    else:
        one = setting.kind
    if setting.length is not None:
        one = GenericAlias(tuple, (one, ...) if setting.length is ... else (one,) * setting.length)
    return one | None if setting.optional else one


# To a file


def _written(part: object) -> dict[str, Any]:
    return {key: _written_value(getattr(part, s.name), s) for key, s in _table(type(part)).settings.items()}


def _written_value(value: object, setting: _Setting) -> object:
    if isinstance(value, tuple):
        return [_written_value(element, setting) for element in value]
    if setting.table:
        return _written(value)
    if isinstance(value, float):
        return "inf" if math.isinf(value) else _in_file(value, setting.unit)
    return value


def _in_file(value: float, unit: Unit) -> float:
    """The shortest number in the file's unit that is read back as exactly this value, if there is one."""
    quotient = value / unit.si
    below, above = math.nextafter(quotient, -math.inf), math.nextafter(quotient, math.inf)
    near = [float(f"{quotient:.15g}"), float(f"{quotient:.16g}"), quotient, below, above]
    near += [math.nextafter(below, -math.inf), math.nextafter(above, math.inf)]
    return next((number for number in near if number * unit.si == value), quotient)


# Mistakes

_NOUNS: Mapping[object, str] = {float: "number", int: "whole number", str: "string"}
_COUNTS = {2: "two", 3: "three"}
_BOUNDS = {Gt: ">", Ge: ">=", Lt: "<", Le: "<="}


class _Mistake(NamedTuple):
    key: Key
    message: str


def _error(mistakes: Sequence[_Mistake], place: Callable[[Key], _Place]) -> SettingsError:
    placed = sorted(((place(key), f"{_dotted(key)}: {message}") for key, message in mistakes), key=lambda p: p[0].order)
    return SettingsError(list(dict.fromkeys(": ".join(filter(None, (at.text, told))) for at, told in placed)))


def _mistake(table: _Table, document: Any, details: ErrorDetails) -> _Mistake:
    """A mistake that pydantic found, in words of the file."""
    key: Key = ()
    value = document
    setting: _Setting | None = None
    for step in details["loc"]:
        if setting and not setting.table:
            break  # within a value, which is told whole
        key = (*key, step)
        if isinstance(step, int):
            value = value[step]
            continue
        if step not in table.settings:
            known = sorted(table.settings)
            return _Mistake(key, f"unknown key, known here: {', '.join(known)}{_did_you_mean(step, known)}")
        setting = table.settings[step]
        table = setting.table or table
        if step not in value:
            return _Mistake(key, f"is missing, must be {_expected(setting)}")
        value = value[step]
    assert setting
    expected = _expected(replace(setting, length=None) if isinstance(key[-1], int) else setting)
    if details["type"] == "finite_number":
        expected = expected.replace("number", "finite number")
    return _Mistake(key, f"is {_shown(value)}, must be {expected}{_did_you_mean(value, _choices(setting))}")


def _expected(setting: _Setting) -> str:
    if choices := _choices(setting):
        shown = [_shown(choice) for choice in choices]
        return " or ".join(shown) if len(shown) < 3 else f"one of {', '.join(shown)}"
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


def _choices(setting: _Setting) -> tuple[str, ...]:
    return get_args(setting.kind) if get_origin(setting.kind) is Literal else ()


def _did_you_mean(word: object, known: Sequence[str]) -> str:
    nearest = get_close_matches(str(word), known, n=1)
    return f" - did you mean {nearest[0]!r}?" if nearest else ""


def _shown(value: object) -> str:
    text = str(value) if isinstance(value, float) else json.dumps(value, default=str, ensure_ascii=False)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _dotted(key: Key) -> str:
    return ".".join(str(k) if re.fullmatch(r"[\w-]+", str(k), re.ASCII) else json.dumps(k) for k in key)
