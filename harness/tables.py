"""Tables for a terminal and for Markdown, and how a number is written in their cells."""

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import zip_longest

_BETWEEN = "  "  # two columns


def table(headings: Sequence[str], rows: Iterable[Sequence[str]], alignment: str = "l") -> Iterator[str]:
    r"""The lines of a table, to be printed one by one; never wrapped or cut, however narrow the terminal.

    `headings`: one for each column; "\n" within one begins a new line of it. Without headings: rows alone.
    `rows`: the cells, already text (see `number`). A row may be shorter than the headings.
    `alignment`: "l" or "r" for each column; the last letter counts for all further ones, so that "lr" is a column of
    names and then numbers.

    >>> for line in table(["law", "settles\ns"], [["smc", number(43.21)]], "lr"):
    ...     click.echo(line)
    """
    head = [heading.split("\n") for heading in headings]
    height = max(map(len, head), default=0)
    above = list(zip(*([""] * (height - len(words)) + words for words in head), strict=True))
    body = [tuple(row) for row in rows]
    widths = [max(map(len, cells)) for cells in zip_longest(*above, *body, fillvalue="")]
    sides = [alignment[min(column, len(alignment) - 1)] for column in range(len(widths))]
    rule = [tuple("-" * width for width in widths)] if head else []
    for row in (*above, *rule, *body):
        cells = (
            cell.rjust(width) if side == "r" else cell.ljust(width)
            for cell, width, side in zip(row, widths, sides, strict=False)
        )
        yield _BETWEEN.join(cells).rstrip()


def markdown(headings: Sequence[str], rows: Iterable[Sequence[str]], alignment: str = "l") -> Iterator[str]:
    """The lines of the same table in Markdown; line ends in headings are spaces, and a bare `|` in a cell escaped."""
    sides = (alignment[min(column, len(alignment) - 1)] for column in range(len(headings)))
    yield _row(heading.replace("\n", " ") for heading in headings)
    yield "|" + "".join("--:|" if side == "r" else "---|" for side in sides)
    yield from map(_row, rows)


def _row(cells: Iterable[str]) -> str:
    return "| " + " | ".join(re.sub(r"(?<!\\)\|", r"\|", cell) for cell in cells) + " |"


def number(value: float | bool | None, scale: float = 1.0) -> str:
    """`scale` times the value with three significant digits; a dash for none, and yes or no for a truth value."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    value *= scale
    return f"{value:.3g}" if abs(value) >= 0.0005 else "0"
