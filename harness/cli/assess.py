"""`harness assess`: what a log of a real flight says of the coordinated-flight assumption."""

from __future__ import annotations

import math
from pathlib import Path

import click

from harness.cli._paths import PATH


@click.command()
@click.argument("logs", metavar="LOG...", nargs=-1, required=True, type=PATH)
@click.option("--map", "map_name", metavar="FILE.toml|NAME", help="Which column of a CSV is what; see the guide.")
@click.option("--from", "begin", type=float, default=-math.inf, help="Leave out what comes before, s.")
@click.option("--to", "end", type=float, default=math.inf, help="Leave out what comes after, s.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of tables.")
def assess(logs: tuple[Path, ...], map_name: str | None, begin: float, end: float, as_json: bool) -> None:
    """Read the log of a real flight, and say what it holds.

    LOG is a ULog file (PX4), a DataFlash file (ArduPilot), or CSV files of one flight; a folder stands for the logs in
    it. Prints each channel: how often its value really changes, since logs repeat rows; whether it was measured,
    estimated by a filter, commanded or derived; and what is wrong with the log. The time is in seconds since the log's
    first row.

    \b
    Examples:
      harness assess flight.ulg --from 60 --to 300
      harness assess alfa/ --map alfa --json
    """
    import json

    from harness.cli._input import BadInput
    from harness.recorded import contents
    from harness.recorded.read import read_log

    if not begin < end:
        raise BadInput(f"--from {begin:g} --to {end:g}: the first must be less than the second")
    whole = read_log(logs, map_name)
    flight = whole.between(begin, end)
    if not flight.channels:
        raise BadInput(f"--from {begin:g} --to {end:g}: the log goes from {whole.begin:.2f} to {whole.end:.2f} s")
    if as_json:
        click.echo(json.dumps(contents.as_json(flight), indent=2))
        return
    for line in contents.contents(flight):
        click.echo(line)
