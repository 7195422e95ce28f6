"""`harness show`: the flights of a run, or one of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from harness.cli._paths import PATH_OR_ROW
from harness.cli._setting import SETTING

if TYPE_CHECKING:
    import pandas as pd

_MOST_LINES = 100
_MARK = "*"


@click.command()
@click.argument("row", metavar="DIR|DIR:KEY", type=PATH_OR_ROW)
@click.option(
    "--where", multiple=True, type=SETTING, metavar="KEY=VALUE", help="Only flights with this setting; repeatable."
)
@click.option("--sort", metavar="COLUMN", help="Sort by a metric or setting; -COLUMN: the largest first.")
@click.option("--columns", metavar="A,B", help="Print these metrics and settings.  [default: what varies, and metrics]")
@click.option("--limit", type=click.IntRange(1), metavar="N", help="Print N flights.  [default: 100; with --csv all]")
@click.option("--csv", "as_csv", is_flag=True, help="Print CSV: every column unless --columns names some.")
def show(
    row: str, where: tuple[str, ...], sort: str | None, columns: str | None, limit: int | None, as_csv: bool
) -> None:
    """Show the flights of a run, or one of them in full.

    For DIR, a folder that `harness run` wrote, prints a table of the flights: the key, the settings that vary, the
    outcome and the metrics. For DIR:KEY prints one flight: how it ended, its metrics, its settings and its provenance.
    The beginning of the key is enough.

    \b
    Examples:
      harness show out/wind
      harness show out/wind --where plant=sixdof --sort -range_error_rms_m --limit 5
      harness show out/wind --columns law.name,chatters,sideslip_rms_deg --csv
      harness show out/wind:3f2a
    """
    from harness.cli._comparison import wanted
    from harness.cli._input import BadInput
    from harness.comparison import chosen as with_settings
    from harness.runs.description import description
    from harness.runs.journal import StoreError, taking_apart
    from harness.runs.recall import other_versions, row_address
    from harness.runs.results import load_results
    from harness.runs.store import find
    from harness.settings.laws import short_names
    from harness.verdict.pairs import CompareError, varying

    address = row_address(row)
    if address is None and not Path(row).is_dir():
        raise BadInput(f"{row}: must be DIR or DIR:KEY, a folder that `harness run` wrote and the beginning of a key")
    if address and (where or sort or columns or limit or as_csv):
        raise BadInput(f"{row}: is one flight; --where, --sort, --columns, --limit and --csv are for a whole DIR")
    try:
        if address:
            stored = find(*address)
            with taking_apart(address.folder):
                lines = list(description(address.folder, stored, varying(load_results(address.folder))))
            for line in lines:
                click.echo(line)
            return
        flights, others = load_results(row), other_versions(Path(row))
        chosen = _sorted(with_settings(flights, wanted(where)), sort)
        named = _named(chosen, columns)
    except (StoreError, CompareError) as error:
        text = str(error)
        raise BadInput(text if text.startswith(row) else f"{row}: {text}") from None
    if as_csv:
        table = chosen[named] if columns else chosen
        click.echo(table.head(limit or len(table)).to_csv(index=False), nl=False)
        return
    marked = chosen["version"].isin([number[:8] for number in others])
    chosen = chosen.assign(key=chosen["key"].str[:8].where(~marked, chosen["key"].str[:8] + _MARK))
    chosen = chosen.assign(**{"law.name": chosen["law.name"].map(short_names(chosen["law.name"]))})
    for line in _table(chosen, named or _usual(flights), limit or _MOST_LINES):
        click.echo(line)
    if changed := dict.fromkeys(what for names in others.values() for what in names):
        click.echo(f"{_MARK} flown by another version: {', '.join(changed)}; the same command flies it anew")
    if (more := len(chosen) - (limit or _MOST_LINES)) > 0:
        click.echo(f"... and {more} more; all of them: --limit {len(chosen)}, or --csv")


def _sorted(flights: pd.DataFrame, column: str | None) -> pd.DataFrame:
    if column is None:
        return flights
    (name,) = _known(flights, [column.removeprefix("-")], "--sort")
    return flights.sort_values(name, ascending=not column.startswith("-"), kind="stable", na_position="last")


def _named(flights: pd.DataFrame, columns: str | None) -> list[str]:
    """The requested columns, after the key; empty for none."""
    if columns is None:
        return []
    return ["key", *_known(flights, [name.strip() for name in columns.split(",")], "--columns")]


def _known(flights: pd.DataFrame, names: Sequence[str], option: str) -> Sequence[str]:
    from harness.cli._input import BadInput
    from harness.error import did_you_mean

    for name in names:
        if name not in flights:
            raise BadInput(
                f"{option} {name}: the results have no such column{did_you_mean(name, flights.columns)}; there are the "
                "settings (`harness show DIR:KEY`), the metrics (`harness list metrics`), key, outcome and reason"
            )
    return names


def _usual(flights: pd.DataFrame) -> list[str]:
    """The key, what varies, how it ended, and the metrics of short tables."""
    from harness.log.metric import METRICS
    from harness.verdict.pairs import varying

    metrics = [name for name, metric in METRICS.items() if metric.in_short_tables]
    return ["key", *varying(flights), "outcome", *(name for name in metrics if flights[name].notna().any())]


def _table(flights: pd.DataFrame, columns: Sequence[str], most: int) -> Iterator[str]:
    """A line for each flight."""
    from harness.log.metric import METRICS
    from harness.tables import number, table

    cells = []
    for name in columns:
        values = flights[name].head(most).tolist()
        if name in METRICS:
            cells.append([number(_value(value), METRICS[name].scale) for value in values])
        else:
            cells.append([_cell(value) for value in values])
    headings = [
        METRICS[name].column_heading.removesuffix("\n% yes") if name in METRICS else name.replace(".", ".\n")
        for name in columns
    ]
    sides = ["r" if name in METRICS or flights[name].dtype.kind in "if" else "l" for name in columns]
    yield from table(headings, zip(*cells, strict=True), "".join(sides))


def _value(value: object) -> float | bool | None:
    """A metric; None where the flight has none."""
    if isinstance(value, bool):
        return value
    return float(value) if isinstance(value, int | float) and value == value else None


def _cell(value: object) -> str:
    """A setting: a number without needless digits, a list in brackets, a dash for none."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(_cell, value))}]"
    if isinstance(value, float):
        return f"{value:.6g}" if value == value else "-"
    return "-" if value is None else str(value)
