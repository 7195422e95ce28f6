"""An axis of a matrix: the values of one key, or of several keys that vary together; values may be random draws."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from harness.toml_text import shown

FORMS = (
    "a list, { start, count }, { from, to, step }, { speed_mps, towards_deg }, { uniform = [a, b] } or "
    "{ normal = [mean, deviation] }"
)
DRAWN_FORMS = (
    "{ uniform = [a, b] }, { normal = [mean, deviation] } or { speed_mps = v, towards_deg = { uniform = [a, b] } }"
)
_MOST_VALUES = 10_000_000  # of an axis


@dataclass(frozen=True, slots=True)
class Axis:
    """The values of one key, or of several keys that vary together."""

    keys: tuple[str, ...]
    values: Sequence[Any]  # with several keys, each is a list of one value per key; a random value is a `Draw`
    lines: Sequence[int]  # the line of each value in the file; the last one stands for all that follow
    repeated: tuple[tuple[object, int], ...] = ()  # the values that were listed again, each with its line

    def __len__(self) -> int:
        return len(self.values)

    def at(self, i: int) -> Iterator[tuple[str, object]]:
        """Each key with its i-th value."""
        value = self.values[i]
        return zip(self.keys, value if len(self.keys) > 1 else (value,), strict=True)

    def line(self, i: int) -> int:
        """The line of the i-th value in the file."""
        return self.lines[min(i, len(self.lines) - 1)]

    @property
    def draws(self) -> list[str]:
        """The keys that have a random value."""
        return [key for key, values in self.choices().items() if any(isinstance(v, Draw) for v in values)]

    def choices(self) -> dict[str, Sequence[Any]]:
        """All values of each key."""
        if len(self.keys) == 1:
            return {self.keys[0]: self.values}
        return {key: [value[i] for value in self.values] for i, key in enumerate(self.keys)}

    def only(self, keys: Sequence[str]) -> "Axis":
        """The axis reduced to these of its keys."""
        if len(keys) == len(self.keys):
            return self
        kept = [self.choices()[key] for key in keys]
        return Axis(tuple(keys), kept[0] if len(kept) == 1 else list(zip(*kept, strict=True)), self.lines).once()

    def once(self) -> "Axis":
        """The axis with each value once."""
        if isinstance(self.values, range):
            return self
        seen, first, again = set[str](), list[int](), list[int]()
        for i, value in enumerate(self.values):
            (again if (text := same(value)) in seen else first).append(i)
            seen.add(text)
        repeated = tuple((self.values[i], self.line(i)) for i in again)
        return (
            replace(
                self, values=[self.values[i] for i in first], lines=[self.line(i) for i in first], repeated=repeated
            )
            if again
            else self
        )


@dataclass(frozen=True, slots=True)
class Draw:
    """A random value, drawn for each seed: uniform between a and b, or normal with mean a and deviation b.

    Where a and b are vectors, each component is drawn on its own.
    """

    kind: str
    a: Any
    b: Any
    length: float | None = None  # if given, the draw is the direction, deg, of a vector of this length

    def value(self, noise: np.random.Generator) -> float | list[float]:
        """The value drawn from this random stream."""
        a, b = np.asarray(self.a, float), np.asarray(self.b, float)
        drawn = (
            a + (b - a) * noise.random(a.shape) if self.kind == "uniform" else a + b * noise.standard_normal(a.shape)
        )
        if self.length is not None:
            return _towards(self.length, float(drawn))
        value: float | list[float] = drawn.tolist()
        return value

    def __str__(self) -> str:
        drawn = f"{{ {self.kind} = [{self.a}, {self.b}] }}"
        return drawn if self.length is None else f"{{ speed_mps = {self.length:g}, towards_deg = {drawn} }}"


def same(value: object) -> str:
    """A text that is equal for equal values: of 1 and 1.0, and of 0.0 and -0.0, but not of 1 and true."""
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(same, value))}]"
    return repr(float(value) + 0.0 if isinstance(value, int | float) and not isinstance(value, bool) else value)


def flattened(table: Mapping[str, object]) -> Iterator[tuple[tuple[str, ...], str, object]]:
    """Every entry of a table of axes as (key in the file, dotted name, value).

    `"law.gains" = [...]` and `law.gains = [...]` have the same dotted name.
    """
    for key, value in table.items():
        if isinstance(value, Mapping) and not _is_form(value):
            for inner_key, name, inner in flattened(value):
                yield (key, *inner_key), f"{_dotted_name(key)}.{name}", inner
        else:
            yield (key,), _dotted_name(key), value


def _dotted_name(key: str) -> str:
    return ", ".join(part.strip().removeprefix("flight.") for part in key.split(","))


_FORMS = ({"start", "count"}, {"from", "to", "step"}, {"speed_mps", "towards_deg"}, {"uniform"}, {"normal"})
_FORM_KEYS = set().union(*_FORMS) - {"speed_mps"}  # without the one that is also a key of [flight.target]


def _is_form(table: Mapping[str, object]) -> bool:
    """Whether a table describes the values of an axis, perhaps with a mistake, rather than holding further keys."""
    tables = {name for name, value in table.items() if isinstance(value, Mapping)}
    return not _FORM_KEYS.isdisjoint(table) and tables <= {"towards_deg"}


def is_axis(value: object, *, of_lists: bool) -> bool:
    """Whether the value of `--set` stands for several: a list of values, or a table that describes them.

    `of_lists`: the setting is a list itself, so that only a list of lists is several values of it.
    """
    if isinstance(value, list):
        return not of_lists or (bool(value) and all(isinstance(element, list) for element in value))
    return isinstance(value, Mapping) and _is_form(value)


def axis(name: str, value: object, *, lists: bool, line: Callable[[int], int]) -> Axis:
    """The axis of an entry `name = value`. Raises ValueError, without a place, for a mistake in it.

    With `lists`, a list holds the values of the axis; without, it is one value. Any value may be one of `DRAWN_FORMS`.
    `line` gives the line in the file of the i-th value.
    """
    keys = tuple(name.split(", "))
    if not all(word for key in keys for word in key.split(".")):
        raise ValueError("the key must be a dotted name below [flight], as in law.gains, or several with commas")
    if isinstance(value, Mapping):
        if len(keys) > 1:
            raise ValueError("keys that vary together need a list of lists, one value for each key")
        return Axis(keys, _form(value), [line(0)]).once()
    if lists and not isinstance(value, list):
        raise ValueError(f"is {shown(value)}, must be {FORMS}")
    values: list[Any] = value if lists and isinstance(value, list) else [value]
    if not values:
        raise ValueError("the list is empty, must have at least one value")
    lines = [line(i) for i in range(len(values))]
    if len(keys) == 1:
        return Axis(keys, [_element(element) for element in values], lines).once()
    for i, element in enumerate(values):
        if not (isinstance(element, list) and len(element) == len(keys)):
            raise ValueError(f"element {i + 1} is {shown(element)}, must be a list of {len(keys)}: {name}")
    return Axis(keys, [[_element(of_key) for of_key in element] for element in values], lines).once()


def _element(value: object) -> object:
    """An element of a list: a plain value as it is, or the `Draw` that a form describes."""
    if not isinstance(value, Mapping) or not _is_form(value):
        return value
    form = _form(value) if set(value) in _FORMS else ()
    if len(form) != 1 or not isinstance(form[0], Draw):
        raise ValueError(f"has the keys {', '.join(sorted(value))} in a list, must be a value, {DRAWN_FORMS}")
    return form[0]


def _form(table: Mapping[str, Any]) -> Sequence[Any]:
    """The values that a table such as { from, to, step } describes."""
    if set(table) not in _FORMS:
        raise ValueError(f"has the keys {', '.join(sorted(table))}, must be {FORMS}")
    if "start" in table:
        start, count = (_integer(table, name) for name in ("start", "count"))
        if not 1 <= count <= _MOST_VALUES:
            raise ValueError(f"count is {count}, must be from 1 to {_MOST_VALUES}")
        return range(start, start + count)
    if "from" in table:
        return _range(table)
    if "towards_deg" in table:
        return _vectors(table)
    return [_draw(table)]


def _draw(table: Mapping[str, Any]) -> Draw:
    kind = "uniform" if "uniform" in table else "normal"
    return Draw(kind, *_two_numbers(table, kind))


def _vectors(table: Mapping[str, Any]) -> Sequence[Any]:
    """A vector for each speed and direction, or one with a random direction for each speed. Still air has one only."""
    speeds, directions = _numbers(table, "speed_mps"), table["towards_deg"]
    if not isinstance(directions, Mapping):
        angles = _numbers(table, "towards_deg")
        return [_towards(speed, angle) for speed in speeds for angle in (angles if speed else angles[:1])]
    if set(directions) not in ({"uniform"}, {"normal"}) or isinstance((drawn := _draw(directions)).a, list):
        forms = "{ uniform = [a, b] } or { normal = [mean, deviation] }"
        raise ValueError(f"towards_deg is {shown(directions)}, must be numbers, {forms}")
    return [replace(drawn, length=speed) if speed else _towards(0.0, 0.0) for speed in speeds]


def _towards(length: float, direction_deg: float) -> list[float]:
    """The components north and east of a vector; direction clockwise from north."""
    return [round(length * f(math.radians(direction_deg)), 12) + 0.0 for f in (math.cos, math.sin)]


def _range(table: Mapping[str, Any]) -> Sequence[float]:
    first, last, step = (_number(table, name) for name in ("from", "to", "step"))
    if step == 0.0 or (last - first) / step < 0.0:
        raise ValueError(f"step is {step:g}, must lead from {first:g} to {last:g}")
    count = math.floor((last - first) / step * (1.0 + 1e-12) + 1e-9) + 1
    if count > _MOST_VALUES:
        raise ValueError(f"has {count} values, must be {_MOST_VALUES} at most")
    if all(isinstance(table[name], int) for name in ("from", "to", "step")):
        return [int(first) + i * int(step) for i in range(count)]
    return [float(f"{first + i * step:.12g}") for i in range(count)]


def _integer(table: Mapping[str, Any], name: str) -> int:
    value = table[name]
    if not isinstance(value, int) or isinstance(value, bool):
        raise ValueError(f"{name} is {shown(value)}, must be a whole number")
    return value


def _number(table: Mapping[str, Any], name: str) -> float:
    return _finite(table[name], name)


def _numbers(table: Mapping[str, Any], name: str) -> list[float]:
    value = table[name]
    values = value if isinstance(value, list) else [value]
    if not values:
        raise ValueError(f"{name} is {shown(value)}, must be a number, or a list of numbers")
    return [_finite(v, name) for v in values]


def _two_numbers(table: Mapping[str, Any], kind: str) -> tuple[Any, Any]:
    """Two numbers, or two vectors of equal length."""
    value = table[kind]
    wrong = f"{kind} is {shown(value)}, must be two numbers, or two lists of equal length"
    if not isinstance(value, list) or len(value) != 2:
        raise ValueError(wrong)
    a, b = value
    if isinstance(a, list) != isinstance(b, list) or (isinstance(a, list) and (len(a) != len(b) or not a)):
        raise ValueError(wrong)
    for number in (*a, *b) if isinstance(a, list) else (a, b):
        _finite(number, kind)
    if kind == "normal" and any(deviation < 0 for deviation in (b if isinstance(b, list) else [b])):
        raise ValueError(f"the deviation is {shown(b)}, must be >= 0")
    return a, b


def _finite(value: object, name: str) -> float:
    if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
        raise ValueError(f"{name} is {shown(value)}, must be a finite number")
    return float(value)
