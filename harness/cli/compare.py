"""`harness compare`: what differs between the plants."""

from pathlib import Path

import click

from harness.cli._paths import PATH


@click.command()
@click.argument("directory", metavar="DIR", type=PATH)
@click.option("--by", default="plant", show_default=True, metavar="KEY", help="The setting whose values are compared.")
@click.option("--baseline", metavar="VALUE", help="Compare the others with it.  [default: the lowest plant, or value]")
@click.option("--where", multiple=True, metavar="KEY=VALUE", help="Only flights with this setting; repeatable.")
@click.option("--set", "overrides", multiple=True, metavar="assess.KEY=VALUE", help="Set a margin; repeatable.")
@click.option("--map", "mapped", metavar="METRIC", help="Print this metric over the two numeric axes alone.")
@click.option("--json", "form", flag_value="json", help="Print everything as one JSON object.")
@click.option("--csv", "form", flag_value="csv", help="Print the paired differences as CSV.")
@click.option("--latex", "form", flag_value="latex", help="Print the paired differences as a LaTeX tabular.")
def compare(
    directory: Path,
    by: str,
    baseline: str | None,
    where: tuple[str, ...],
    overrides: tuple[str, ...],
    mapped: str | None,
    form: str | None,
) -> None:
    """Compare the flights of a run that differ in one setting alone.

    DIR is a folder that `harness run` wrote; the setting is the plant unless --by names another. Prints how the
    flights of each combination of settings ended, a map where two numeric settings vary, and for each airframe which
    part of the coordinated-flight assumption holds within its margin, or which metrics differ, with 95 % intervals.
    The margins are the table [assess] of the experiment's file, see `harness list margins`.

    \b
    Examples:
      harness compare out/wind
      harness compare out/wind --json --set assess.range_error_margin_m=1
      harness compare out/gains --map range_error_rms_m
      harness compare out/laws --by law.name --baseline smc --where plant=sixdof
    """
    import json

    from harness.cli._comparison import read_comparison
    from harness.cli._input import BadInput
    from harness.cli._progress import busy
    from harness.verdict.export import as_csv, as_document, as_latex
    from harness.verdict.pairs import CompareError
    from harness.verdict.text import lines

    with busy("comparing"):
        comparison, _ = read_comparison(directory, overrides, by, baseline, where)
    match form:
        case "json":
            click.echo(json.dumps(as_document(comparison), allow_nan=False))
        case "csv":
            click.echo(as_csv(comparison), nl=False)
        case "latex":
            click.echo(as_latex(comparison), nl=False)
        case _:
            try:
                text = list(lines(comparison, mapped))
            except CompareError as error:
                raise BadInput(f"{directory}: {error}") from None
            for line in text:
                click.echo(line)
