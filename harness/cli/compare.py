"""`harness compare`: what differs between the plants."""

from pathlib import Path

import click


@click.command()
@click.argument("directory", metavar="DIR", type=click.Path(path_type=Path))
@click.option("--baseline", default="kinematic", show_default=True, help="The plant that the others are compared with.")
@click.option("--set", "overrides", multiple=True, metavar="assess.KEY=VALUE", help="Another margin; repeatable.")
@click.option("--json", "form", flag_value="json", help="Everything as one JSON object on stdout.")
@click.option("--csv", "form", flag_value="csv", help="The paired differences, one a line.")
@click.option("--latex", "form", flag_value="latex", help="The paired differences as a tabular.")
def compare(directory: Path, baseline: str, overrides: tuple[str, ...], form: str | None) -> None:
    """Compare the flights of DIR, a directory of `harness run`, that differ in the plant alone.

    Paired differences with 95 % intervals, and whether each part of the coordinated-flight assumption holds: within
    the margins of the table [assess] of the run's settings (`harness list margins`).

    \b
    Examples:
      harness compare out/wind
      harness compare out/wind --json --set assess.range_error_margin_m=1
    """
    import json

    from harness.cli._comparison import read_comparison
    from harness.cli._progress import busy
    from harness.verdict.words import lines
    from harness.verdict.written import as_csv, as_document, as_latex

    with busy("comparing"):
        comparison, _ = read_comparison(directory, baseline, overrides)
    match form:
        case "json":
            click.echo(json.dumps(as_document(comparison), allow_nan=False))
        case "csv":
            click.echo(as_csv(comparison), nl=False)
        case "latex":
            click.echo(as_latex(comparison), nl=False)
        case _:
            for line in lines(comparison):
                click.echo(line)
