"""The border at which an answer changes over a square: the points to evaluate next, and the border known so far.

The square is a lattice. Its coarse points come first. Then, in every square of the coarse lattice on whose edges the
answer changes: each change is halved until it lies between two neighbours; two points beside the middle of the line
between two changes, one step off it, test whether the border is that line; where it is another one, the square is
divided into four. So a straight border costs few flights, a curved one more, and what enters a square through an edge
is followed. What lies between the coarse points and touches no edge that was divided is missed.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple, TypeGuard

import numpy as np
from numpy.typing import NDArray

Answer = float | bool | str | None  # None: unknown, which is an answer of its own
Point = tuple[int, int]  # steps along x and y

_LEAST = 10  # coarse squares along a side
_DIVIDED = 8  # steps in the side of a coarse square
JUMP = 0.1  # share of the range of a number over the coarse points: a larger step between neighbours is a border
_DECADES = 100.0  # a number with a larger ratio of largest to least value is taken logarithmically


class Square(NamedTuple):
    """A square of the lattice that is not divided further: its corner, its side, and between which points it changes.

    `open`: what lies in it is not located yet.
    """

    x: int
    y: int
    side: int
    changes: tuple[tuple[Point, Point], ...]
    open: bool = False

    @property
    def line(self) -> tuple[tuple[float, float], tuple[float, float]] | None:
        """The border in it, from one change to the other; None where it is not one line."""
        if self.open or len(self.changes) != 2:
            return None
        (a, b), (c, d) = self.changes
        return ((a[0] + b[0]) / 2, (a[1] + b[1]) / 2), ((c[0] + d[0]) / 2, (c[1] + d[1]) / 2)


class Scale(NamedTuple):
    """How far apart two answers are: words by being different, numbers by their distance."""

    low: float = 0.0
    reach: float = 0.0
    by_factors: bool = False

    @classmethod
    def of(cls, answers: Sequence[Answer]) -> "Scale":
        """The scale of the numbers among these answers."""
        numbers = [each for each in answers if _is_number(each)]
        if not numbers:
            return cls()
        low, high = float(min(numbers)), float(max(numbers))
        if low > 0.0 and high > _DECADES * low:
            return cls(low, math.log(high / low), by_factors=True)
        return cls(low, high - low)

    def share(self, answer: float) -> float:
        """Where a number lies, 0 at the least of those that made the scale, 1 at the largest."""
        if not self.reach:
            return 0.0
        return (math.log(max(answer, 1e-300) / self.low) if self.by_factors else answer - self.low) / self.reach

    def differ(self, a: Answer, b: Answer) -> bool:
        """Whether there is a border between the two."""
        if _is_number(a) and _is_number(b):
            return abs(self.share(a) - self.share(b)) > JUMP
        return a != b


@dataclass(slots=True)
class BorderSearch:
    """A search for the border of an answer over a square, by asking and telling."""

    side: int  # steps along each side of the lattice
    coarse: int  # steps between its coarse points
    answers: dict[Point, Answer] = field(default_factory=dict)
    scale: Scale = Scale()
    _is_scaled: bool = False

    @classmethod
    def of(cls, resolution: int) -> "BorderSearch":
        """A search that locates a border to 1/`resolution` of the side, at least."""
        squares = max(_LEAST, -(-resolution // _DIVIDED))
        steps = 1
        while squares * steps < resolution:
            steps *= 2
        return cls(squares * steps, steps)

    @property
    def first(self) -> list[Point]:
        """The coarse points."""
        at = range(0, self.side + 1, self.coarse)
        return [(x, y) for y in at for x in at]

    @property
    def is_begun(self) -> bool:
        """Whether the coarse points are known."""
        return all(point in self.answers for point in self.first)

    def asked(self) -> list[Point]:
        """The points to evaluate next, in order; empty when the border is located."""
        if missing := [point for point in self.first if point not in self.answers]:
            return missing
        return sorted({point for _, asked in self._visited() for point in asked})

    def squares(self) -> list[Square]:
        """The squares that are not divided further. Without the coarse points: none."""
        if not self.is_begun:
            return []
        return [square for square, _ in self._visited() if square is not None]

    def _visited(self) -> Iterator[tuple[Square | None, Sequence[Point]]]:
        if not self._is_scaled:
            self.scale, self._is_scaled = Scale.of([self.answers[point] for point in self.first]), True
        for x, y in self.first:
            if x < self.side and y < self.side:
                yield from self._visit(x, y, self.coarse)

    def _visit(self, x: int, y: int, side: int) -> Iterator[tuple[Square | None, Sequence[Point]]]:
        """The state of a square, and the points to evaluate in it."""
        around = _around(x, y, side)
        known = [point for point in around if point in self.answers]
        changes = tuple((a, b) for a, b in pairwise((*known, known[0])) if self._differ(a, b))
        if not changes:
            yield Square(x, y, side, ()), ()
            return
        wide = [((a[0] + b[0]) // 2, (a[1] + b[1]) // 2) for a, b in changes if _distance(a, b) > 1]
        if wide:
            yield Square(x, y, side, changes, open=True), wide
            return
        square = Square(x, y, side, changes)
        if side == 1:
            yield square, ()
            return
        if beside := _beside(square):
            if missing := [point for point in beside if point not in self.answers]:
                yield square._replace(open=True), missing
                return
            if self._differ(*beside):
                yield square, ()
                return
        half = side // 2
        corners = [(x + i * half, y + j * half) for j in range(3) for i in range(3)]
        if missing := [point for point in corners if point not in self.answers]:
            yield square._replace(open=True), missing
            return
        for corner in ((x, y), (x + half, y), (x, y + half), (x + half, y + half)):
            yield from self._visit(*corner, half)

    def _differ(self, a: Point, b: Point) -> bool:
        return self.scale.differ(self.answers[a], self.answers[b])

    def filled(self) -> NDArray[np.object_]:
        """The expected answer at every point of the lattice, by row (y) and column (x); ... if not located.

        A number is interpolated where no border is.
        """
        filled = np.full((self.side + 1, self.side + 1), ..., dtype=object)
        for square in sorted(self.squares(), key=lambda square: square.open, reverse=True):
            self._fill(filled, square)
        for (x, y), answer in self.answers.items():
            filled[y, x] = answer
        return filled

    def _fill(self, filled: NDArray[np.object_], square: Square) -> None:
        x, y, side, *_ = square
        points = [(x + i, y + j) for j in range(side + 1) for i in range(side + 1)]
        if square.open:
            for at in points:
                filled[at[1], at[0]] = ...
            return
        corners = [self.answers[point] for point in ((x, y), (x + side, y), (x, y + side), (x + side, y + side))]
        known = [point for point in points if point in self.answers]
        for at in points:
            if not square.changes and all(_is_number(corner) for corner in corners):
                u, v = (at[0] - x) / side, (at[1] - y) / side
                weights = ((1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v)
                filled[at[1], at[0]] = sum(w * float(c or 0.0) for w, c in zip(weights, corners, strict=True))
                continue
            same = [point for point in known if _is_beyond(square, point) == _is_beyond(square, at)]
            nearest = min(same or known, key=lambda point: math.dist(point, at))
            filled[at[1], at[0]] = self.answers[nearest]


def lines(squares: Sequence[Square]) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """The located border as lines; where more than two changes meet in a step, from their middle to each."""
    found = []
    for square in squares:
        if square.line:
            found.append(square.line)
        elif not square.open and square.changes:
            middle = (square.x + square.side / 2, square.y + square.side / 2)
            found += [(middle, ((a[0] + b[0]) / 2, (a[1] + b[1]) / 2)) for a, b in square.changes]
    return found


def _around(x: int, y: int, side: int) -> list[Point]:
    """The points on the edges of a square, once around."""
    steps = range(side)
    return [
        *((x + i, y) for i in steps),
        *((x + side, y + i) for i in steps),
        *((x + side - i, y + side) for i in steps),
        *((x, y + side - i) for i in steps),
    ]


def _beside(square: Square) -> tuple[Point, Point] | None:
    """Two points of the square, one step off the middle of its line to either side; None without a line."""
    if square.line is None:
        return None
    (ax, ay), (bx, by) = square.line
    mx, my = round((ax + bx) / 2), round((ay + by) / 2)
    if abs(bx - ax) >= abs(by - ay):
        return _within(square, mx, my - 1), _within(square, mx, my + 1)
    return _within(square, mx - 1, my), _within(square, mx + 1, my)


def _within(square: Square, x: int, y: int) -> Point:
    return min(max(x, square.x), square.x + square.side), min(max(y, square.y), square.y + square.side)


def _is_beyond(square: Square, point: Point) -> bool:
    """Whether a point lies to the left of the square's line."""
    if square.line is None:
        return False
    (ax, ay), (bx, by) = square.line
    return (bx - ax) * (point[1] - ay) > (by - ay) * (point[0] - ax)


def _distance(a: Point, b: Point) -> int:
    return abs(a[0] - b[0]) + abs(a[1] - b[1])


def _is_number(answer: Answer) -> TypeGuard[float]:
    return isinstance(answer, float) and not isinstance(answer, bool)
