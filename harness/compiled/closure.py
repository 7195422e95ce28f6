"""What a function holds: its shape, by which functions are told apart, and the numbers in it."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from types import FunctionType, MethodType, ModuleType
from typing import Any, NamedTuple

Shape = tuple[Any, ...]  # of what a function holds: its code and module, then for each name what kind of thing it is
_NUMBERS = (float, int, bool)


class NotLiftedError(Exception):
    """The function cannot be lifted; the message says why."""


class Closure(NamedTuple):
    """A function and what it holds by name: the cells of its closure, and the object of a method."""

    function: Any
    held: Mapping[str, Any]


def closure_of(function: Any) -> Closure:
    """A function, or a method with its object. Raises `NotLiftedError` for another callable."""
    if isinstance(function, MethodType) and isinstance(function.__func__, FunctionType):
        inner = closure_of(function.__func__)
        return Closure(inner.function, {inner.function.__code__.co_varnames[0]: function.__self__, **inner.held})
    if not isinstance(function, FunctionType):
        raise NotLiftedError(f"{function!r} is no function of Python")
    cells = zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
    return Closure(function, {name: cell.cell_contents for name, cell in cells})


def held(function: Any) -> tuple[Shape, tuple[Any, ...]]:
    """The shape of what a function holds, and the numbers in it. Raises `NotLiftedError`."""
    of, kept = closure_of(function)
    shape, values = [], []
    for name, value in kept.items():
        kind, numbers = _kind(name, value)
        shape.append((name, *kind))
        if numbers is not None:
            values.append(numbers)
    module = of.__globals__.get("__name__")  # of a law of one's own by its content: equal code may mean other constants
    return ((of.__code__, module), *shape), tuple(values)


def _kind(name: str, value: Any) -> tuple[tuple[Any, ...], Any]:
    """What kind of thing a function holds, and the numbers in it; None without."""
    kind = type(value)
    if kind in _NUMBERS:
        return ("number", kind), value
    if value is None or kind is str:
        return ("constant", value), None
    if kind is FunctionType or kind is MethodType:
        shape, numbers = held(value)
        return ("function", shape), numbers or None
    if kind is tuple and value:
        return ("tuple", form(f"it holds {name}, which is", value)), value
    if is_record(kind) and all(type(x) in _NUMBERS for x in value):
        return ("record", kind.__name__, kind._fields), tuple(value)
    if is_dataclass(value) and kind.__dataclass_params__.frozen:
        own = {f.name: getattr(value, f.name) for f in fields(value) if type(getattr(value, f.name)) in _NUMBERS}
        return ("record", kind.__name__, tuple(own)), tuple(own.values())
    if callable(value) or isinstance(value, ModuleType):
        return ("constant", value), None
    raise NotLiftedError(f"it holds {name}, which is {kind.__name__}")


def form(what: str, value: Any) -> Any:
    """The type of a number, or of a tuple the forms of all in it. Raises `NotLiftedError`, which says what it is of."""
    kind = type(value)
    if kind in _NUMBERS:
        return kind
    if kind is not tuple:
        raise NotLiftedError(f"{what} {kind.__name__}")
    return tuple(form(what, each) for each in value)


def is_record(value: Any) -> bool:
    """Whether it is the class of a named tuple."""
    return isinstance(value, type) and issubclass(value, tuple) and hasattr(value, "_fields")
