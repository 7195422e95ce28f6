"""`harness report`: a comparison as a page."""

from pathlib import Path

import click

from harness.cli._paths import PATH
from harness.cli._setting import MARGIN, SETTING


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
def report(
    directories: tuple[Path, ...],
    out: Path | None,
    markdown: Path | None,
    by: str | None,
    baseline: str | None,
    where: tuple[str, ...],
    overrides: tuple[str, ...],
) -> None:
    """Write the comparison as one HTML page with figures.

    The page says what `harness compare` prints of the same folders, fetches nothing, and suits a browser and paper.
    Prints the name of the file.

    \b
    Examples:
      harness report out/wind
      harness report out/wind --markdown wind.md
    """
    from harness.cli._comparison import read_comparison
    from harness.cli._input import BadInput
    from harness.cli._paths import writable
    from harness.cli._progress import busy
    from harness.files import write_text
    from harness.verdict import report as job

    if out is not None and markdown is not None:
        raise BadInput("--out and --markdown exclude each other: each names the one file to write")
    for directory in directories:
        if not directory.is_dir():
            raise BadInput(f"{directory}: there is no such folder")
    path = writable(markdown or out or directories[-1] / "report.html")
    with busy("comparing and drawing"):
        comparison, origin = read_comparison(directories, overrides, by, baseline, where)
        text = job.markdown(comparison, origin) if markdown else job.page(comparison, origin)
        write_text(path, text)
    click.echo(f"{path}")
