"""Tables for a terminal and for Markdown, and how a number is written in their cells."""

import math
import re
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from contextvars import ContextVar
from itertools import zip_longest

WIDTH: ContextVar[int | None] = ContextVar("WIDTH", default=None)  # characters of the terminal; None: no limit
_BETWEEN = "  "  # two columns
_NARROWEST = 24  # characters of a column of text that is wrapped


def table(headings: Sequence[str], rows: Iterable[Sequence[str]], alignment: str = "l") -> Iterator[str]:
    r"""The lines of a table, to be printed one by one. Nothing is ever cut.

    `headings`: one for each column; "\n" within one begins a new line of it. Without headings: rows alone.
    `rows`: the cells, already text (see `number`). A row may be shorter than the headings.
    `alignment`: "l" or "r" for each column; the last letter counts for all further ones, so that "lr" is a column of
    names and then numbers.

    Where `WIDTH` says how wide the terminal is, a last column of text is wrapped, and a table that is still wider is
    printed in parts one below the other, each of which begins with the names of its rows.

    >>> for line in table(["law", "settles\ns"], [["smc", number(43.21)]], "lr"):
    ...     click.echo(line)
    """
    head = [heading.split("\n") for heading in headings]
    height = max(map(len, head), default=0)
    above = list(zip(*([""] * (height - len(words)) + words for words in head), strict=True))
    body = [tuple(row) for row in rows]
    widths = [max(map(len, cells)) for cells in zip_longest(*above, *body, fillvalue="")]
    sides = [alignment[min(column, len(alignment) - 1)] for column in range(len(widths))]
    for i, columns in enumerate(_parts(widths, sides, WIDTH.get())):
        if i:
            yield ""
        yield from _part(columns, above, body, widths, sides)


def _parts(widths: Sequence[int], sides: Sequence[str], width: int | None) -> list[list[int]]:
    """The columns of each part of a table: of one part where it fits, or its last column can be wrapped to fit."""
    every = list(range(len(widths)))
    wrapped = [min(w, _NARROWEST) if column and column == len(widths) - 1 and sides[column] == "l" else w
               for column, w in enumerate(widths)]  # fmt: skip
    if width is None or _total(wrapped) <= width:
        return [every]
    names = sides.index("r") if "r" in sides else 1
    if not names or _total(wrapped[:names]) > width * 2 // 3:
        names = 1
    parts = [every[:names]]
    for column in every[names:]:
        if len(parts[-1]) > names and _total([wrapped[c] for c in (*parts[-1], column)]) > width:
            parts.append(every[:names])
        parts[-1].append(column)
    return parts


def _total(widths: Sequence[int]) -> int:
    return sum(widths) + len(_BETWEEN) * (len(widths) - 1)


def _part(
    columns: Sequence[int],
    above: Sequence[Sequence[str]],
    body: Sequence[Sequence[str]],
    widths: Sequence[int],
    sides: Sequence[str],
) -> Iterator[str]:
    """The lines of these columns; the last one is wrapped where it is too wide."""
    width, last = WIDTH.get(), len(columns) - 1
    wide = [widths[column] for column in columns]
    text = width is not None and last > 0 and sides[columns[last]] == "l" and _total(wide) > width
    if width is not None and text:
        wide[last] = max(_NARROWEST, width - _total(wide[:last]) - len(_BETWEEN))
    head, rows = ([[row[column] for column in columns if column < len(row)] for row in part] for part in (above, body))
    rule = [["-" * size for size in wide]] if head else []
    for row in (*filter(any, head), *rule, *rows):
        more: list[str] = []
        cells = list(row)
        if text and len(cells) > last:
            cells[last], *more = textwrap.wrap(
                cells[last], wide[last], break_long_words=False, break_on_hyphens=False
            ) or [""]
        for line in (cells, *([*[""] * last, rest] for rest in more)):
            padded = (
                cell.rjust(size) if sides[column] == "r" else cell.ljust(size)
                for cell, size, column in zip(line, wide, columns, strict=False)
            )
            yield _BETWEEN.join(padded).rstrip()


def markdown(headings: Sequence[str], rows: Iterable[Sequence[str]], alignment: str = "l") -> Iterator[str]:
    """The lines of the same table in Markdown; line ends in headings are spaces, and a bare `|` in a cell escaped."""
    sides = (alignment[min(column, len(alignment) - 1)] for column in range(len(headings)))
    yield _row(heading.replace("\n", " ") for heading in headings)
    yield "|" + "".join("--:|" if side == "r" else "---|" for side in sides)
    yield from map(_row, rows)


def _row(cells: Iterable[str]) -> str:
    return "| " + " | ".join(re.sub(r"(?<!\\)\|", r"\|", cell) for cell in cells) + " |"


def counted(count: int, noun: str) -> str:
    """`1 flight`, `2 flights`."""
    return f"{count} {noun}{'s' if count != 1 else ''}"


def number(value: float | bool | None, scale: float = 1.0) -> str:
    """`scale` times the value with three significant digits; a dash for none, and yes or no for a truth value.

    What is below 0.0005 is 0: in the units of the tables nobody measures it.
    """
    if value is None or math.isnan(value):
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    value *= scale
    return f"{value:.3g}" if abs(value) >= 0.0005 else "0"
