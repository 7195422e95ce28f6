"""`harness merge`: several runs as one."""

from pathlib import Path

import click

from harness.cli._paths import PATH


@click.command()
@click.argument("runs", metavar="DIR DIR...", nargs=-1, required=True, type=PATH)
@click.option("--out", type=PATH, required=True, help="The folder of the one run, a new one.")
def merge(runs: tuple[Path, ...], out: Path) -> None:
    """Make one run of the parts that several machines flew.

    Each DIR is a folder that `harness run` wrote for the same settings file, as with --shard 1/4 to 4/4. OUT has every
    flight once, with its row and its recording as they were; compare, report, show and run take it like any other.
    Prints the number of flights, and those that several runs have flown.

    \b
    Example:
      harness merge out/wind_1 out/wind_2 --out out/wind
    """
    from harness.cli._progress import busy
    from harness.runs.merge import merge as merged
    from harness.runs.merge import told
    from harness.runs.results import export
    from harness.tables import counted

    with busy("merging the runs"):
        one = merged(runs, out)
        export(out)
    for line in told(one):
        click.echo(line, err=line.startswith("warning"))
    click.echo(f"{counted(one.flights, 'flight')} in {out}, from {counted(len(runs), 'run')}")
    click.echo(f"next: harness show {out}, harness compare {out}")
