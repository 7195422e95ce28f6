"""`harness show`: a row of a run in words, or all of them in lines."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import click

_MOST_LINES = 100


@click.command()
@click.argument("row", metavar="DIR:KEY|DIR")
def show(row: str) -> None:
    """Tell the story of a flight of a run: its settings, its metrics, why it ended, where it comes from.

    The beginning of the key is enough. Of a DIR alone, list the flights with their keys and what varies.

    \b
    Examples:
      harness show out/wind
      harness show out/wind:3f2a
    """
    from harness.cli._input import BadInput
    from harness.runs.recall import row_address
    from harness.runs.store import StoreError, find
    from harness.runs.story import story

    place = row_address(row)
    if place is None and not Path(row).is_dir():
        raise BadInput(f"{row}: is no DIR:KEY, a directory of `harness run` and the beginning of a key")
    try:
        for line in story(place.folder, find(*place)) if place else _flights(Path(row)):
            click.echo(line)
    except StoreError as error:
        raise BadInput(str(error)) from None


def _flights(folder: Path) -> Iterator[str]:
    """A line for each flight of a run."""
    from harness.runs.results import load_results
    from harness.verdict.pairs import varying

    results = load_results(folder)
    table = results.assign(key=results["key"].str[:8])[["key", *varying(results), "outcome"]]
    yield from table.head(_MOST_LINES).to_string(index=False, float_format="%.6g").splitlines()
    if len(table) > _MOST_LINES:
        yield f"... and {len(table) - _MOST_LINES} more; all: harness.load_results({str(folder)!r}) in Python"
