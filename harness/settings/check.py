"""Checks a table of a settings file with pydantic, and builds the value that it describes."""

import math
from collections.abc import Mapping, Sequence
from functools import cache
from types import GenericAlias
from typing import Annotated, Any, NamedTuple

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
from pydantic_core import PydanticCustomError

from harness.settings.mistake import LARGEST, Mistake, Places, mistake, settings_error
from harness.settings.table import Setting, TableSchema


class Checked(NamedTuple):
    """The content of a document, in SI, or its mistakes."""

    value: object  # None if there are mistakes
    mistakes: Sequence[Mistake]


def check(table: TableSchema, document: Mapping[str, object]) -> Checked:
    """The value that the document describes, or every mistake in it."""
    try:
        return Checked(_made(table, _model(table).model_validate(document)), [])
    except ValidationError as error:
        return Checked(None, [mistake(table, document, details) for details in error.errors()])


def checked(table: TableSchema, document: Mapping[str, object], place: Places) -> object:
    """The value that the document describes. Raises `SettingsError` with every mistake; `place` locates keys."""
    value, mistakes = check(table, document)
    if mistakes:
        raise settings_error(mistakes, place)
    return value


@cache
def _model(table: TableSchema) -> type[BaseModel]:
    keys: dict[str, Any] = {key: (_type(s), ... if s.required else None) for key, s in table.settings.items()}
    return create_model("Table", __config__=ConfigDict(extra="ignore" if table.open else "forbid"), **keys)


def _made(table: TableSchema, model: BaseModel) -> object:
    given = model.model_fields_set
    return table.make(**{s.name: getattr(model, key) for key, s in table.settings.items() if key in given})


def _sized(number: float) -> float:
    """The number; an error if it is so large that results would not be finite."""
    if LARGEST < abs(number) < math.inf:
        raise PydanticCustomError("too_large", "too large")
    return number


def _type(setting: Setting) -> Any:
    """The annotation by which pydantic checks the value of a setting and converts it to SI."""
    kind: Any
    if table := setting.table:
        kind = Annotated[_model(table), AfterValidator(lambda model: _made(table, model))]
    elif setting.kind is float:
        si = AfterValidator(lambda number: number * setting.unit.si + 0.0)  # -0.0 becomes 0.0
        kind = Annotated[float, Strict(), AllowInfNan(setting.infinite), *setting.bounds, AfterValidator(_sized), si]
        if setting.infinite:  # JSON has no infinity
            kind = Annotated[kind, BeforeValidator(lambda given: math.inf if given == "inf" else given)]
    elif setting.kind in (int, bool, str):
        kind = Annotated[setting.kind, Strict(), *setting.bounds]
    else:
        kind = setting.kind
    if setting.length is not None:
        kind = GenericAlias(tuple, (kind, ...) if setting.length is ... else (kind,) * setting.length)
    return kind | None if setting.optional else kind
