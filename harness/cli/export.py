"""`harness export`: the log of a flight as a table for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    import pandas as pd


@click.command()
@click.argument("what", metavar="DIR:KEY|FILE.rrd")
@click.option("--to", "kind", type=click.Choice(["csv", "parquet"]), required=True, help="The form.")
@click.option("--flight", metavar="NAME", help="Which flight of a FILE.rrd that holds several.")
@click.option(
    "--out", type=click.Path(path_type=Path), help="The file.  [default: KEY or FILE, with the form's suffix]"
)
def export(what: str, kind: str, flight: str | None, out: Path | None) -> None:
    """Write the log of a flight, a row per guidance period: SI, rad, north-east-down; empty where there is no number.

    A row without a recording is flown again, and compared with what is stored. CSV has every digit of a double.

    \b
    Examples:
      harness export out/wind:3f2a --to csv
      harness export flight.rrd --to parquet --out flight.parquet
    """
    from harness.cli._paths import writable
    from harness.files import replacing

    table, name = _table(what, flight)
    path = writable(out or Path(f"{name}.{kind}"))
    with replacing(path) as partial:
        if kind == "csv":
            table.to_csv(partial, index=False)
        else:
            table.to_parquet(partial, index=False)
    click.echo(f"{path}: {len(table)} rows, {len(table.columns)} columns")


def _table(what: str, flight: str | None) -> tuple[pd.DataFrame, str]:
    """The log, and a name for the file."""
    from harness.cli._input import BadInput
    from harness.runs.recall import row_address
    from harness.runs.store import StoreError, find
    from harness.settings import SettingsError

    try:
        if place := row_address(what):
            import pandas as pd

            from harness.log import COLUMNS
            from harness.runs.logs import flight_of_row

            if flight is not None:
                raise BadInput(f"{what}: is one flight; --flight is for a FILE.rrd")
            log = flight_of_row(place.folder, place.beginning, lambda line: click.echo(line, err=True))
            return pd.DataFrame(log.table, columns=list(COLUMNS)), find(*place).row["key"]
        from harness.review.reading import read_recording

        return read_recording(Path(what), flight), Path(what).stem
    except OSError as error:
        raise BadInput(f"{what}: {error.strerror or error}") from None
    except (StoreError, SettingsError, ValueError) as error:
        raise BadInput(str(error)) from None
