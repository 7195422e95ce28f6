"""`harness show`: the flights of a run, or one of them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import click

_MOST_LINES = 100


@click.command()
@click.argument("row", metavar="DIR|DIR:KEY")
def show(row: str) -> None:
    """Show the flights of a run, or one of them in full.

    Of DIR, a folder that `harness run` wrote, prints a table of the flights: the key, the settings that vary and the
    outcome. Of DIR:KEY prints one flight: how it ended, its metrics, its settings and where it comes from. The
    beginning of the key is enough.

    \b
    Examples:
      harness show out/wind
      harness show out/wind:3f2a
    """
    from harness.cli._input import BadInput
    from harness.runs.description import description
    from harness.runs.recall import row_address
    from harness.runs.store import StoreError, find

    address = row_address(row)
    if address is None and not Path(row).is_dir():
        raise BadInput(f"{row}: must be DIR or DIR:KEY, a folder that `harness run` wrote and the beginning of a key")
    try:
        for line in description(address.folder, find(*address)) if address else _flights(Path(row)):
            click.echo(line)
    except StoreError as error:
        raise BadInput(str(error)) from None


def _flights(folder: Path) -> Iterator[str]:
    """A line for each flight of a run."""
    from harness.runs.results import load_results
    from harness.tables import table
    from harness.verdict.pairs import varying

    results = load_results(folder)
    keys = varying(results)
    rows = (
        [flight["key"][:8], *(_cell(flight[key]) for key in keys), flight["outcome"]]
        for flight in results.head(_MOST_LINES).to_dict("records")
    )
    sides = "".join("r" if results[key].dtype.kind in "if" else "l" for key in keys)
    yield from table(["key", *(key.replace(".", ".\n") for key in keys), "outcome"], rows, f"l{sides}l")
    if len(results) > _MOST_LINES:
        yield f"... and {len(results) - _MOST_LINES} more; all flights: harness.load_results({str(folder)!r})"


def _cell(value: object) -> str:
    """A setting: a number without needless digits, a list in brackets, a dash for none."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(_cell, value))}]"
    if isinstance(value, float):
        return f"{value:.6g}" if value == value else "-"
    return "-" if value is None else str(value)
