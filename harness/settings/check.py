"""The check of a table that a file holds, with pydantic, and what is made of it."""

import math
from collections.abc import Mapping
from functools import cache
from types import GenericAlias
from typing import Annotated, Any

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

from harness.settings.mistake import LARGEST, Places, mistake, settings_error
from harness.settings.table import Setting, Table


def checked(table: Table, document: Mapping[str, object], place: Places) -> object:
    """What the document makes, in SI. Raises `SettingsError` with every mistake."""
    try:
        return _made(table, _model(table).model_validate(document))
    except ValidationError as error:
        raise settings_error([mistake(table, document, details) for details in error.errors()], place) from None


@cache
def _model(table: Table) -> type[BaseModel]:
    keys: dict[str, Any] = {key: (_type(s), ... if s.required else None) for key, s in table.settings.items()}
    return create_model("Table", __config__=ConfigDict(extra="ignore" if table.open else "forbid"), **keys)


def _made(table: Table, model: BaseModel) -> object:
    given = model.model_fields_set
    return table.make(**{s.name: getattr(model, key) for key, s in table.settings.items() if key in given})


def _sized(number: float) -> float:
    """The number, unless it is so large that what is computed from it would not be finite."""
    if LARGEST < abs(number) < math.inf:
        raise PydanticCustomError("too_large", "too large")
    return number


def _type(setting: Setting) -> Any:
    """The annotation that pydantic checks the value by, and makes it SI."""
    one: Any
    if table := setting.table:
        one = Annotated[_model(table), AfterValidator(lambda model: _made(table, model))]
    elif setting.kind is float:
        si = AfterValidator(lambda number: number * setting.unit.si)
        one = Annotated[float, Strict(), AllowInfNan(setting.infinite), *setting.bounds, AfterValidator(_sized), si]
        if setting.infinite:  # JSON has no infinity
            one = Annotated[one, BeforeValidator(lambda given: math.inf if given == "inf" else given)]
    elif setting.kind in (int, bool, str):
        one = Annotated[setting.kind, Strict(), *setting.bounds]
    else:
        one = setting.kind
    if setting.length is not None:
        one = GenericAlias(tuple, (one, ...) if setting.length is ... else (one,) * setting.length)
    return one | None if setting.optional else one
