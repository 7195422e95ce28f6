"""`harness report`: a comparison as a page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from harness.cli._paths import PATH
from harness.cli._setting import MARGIN, SETTING

if TYPE_CHECKING:
    from harness.log import FlightLog
    from harness.verdict.report import ToDraw


@click.command()
@click.argument("directories", metavar="DIR...", nargs=-1, required=True, type=PATH)
@click.option("--out", type=PATH, help="The HTML file. [default: report.html in the last DIR]")
@click.option("--markdown", type=PATH, help="Write this Markdown file instead, without figures.")
@click.option("--by", metavar="KEY", help="The setting whose values are compared.  [default: plant, if several]")
@click.option("--baseline", metavar="VALUE", help="Compare the others with it.  [default: the lowest plant, or value]")
@click.option(
    "--where", multiple=True, type=SETTING, metavar="KEY=VALUE", help="Only flights with this setting; repeatable."
)
@click.option(
    "--set", "overrides", multiple=True, type=MARGIN, metavar="assess.KEY=VALUE", help="Set a margin; repeatable."
)
@click.option(
    "--variance-reduction",
    "reducing",
    is_flag=True,
    help="Add what a cheaper plant saves; see harness compare.",
)
def report(
    directories: tuple[Path, ...],
    out: Path | None,
    markdown: Path | None,
    by: str | None,
    baseline: str | None,
    where: tuple[str, ...],
    overrides: tuple[str, ...],
    reducing: bool,
) -> None:
    """Write the comparison as one HTML page with figures.

    The page contains what `harness compare` prints for the same folders, is self-contained, and can be printed.
    Prints the name of the file.

    \b
    Examples:
      harness report out/wind
      harness report out/wind --markdown wind.md
      harness report out/monte_carlo --variance-reduction
    """
    from harness.cli._comparison import read_comparison, reduced
    from harness.cli._input import BadInput
    from harness.cli._paths import writable
    from harness.cli._progress import busy
    from harness.files import write_text
    from harness.verdict import report as job
    from harness.verdict.control_variates import told

    if out is not None and markdown is not None:
        raise BadInput("--out and --markdown exclude each other: each names the one file to write")
    for directory in directories:
        if not directory.is_dir():
            raise BadInput(f"{directory}: there is no such folder")
    path = writable(markdown or out or directories[-1] / "report.html")
    with busy("comparing"):
        comparison, origin = read_comparison(directories, overrides, by, baseline, where)
        found = reduced(comparison, directories) if reducing else []
    saved = told(found, " and ".join(map(str, directories))) if found else None
    logs = {} if markdown else _logs(list(job.to_draw(comparison, origin.folder)))
    with busy("drawing"):
        if markdown:
            text = job.markdown(comparison, origin, saved)
        else:
            text = job.page(comparison, origin, logs, _maps(directories), saved)
        write_text(path, text)
    click.echo(f"{path}")


def _maps(directories: tuple[Path, ...]) -> dict[str, bytes]:
    """The maps that `harness map` drew in these folders."""
    from harness.cli.map import PICTURE

    return {str(folder): path.read_bytes() for folder in directories if (path := folder / PICTURE).is_file()}


def _logs(wanted: list[ToDraw]) -> dict[str, FlightLog]:
    """The flights by key, read or flown again; without those that are no longer the flights that were compared."""
    from harness.cli._progress import progress
    from harness.error import HarnessError
    from harness.runs.logs import flight_of_row

    logs = {}
    with progress("reading flights", len(wanted)) as advance:
        for flight in wanted:
            try:
                log = flight_of_row(Path(flight.folder), flight.key, lambda _: None)
            except (HarnessError, ValueError):
                log = None
            if log is not None and log.digest == flight.digest:
                logs[flight.key] = log
            else:
                click.echo(f"{flight.folder}:{flight.key[:12]}: is another flight now, not drawn", err=True)
            advance()
    return logs
