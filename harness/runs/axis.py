"""An axis of a matrix: the values that a key takes, or keys that vary together; and what is drawn from the seed."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

FORMS = (
    "a list, { start, count }, { from, to, step }, { speed_mps, towards_deg }, { uniform = [a, b] } or "
    "{ normal = [mean, deviation] }"
)
_MOST = 10_000_000  # values of an axis


@dataclass(frozen=True, slots=True)
class Axis:
    """The values of one key, or of several that vary together."""

    keys: tuple[str, ...]
    values: Sequence[Any]  # of several keys, each a list with one for each key
    lines: Sequence[int]  # where each stands; one for all that stand together

    def __len__(self) -> int:
        return len(self.values)

    def at(self, i: int) -> Iterator[tuple[str, object]]:
        """Each key with its i-th value."""
        value = self.values[i]
        return zip(self.keys, value if len(self.keys) > 1 else (value,), strict=True)

    def line(self, i: int) -> int:
        """Where the i-th value stands."""
        return self.lines[min(i, len(self.lines) - 1)]

    def choices(self) -> dict[str, Sequence[Any]]:
        """All values of each key."""
        if len(self.keys) == 1:
            return {self.keys[0]: self.values}
        return {key: [value[i] for value in self.values] for i, key in enumerate(self.keys)}

    def only(self, keys: Sequence[str]) -> "Axis":
        """The axis with these of its keys."""
        if len(keys) == len(self.keys):
            return self
        kept = [self.choices()[key] for key in keys]
        return Axis(tuple(keys), kept[0] if len(kept) == 1 else list(zip(*kept, strict=True)), self.lines)


@dataclass(frozen=True, slots=True)
class Draw:
    """A value drawn for each seed: uniform between a and b, or normal with mean a and deviation b; of vectors, each."""

    key: str
    kind: str
    a: Any
    b: Any
    line: int

    def value(self, noise: np.random.Generator) -> float | list[float]:
        """The value that this stream of random numbers gives."""
        a, b = np.asarray(self.a, float), np.asarray(self.b, float)
        drawn = (
            a + (b - a) * noise.random(a.shape) if self.kind == "uniform" else a + b * noise.standard_normal(a.shape)
        )
        value: float | list[float] = drawn.tolist()
        return value


def flattened(table: Mapping[str, object]) -> Iterator[tuple[tuple[str, ...], str, object]]:
    """Every entry of a table of axes: its key as it stands in the file, the dotted name, the value.

    `"law.gains" = [...]` and `law.gains = [...]` are the same.
    """
    for key, value in table.items():
        if isinstance(value, Mapping) and not _is_form(value):
            for inner_key, name, inner in flattened(value):
                yield (key, *inner_key), f"{_named(key)}.{name}", inner
        else:
            yield (key,), _named(key), value


def _named(key: str) -> str:
    return ", ".join(part.strip().removeprefix("flight.") for part in key.split(","))


_FORMS = ({"start", "count"}, {"from", "to", "step"}, {"speed_mps", "towards_deg"}, {"uniform"}, {"normal"})
_MARKS = set().union(*_FORMS) - {"speed_mps"}  # which is a key of [flight.target] too


def _is_form(table: Mapping[str, object]) -> bool:
    """Whether a table describes values, if perhaps mistyped, and is no table of further keys."""
    return not _MARKS.isdisjoint(table) and not any(isinstance(value, Mapping) for value in table.values())


def axis(name: str, value: object, *, lists: bool, line: Callable[[int], int]) -> Axis | Draw:
    """The axis of an entry. A list is its values, or, without `lists`, one value. ValueError says what is wrong."""
    keys = tuple(name.split(", "))
    if not all(word for key in keys for word in key.split(".")):
        raise ValueError("the key must be a dotted name below [flight], as in law.gains, or several with commas")
    if isinstance(value, Mapping):
        if len(keys) > 1:
            raise ValueError("keys that vary together need a list of lists, one value for each key")
        return _form(keys[0], value, line(0))
    if not isinstance(value, list):
        if lists:
            raise ValueError(f"is {value!r}, must be {FORMS}")
        value = [value]
    elif not lists:
        value = [value]
    if not value:
        raise ValueError("the list is empty: no flight is left")
    if len(keys) == 1:
        return Axis(keys, value, [line(i) for i in range(len(value))])
    for i, element in enumerate(value):
        if not (isinstance(element, list) and len(element) == len(keys)):
            raise ValueError(f"element {i + 1} is {element!r}, must be a list of {len(keys)}: {name}")
    return Axis(keys, value, [line(i) for i in range(len(value))])


def _form(key: str, table: Mapping[str, Any], line: int) -> Axis | Draw:
    """The values that a table describes."""
    if set(table) not in _FORMS:
        raise ValueError(f"has the keys {', '.join(sorted(table))}, must be {FORMS}")
    if "start" in table:
        start, count = (_whole(table, name) for name in ("start", "count"))
        if not 1 <= count <= _MOST:
            raise ValueError(f"count is {count}, must be from 1 to {_MOST}")
        return Axis((key,), range(start, start + count), [line])
    if "from" in table:
        return Axis((key,), _range(table), [line])
    if "towards_deg" in table:
        speeds, ways = (_numbers(table, name) for name in ("speed_mps", "towards_deg"))
        winds = [
            [round(speed * f(math.radians(way)), 12) + 0.0 for f in (math.cos, math.sin)]
            for speed in speeds
            for way in (ways if speed else ways[:1])  # still air has no direction
        ]
        return Axis((key,), winds, [line])
    kind = "uniform" if "uniform" in table else "normal"
    a, b = _two(table, kind)
    return Draw(key, kind, a, b, line)


def _range(table: Mapping[str, Any]) -> Sequence[float]:
    first, last, step = (_number(table, name) for name in ("from", "to", "step"))
    if step == 0.0 or (last - first) / step < 0.0:
        raise ValueError(f"step is {step:g}, must lead from {first:g} to {last:g}")
    count = math.floor((last - first) / step * (1.0 + 1e-12) + 1e-9) + 1
    if count > _MOST:
        raise ValueError(f"has {count} values, must be {_MOST} at most")
    if all(isinstance(table[name], int) for name in ("from", "to", "step")):
        return [int(first) + i * int(step) for i in range(count)]
    return [float(f"{first + i * step:.12g}") for i in range(count)]


def _whole(table: Mapping[str, Any], name: str) -> int:
    value = table[name]
    if not isinstance(value, int) or isinstance(value, bool):
        raise ValueError(f"{name} is {value!r}, must be a whole number")
    return value


def _number(table: Mapping[str, Any], name: str) -> float:
    return _finite(table[name], name)


def _numbers(table: Mapping[str, Any], name: str) -> list[float]:
    value = table[name]
    if not isinstance(value, list) or not value:
        raise ValueError(f"{name} is {value!r}, must be a list of numbers")
    return [_finite(v, name) for v in value]


def _two(table: Mapping[str, Any], kind: str) -> tuple[Any, Any]:
    """Two numbers, or two vectors of equal length."""
    value = table[kind]
    wanted = f"{kind} is {value!r}, must be two numbers, or two lists of as many numbers"
    if not isinstance(value, list) or len(value) != 2:
        raise ValueError(wanted)
    a, b = value
    if isinstance(a, list) != isinstance(b, list) or (isinstance(a, list) and (len(a) != len(b) or not a)):
        raise ValueError(wanted)
    for one in (*a, *b) if isinstance(a, list) else (a, b):
        _finite(one, kind)
    if kind == "normal" and any(deviation < 0 for deviation in (b if isinstance(b, list) else [b])):
        raise ValueError(f"the deviation is {b!r}, must be >= 0")
    return a, b


def _finite(value: object, name: str) -> float:
    if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
        raise ValueError(f"{name} is {value!r}, must be a finite number")
    return float(value)
