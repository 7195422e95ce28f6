"""Where a part holds and where it fails: conditions that matched cells prove.

A condition is a stretch of flown values of one axis, or of two. It is named only where

- every decided cell within it has the word, and the mean of every undecided one lies on that side of its margin, and
- for each of its axes there are two cells alike in everything else, one within that has the word and one outside that
  has the opposite word.

So an axis that merely varies together with the cause is never named: the design cannot separate the two, and the
flights that would are printed instead.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, product

from harness.verdict.judgement import Judgement
from harness.verdict.pairs import is_ordered, shown
from harness.vocabulary import Verdict

Values = tuple[object, ...]


@dataclass(frozen=True, slots=True)
class Condition:
    """Where a part has a word."""

    word: Verdict
    values: Mapping[str, Values]  # axis -> flown values
    text: str
    cells: int  # within it that have the word
    of: int  # cells within it; the others are undecided

    def covers(self, at: Mapping[str, object]) -> bool:
        return all(at[axis] in values for axis, values in self.values.items())


@dataclass(frozen=True, slots=True)
class Conclusion:
    """The conclusion on a part from all cells: it holds everywhere, under a condition, or fails somewhere."""

    word: Verdict
    holds: int  # cells
    fails: int
    of: int
    condition: Condition | None = None  # where it holds, else where it fails
    confounded: tuple[str, ...] = ()  # axes that the design cannot separate
    missing: tuple[Mapping[str, object], ...] = ()  # cells that would separate them


def conclude(cells: Sequence[Judgement], across: Mapping[str, Sequence[object]]) -> Conclusion:
    """The word for the part in all these cells. Raises ValueError without cells."""
    if not cells:
        raise ValueError("no cells")
    holds, fails = (sum(cell.word == word for cell in cells) for word in (Verdict.HOLDS, Verdict.FAILS))
    of = len(cells)
    if not fails:
        return Conclusion(Verdict.HOLDS if holds == of else Verdict.UNDECIDED, holds, fails, of)
    if not holds:
        return Conclusion(Verdict.FAILS, holds, fails, of)
    if condition := _best(cells, across, Verdict.HOLDS):
        return Conclusion(Verdict.HOLDS_IF, holds, fails, of, condition)
    if condition := _best(cells, across, Verdict.FAILS):
        return Conclusion(Verdict.FAILS, holds, fails, of, condition)
    return Conclusion(Verdict.FAILS, holds, fails, of, None, *_untold(cells))


def _best(cells: Sequence[Judgement], across: Mapping[str, Sequence[object]], word: Verdict) -> Condition | None:
    """The condition that covers most cells with the word; of equals the one of fewer axes, then of more values."""
    agree, have = _bits([_agrees(cell, word) for cell in cells]), _bits([cell.word == word for cell in cells])
    opposites = _opposites(cells, across, word)
    proved = [
        Condition(word, values, _and(values, across), (inside & have).bit_count(), inside.bit_count())
        for values, inside in _candidates(cells, across)
        if not inside & ~agree and inside & have and all(_matters(values, axis, inside, opposites) for axis in values)
    ]
    return max(proved, key=lambda c: (c.cells, -len(c.values), sum(map(len, c.values.values()))), default=None)


def _candidates(
    cells: Sequence[Judgement], across: Mapping[str, Sequence[object]]
) -> Iterator[tuple[Mapping[str, Values], int]]:
    """Stretches of the flown values of one axis, and of two, each with a bit for every cell within."""
    stretches = {}
    for axis, values in across.items():
        flown = [value for value in values if any(cell.at[axis] == value for cell in cells)]
        if len(flown) > 1:
            stretches[axis] = [(some, _bits([cell.at[axis] in some for cell in cells])) for some in _stretches(flown)]
    for axis, some in stretches.items():
        for values, inside in some:
            yield {axis: values}, inside
    for (first, some), (second, others) in combinations(stretches.items(), 2):
        for (values, inside), (more, there) in product(some, others):
            yield {first: values, second: more}, inside & there


def _bits(these: Sequence[bool]) -> int:
    """A number with a bit for each that is true."""
    return sum(1 << place for place, is_so in enumerate(these) if is_so)


def _stretches(values: Sequence[object]) -> Iterator[Values]:
    """Neighbouring values of an ordered axis, any of the others; never all of them."""
    if is_ordered(values):
        for begin in range(len(values)):
            for end in range(begin + 1, len(values) + 1):
                if end - begin < len(values):
                    yield tuple(values[begin:end])
    else:
        for size in range(1, len(values)):
            yield from combinations(values, size)


Opposites = Mapping[str, Sequence[tuple[int, Values]]]


def _opposites(cells: Sequence[Judgement], across: Mapping[str, Sequence[object]], word: Verdict) -> Opposites:
    """For each axis the cells with the word, by their bit, and where on the axis matched cells have the opposite."""
    opposite = Verdict.FAILS if word == Verdict.HOLDS else Verdict.HOLDS
    others = [cell for cell in cells if cell.word == opposite]
    having = [(1 << place, cell) for place, cell in enumerate(cells) if cell.word == word]
    found = {
        axis: [(bit, tuple(b.at[axis] for b in others if _matched(a, b, axis))) for bit, a in having] for axis in across
    }
    return {axis: [pair for pair in pairs if pair[1]] for axis, pairs in found.items()}


def _matters(values: Mapping[str, Values], axis: str, inside: int, opposites: Opposites) -> bool:
    """Whether a cell inside with the word has a matched one of the opposite word, outside on this axis."""
    return any(inside & bit and any(at not in values[axis] for at in there) for bit, there in opposites[axis])


def _and(values: Mapping[str, Values], across: Mapping[str, Sequence[object]]) -> str:
    return " and ".join(_text(axis, some, across[axis]) for axis, some in values.items())


def _agrees(cell: Judgement, word: Verdict) -> bool:
    """Whether the cell has the word, or is undecided with a mean on that side of its margin."""
    if cell.word == Verdict.UNDECIDED:
        return (cell.use <= 1.0) is (word == Verdict.HOLDS)
    return cell.word == word


def _matched(first: Judgement, second: Judgement, axis: str) -> bool:
    """Whether two cells are alike in everything but this axis."""
    return all(second.at[name] == value for name, value in first.at.items() if name != axis)


def _text(axis: str, some: Values, values: Sequence[object]) -> str:
    if len(some) == 1:
        return f"{axis} = {shown(some[0])}"
    if is_ordered(values):
        return f"{axis} = {shown(some[0])} to {shown(some[-1])}"
    return f"{axis} = {' or '.join(map(shown, some))}"


def _untold(cells: Sequence[Judgement]) -> tuple[tuple[str, ...], tuple[Mapping[str, object], ...]]:
    """The axes in which the most similar cells of opposite words differ, and the cells in between that were not flown.

    Empty where they differ in one axis: then the axis matters there, though no range of its values is decided.
    """
    holding = [cell for cell in cells if cell.word == Verdict.HOLDS]
    failing = [cell for cell in cells if cell.word == Verdict.FAILS]
    first, second = min(product(holding, failing), key=lambda pair: len(_apart(*pair)))
    apart = _apart(first, second)
    if len(apart) < 2:
        return (), ()
    flown = [dict(cell.at) for cell in cells]
    between = [{**first.at, axis: second.at[axis]} for axis in apart]
    return tuple(apart), tuple(cell for cell in between if cell not in flown)


def _apart(first: Judgement, second: Judgement) -> list[str]:
    return [axis for axis, value in first.at.items() if second.at[axis] != value]
