"""`harness export`: the log of a flight, or the flights of a run, as a table for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from harness.cli._paths import PATH, PATH_OR_ROW

if TYPE_CHECKING:
    import pandas as pd


@click.command()
@click.argument("what", metavar="DIR:KEY|FILE.rrd|DIR", type=PATH_OR_ROW)
@click.option("--to", "kind", type=click.Choice(["csv", "parquet"]), required=True, help="Format of the table.")
@click.option("--flight", metavar="NAME", help="Which flight of a FILE.rrd that holds several.")
@click.option("--out", type=PATH, help="The file.  [default: KEY, FILE or DIR, with the format's suffix]")
def export(what: str, kind: str, flight: str | None, out: Path | None) -> None:
    """Write the log of a flight, or the flights of a run, as a table.

    CSV or Parquet. For a flight: one row for each guidance period; SI units, rad, north-east-down; a cell is empty
    where the plant has no such quantity. CSV has every digit of a double. A flight of a run without a recording is
    flown again and compared with the stored result. For DIR, a folder that `harness run` wrote: one row for each
    flight, with its settings and metrics; the unit is the suffix of a column, and in Parquet in its metadata too.
    Prints the file, its rows and its columns.

    \b
    Examples:
      harness export out/wind:3f2a --to csv
      harness export flight.rrd --to parquet --out flight.parquet
      harness export out/wind --to csv --out wind.csv
    """
    from harness.cli._paths import writable
    from harness.files import replacing
    from harness.runs.results import export as write_table

    table, name = _table(what, flight)
    path = writable(out or Path(f"{name}.{kind}"))
    if kind == "parquet" and Path(what).is_dir():
        write_table(Path(what), path)  # its columns say their units
    else:
        with replacing(path) as partial, partial.open("wb") as file:
            if kind == "csv":
                table.to_csv(file, index=False)
            else:
                table.to_parquet(file, index=False)
    click.echo(f"{path}: {len(table)} rows, {len(table.columns)} columns")


def _table(what: str, flight: str | None) -> tuple[pd.DataFrame, str]:
    """The log, and a name for the file."""
    from harness.cli._input import BadInput
    from harness.runs.journal import StoreError
    from harness.runs.recall import row_address
    from harness.runs.store import find
    from harness.settings import SettingsError

    try:
        if place := row_address(what):
            from harness.runs.logs import flight_of_row

            if flight is not None:
                raise BadInput(f"{what}: is one flight already; --flight is for a FILE.rrd")
            log = flight_of_row(place.folder, place.beginning, lambda line: click.echo(line, err=True))
            return log.frame(), find(*place).row["key"]
        if Path(what).is_dir():
            if flight is not None:
                raise BadInput(f"{what}: is a folder of flights; --flight is for a FILE.rrd")
            from harness.runs.results import load_results

            return load_results(what), Path(what).absolute().name
        from harness.review.reading import read_recording

        return read_recording(Path(what), flight), Path(what).stem
    except OSError as error:
        raise BadInput(f"{what}: {error.strerror or error}") from None
    except (StoreError, SettingsError, ValueError) as error:
        raise BadInput(str(error)) from None
