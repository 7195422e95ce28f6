"""`harness compare`: what differs between plants, laws, any setting, or runs."""

from pathlib import Path

import click

from harness.cli._paths import PATH
from harness.cli._setting import MARGIN, SETTING


@click.command()
@click.argument("directories", metavar="DIR...", nargs=-1, required=True, type=PATH)
@click.option("--by", metavar="KEY", help="The setting whose values are compared.  [default: plant, if several]")
@click.option("--baseline", metavar="VALUE", help="Compare the others with it.  [default: the lowest plant, or value]")
@click.option(
    "--where", multiple=True, type=SETTING, metavar="KEY=VALUE", help="Only flights with this setting; repeatable."
)
@click.option(
    "--set", "overrides", multiple=True, type=MARGIN, metavar="assess.KEY=VALUE", help="Set a margin; repeatable."
)
@click.option("--map", "mapped", metavar="METRIC", help="Print this metric over the two numeric axes alone.")
@click.option(
    "--variance-reduction",
    "reducing",
    is_flag=True,
    help="Print means and shares of the highest plant alone, with a cheaper one as a control variate.",
)
@click.option("--json", "form", flag_value="json", help="Print everything as one JSON object.")
@click.option("--csv", "form", flag_value="csv", help="Print the paired differences as CSV.")
@click.option("--latex", "form", flag_value="latex", help="Print the paired differences as a LaTeX tabular.")
def compare(
    directories: tuple[Path, ...],
    by: str | None,
    baseline: str | None,
    where: tuple[str, ...],
    overrides: tuple[str, ...],
    mapped: str | None,
    reducing: bool,
    form: str | None,
) -> None:
    """Compare the flights of a run that differ in one setting alone.

    DIR is a folder that `harness run` wrote. The setting is the plant where several were flown, else the law or the
    first that varies; --by names another. With two or more folders, the same flights in each are compared: what
    changed with other code or settings, by how much, and in which flights. Prints the outcomes of each combination, a
    map where two numeric settings vary, and for each airframe which part of the coordinated-flight assumption holds
    within its margin, or which metrics differ, with 95 % intervals. The margins are the table [assess] of the
    experiment's file, see `harness list margins`.

    With --variance-reduction the flights of the cheaper plants narrow the intervals of the highest plant's own means
    and shares (control variates): both must be flown with the same seeds, and a cheaper one with many more (fly FILE
    into DIR again with --set plant and --set seed). Prints both intervals, and the factors by which this reduces
    flights and time, where the factor of flights is 2 or more.

    \b
    Examples:
      harness compare out/wind
      harness compare out/wind --json --set assess.range_error_margin_m=1
      harness compare out/gains --map range_error_rms_m
      harness compare out/laws --by law.name --baseline smc --where plant=sixdof
      harness compare out/before out/after
      harness compare out/monte_carlo --variance-reduction
    """
    import json

    from harness.cli._comparison import read_comparison, reduced
    from harness.cli._input import BadInput
    from harness.cli._progress import busy
    from harness.verdict.control_variates import lines as reduced_lines
    from harness.verdict.control_variates import records
    from harness.verdict.export import as_csv, as_document, as_latex, plain
    from harness.verdict.pairs import CompareError
    from harness.verdict.text import lines

    if reducing and (mapped is not None or form in ("csv", "latex")):
        raise BadInput("--variance-reduction excludes --map, --csv and --latex: it prints its own table, or --json")
    with busy("comparing"):
        comparison, _ = read_comparison(directories, overrides, by, baseline, where)
    place = " and ".join(map(str, directories))
    found = reduced(comparison, directories) if reducing else []
    match form:
        case "json":
            document = as_document(comparison)
            if reducing:
                document["variance_reduction"] = plain(records(found))
            click.echo(json.dumps(document, allow_nan=False))
        case "csv":
            click.echo(as_csv(comparison), nl=False)
        case "latex":
            click.echo(as_latex(comparison), nl=False)
        case _:
            try:
                text = list(reduced_lines(found, place) if reducing else lines(comparison, mapped))
            except CompareError as error:
                raise BadInput(f"{place}: {error}") from None
            for line in text:
                click.echo(line)
