"""A matrix of flights: the product of axes over keys of [flight], expanded one flight at a time, in a fixed order."""

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, NamedTuple

from harness.flight import Flight
from harness.key import hashed
from harness.runs.axis import Axis, Draw, axis, flattened, is_axis, same
from harness.settings import Experiment, SettingsError, SettingsFile, flight_from_document, put
from harness.settings.keys import is_list
from harness.settings.mended import TOLD
from harness.settings.toml_locator import Key, nearest_line
from harness.toml_text import shown
from harness.world.randomness import stream


class Shard(NamedTuple):
    """One of several parts of a matrix, for one of several machines."""

    number: int  # from 1
    of: int


class Combination(NamedTuple):
    """One unchecked flight of a matrix: a value for each key of each axis, in file units."""

    position: int  # in the matrix; excluded combinations count too
    values: Mapping[str, object]
    lines: Mapping[str, int]  # the line of each value in the file
    drawn: frozenset[str]  # the keys whose value was drawn from the seed


@dataclass(frozen=True, slots=True)
class Block:
    """A product of axes; the last one varies fastest."""

    axes: Sequence[Axis]

    def __len__(self) -> int:
        return math.prod(map(len, self.axes))


@dataclass(frozen=True, slots=True)
class Matrix:
    """All flights of an experiment's file: the block of [matrix], then one block per [[include]].

    With a `shard` only its part: flights that differ only in the plant are in the same part.
    """

    file: SettingsFile
    experiment: Experiment
    blocks: Sequence[Block]
    excluded: Sequence[Mapping[str, object]]
    given: Mapping[str, object]  # axes of the command line: the values as `--set` gives them
    mistakes: Sequence[str] = ()  # only in a draft
    mistaken: Mapping[str, int] = field(default_factory=dict)  # the keys of their axes, each with its line
    shard: Shard | None = None

    @property
    def positions(self) -> int:
        """The number of combinations; excluded ones, and those of other shards, count too."""
        return sum(len(block) for block in self.blocks)

    @property
    def draws(self) -> list[str]:
        """The keys that have a value drawn from the seed."""
        return list(dict.fromkeys(key for block in self.blocks for a in block.axes for key in a.draws))

    @property
    def repeated(self) -> Iterator[str]:
        """A sentence on each value that is listed more than once."""
        axes = {id(a): a for block in self.blocks for a in block.axes}  # one of the command line is in every block
        for a in axes.values():
            for value, line in a.repeated:
                place = f"{self.file.path}:{line}: {', '.join(a.keys)}" if line else f"--set {', '.join(a.keys)}"
                yield f"{place}: lists {shown(value)} more than once; it is flown and counted once"

    @property
    def identifier(self) -> str:
        """A hash of the matrix: where it is equal, equal positions have equal settings."""
        tables = {name: self.file.document.get(name) for name in ("flight", "matrix", "exclude", "include")}
        tables["overrides"] = sorted(".".join(map(str, key)) for key in self.file.overrides)
        if self.given:
            tables["given"] = self.given
        return hashed({**_plain(tables), "positions": self.positions, "folder": str(self.file.path.parent.absolute())})

    def __len__(self) -> int:
        """The number of flights."""
        if not self.excluded and not self.shard:
            return self.positions
        return sum(1 for _ in self.combinations())

    def combinations(self) -> Iterator[Combination]:
        """The combinations that are flown, lazily."""
        candidates = map(self.at, range(self.positions))
        return (combination for combination in candidates if combination is not None)

    def has(self, position: int) -> bool:
        """Whether the position belongs to the shard."""
        return self.shard is None or self.group(position) % self.shard.of == self.shard.number - 1

    def at(self, position: int) -> Combination | None:
        """The combination at a position; None where it is excluded, or belongs to another shard."""
        if not self.has(position):
            return None
        place = position
        number = 0
        while place >= len(self.blocks[number]):
            place, number = place - len(self.blocks[number]), number + 1
        block = self.blocks[number]
        values: dict[str, object] = {}
        lines: dict[str, int] = {}
        for a in reversed(block.axes):
            place, i = divmod(place, len(a))
            values.update(a.at(i))
            lines.update(dict.fromkeys(a.keys, a.line(i)))
        if number == 0 and any(all(values.get(k) == v for k, v in table.items()) for table in self.excluded):
            return None
        seed = _seed(values.get("seed", _table(self.file.document, "flight").get("seed", 0)))
        draws = {key: value for key, value in values.items() if isinstance(value, Draw)}
        values |= {key: draw.value(stream(seed, f"matrix:{key}")) for key, draw in draws.items()}
        return Combination(position, values, lines, frozenset(draws))

    @property
    def varies(self) -> dict[str, int]:
        """The number of values of each axis, by its key; keys that vary together are joined by commas."""
        axes: dict[str, set[object]] = {}
        for block in self.blocks:
            for a in block.axes:
                values = a.values if isinstance(a.values, range) else map(same, a.values)
                axes.setdefault(", ".join(a.keys), set()).update(values)
        return {keys: len(values) for keys, values in axes.items()}

    def group(self, position: int) -> int:
        """The number of a group: flights that differ in the plant alone have the same."""
        place, group = position, 0
        for block in self.blocks:
            if place >= len(block):
                place, group = place - len(block), group + len(block)
                continue
            size = 1
            for a in reversed(block.axes):
                place, i = divmod(place, len(a))
                if a.keys != ("plant",):
                    group, size = group + i * size, size * len(a)
            return group
        raise IndexError(position)

    def flight(self, combination: Combination, *, started: bool = False) -> Flight:
        """The flight of a combination. Raises `SettingsError` with the line of each value that is wrong.

        With `started` the error also says whether the flight could start, were it not for its other mistakes.
        """
        try:
            return flight_from_document(self._document(combination)["flight"], self.file.path.parent, run=True)
        except SettingsError:
            return self.located(combination).flight(started=started)  # raises the same, with its place

    def located(self, combination: Combination) -> SettingsFile:
        """The combination as a settings file of one flight, in which each value has its line in the matrix."""
        values = {**self.mistaken, **combination.lines}
        lines: dict[Key, int] = {("flight", *key.split(".")): line for key, line in values.items()}
        return replace(self.file, document=self._document(combination), lines={**self.file.lines, **lines})

    def _document(self, combination: Combination) -> dict[str, Any]:
        document: dict[str, Any] = {"flight": deepcopy(_table(self.file.document, "flight"))}
        for key, value in {**dict.fromkeys(self.mistaken, TOLD), **combination.values}.items():
            try:
                put(document, key, value)
            except SettingsError as error:
                at = {**self.mistaken, **combination.lines}[key]
                raise SettingsError([f"{self.file.path}:{at}: matrix.{key}: {error}"]) from None
        return document


def read_matrix(file: SettingsFile, *, draft: bool = False) -> Matrix:
    """The matrix of a file; a file without [matrix] gives a matrix of one flight. Raises `SettingsError`.

    A key that `--set` gives is no axis of the file: it has that value in every flight. Several values, as in
    `--set law.k2=[1,2,3]`, are an axis themselves.

    A `draft` keeps its mistakes, for `survey`, which reports them together with those of the flights.
    """
    experiment, mistakes = file.draft()
    is_table = isinstance(file.document.get("flight"), Mapping)
    mistaken = {} if is_table else dict.fromkeys(("plant", "law.name"), 0)  # missing with it
    fixed = [key[1:] for key in file.overrides]
    file, given, more = _given(file, mistakes, mistaken)
    blocks = [
        _block(file, at, table, more, lists=lists, fixed=fixed, mistakes=mistakes, mistaken=mistaken)
        for at, table, lists in (
            (("matrix",), experiment.matrix, True),
            *((("include", i), table, False) for i, table in enumerate(experiment.include)),
        )
    ]
    excluded = [
        checked
        for i, table in enumerate(experiment.exclude)
        if (checked := _exclusion(file, ("exclude", i), table, blocks[0], fixed, mistakes, mistaken))
    ]
    if mistakes and not draft:
        raise SettingsError(mistakes)
    return Matrix(file, experiment, blocks, excluded, given, mistakes, mistaken)


def _given(
    file: SettingsFile, mistakes: list[str], mistaken: dict[str, int]
) -> tuple[SettingsFile, Mapping[str, object], list[Axis]]:
    """The file without the overrides that stand for several values, these values by key, and their axes."""
    document = deepcopy(dict(file.document))
    given: dict[str, object] = {}
    axes = []
    for key, text in file.overrides.items():
        table: Any = document
        for word in key[:-1]:
            table = table[word]
        name = ".".join(map(str, key[1:]))
        if key[0] != "flight" or not is_axis(table[key[-1]], of_lists=is_list(name)):
            continue
        given[name] = table.pop(key[-1])
        try:
            axes.append(axis(name, given[name], lists=True, line=lambda _: 0))
        except ValueError as error:
            mistakes.append(f"{text}: {error}")
            mistaken[name] = 0  # the place of an override is the override
    return replace(file, document=document), given, axes


def _block(
    file: SettingsFile,
    at: Key,
    table: Mapping[str, object],
    given: Sequence[Axis],
    *,
    lists: bool,
    fixed: Sequence[Key],
    mistakes: list[str],
    mistaken: dict[str, int],
) -> Block:
    axes = [*given]
    seen: set[str] = set()
    for key, name, value in flattened(table):
        where = (*at, *key)
        try:
            made = axis(name, value, lists=lists, line=partial(_line, file, where))
        except ValueError as error:
            mistakes.append(f"{file.path}:{_line(file, where)}: {'.'.join(map(str, at))}.{name}: {error}")
            keys = [key for key in name.split(", ") if all(key.split("."))]
            mistaken |= dict.fromkeys(keys, _line(file, where))
            continue
        if twice := seen.intersection(made.keys):
            mistakes.append(
                f"{file.path}:{_line(file, where)}: {at[0]}.{name}: {', '.join(sorted(twice))} is an axis already"
            )
        seen.update(made.keys)
        if free := [key for key in made.keys if not _is_fixed(key, fixed)]:
            axes.append(made.only(free))
    axes.sort(key=lambda a: a.keys == ("plant",))  # the plant fastest: pairs are complete early
    return Block(axes)


def _exclusion(
    file: SettingsFile,
    at: Key,
    table: Mapping[str, object],
    block: Block,
    fixed: Sequence[Key],
    mistakes: list[str],
    mistaken: Collection[str],
) -> Mapping[str, object]:
    """The values of an exclusion by key, without what `--set` gives all flights; empty if it excludes none of them."""
    choices = {key: values for a in block.axes for key, values in a.choices().items()}
    checked = {}
    for key, name, value in flattened(table):
        place = f"{file.path}:{_line(file, (*at, *key))}: exclude.{name}"
        if name not in choices:
            if _is_fixed(name, fixed) and _of_all(file, name) == value:
                continue
            if name in mistaken or _is_fixed(name, fixed):
                return {}
            known = ", ".join(sorted(choices)) or "none"
            mistakes.append(f"{place}: is not an axis of [matrix] with listed values, must be one of: {known}")
        elif value not in choices[name]:
            listed = ", ".join(map(shown, choices[name][:8])) + (", ..." if len(choices[name]) > 8 else "")
            mistakes.append(f"{place}: is {shown(value)}, which excludes nothing, must be one of {listed}")
        else:
            checked[name] = value
    return checked


def _is_fixed(name: str, fixed: Sequence[Key]) -> bool:
    """Whether `--set` gives this key or a table that contains it."""
    words = tuple(name.split("."))
    return any(words[: len(key)] == key for key in fixed)


def _of_all(file: SettingsFile, name: str) -> object:
    """The value of a key in [flight]; None where it has none."""
    value: object = _table(file.document, "flight")
    for word in name.split("."):
        value = value.get(word) if isinstance(value, Mapping) else None
    return value


def _line(file: SettingsFile, key: Key, element: int | None = None) -> int:
    return nearest_line(file.lines, key if element is None else (*key, element))


def _seed(value: object) -> int:
    """The seed to draw from; 0 for an invalid one, which the check of the flight reports."""
    return value if isinstance(value, int) and value >= 0 else 0


def _table(document: Mapping[str, object], name: str) -> Mapping[str, Any]:
    table = document.get(name, {})
    return table if isinstance(table, Mapping) else {}


def _plain(tables: object) -> Any:
    """The tables in a form that JSON can hold: dates and infinities become text."""
    if isinstance(tables, Mapping):
        return {str(key): _plain(value) for key, value in tables.items()}
    if isinstance(tables, list | tuple):
        return [_plain(value) for value in tables]
    finite = isinstance(tables, float) and math.isfinite(tables)
    return tables if finite or isinstance(tables, int | str | None) else str(tables)
