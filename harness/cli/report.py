"""`harness report`: a comparison as a page."""

from pathlib import Path

import click

from harness.cli._paths import PATH


@click.command()
@click.argument("directory", metavar="DIR", type=PATH)
@click.option("--out", type=PATH, help="The HTML file. [default: DIR/report.html]")
@click.option("--markdown", type=PATH, help="Write this Markdown file instead, without figures.")
@click.option("--by", default="plant", show_default=True, metavar="KEY", help="The setting whose values are compared.")
@click.option("--baseline", metavar="VALUE", help="Compare the others with it.  [default: the lowest plant, or value]")
@click.option("--where", multiple=True, metavar="KEY=VALUE", help="Only flights with this setting; repeatable.")
@click.option("--set", "overrides", multiple=True, metavar="assess.KEY=VALUE", help="Set a margin; repeatable.")
def report(
    directory: Path,
    out: Path | None,
    markdown: Path | None,
    by: str,
    baseline: str | None,
    where: tuple[str, ...],
    overrides: tuple[str, ...],
) -> None:
    """Write the comparison as one HTML page with figures.

    The page says what `harness compare DIR` prints, fetches nothing, and suits a browser and paper. Prints the name
    of the file.

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
    if not directory.is_dir():
        raise BadInput(f"{directory}: there is no such folder")
    path = writable(markdown or out or directory / "report.html")
    with busy("comparing and drawing"):
        comparison, origin = read_comparison(directory, overrides, by, baseline, where)
        text = job.markdown(comparison, origin) if markdown else job.page(comparison, origin)
        write_text(path, text)
    click.echo(f"{path}")
