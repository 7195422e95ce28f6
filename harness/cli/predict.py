"""`harness predict`: the limit cycle of a law behind an airframe's inner loop."""

from pathlib import Path

import click

from harness.cli._paths import PATH
from harness.cli._setting import SETTING


@click.command()
@click.argument("file", type=PATH)
@click.option(
    "--set", "overrides", multiple=True, type=SETTING, metavar="KEY=VALUE", help="Override a setting; repeatable."
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of the table, in SI and radians.")
def predict(file: Path, overrides: tuple[str, ...], as_json: bool) -> None:
    """Predict the limit cycle of a flight without flying it.

    The flight is the one that FILE describes, on its circle in still air, behind the identified inner loop of its
    airframe. Prints whether a limit cycle is predicted, with its frequency and amplitudes, and the margins of the loop;
    for NFTSM also the bandwidth that avoids it at these gains, and the highest gains without a limit cycle.

    \b
    Example:
      harness predict experiments/stationary.toml --set aircraft=skywalker_x8
    """
    import json

    from harness.cli._input import BadInput, flight_of, read_file
    from harness.limit_cycle import report
    from harness.plants.identified import IdentifiedError
    from harness.settings.laws import kind_of_class, short
    from harness.tables import table

    settings = read_file(file, overrides)
    flight = flight_of(settings)
    try:
        found = report.report(flight)
    except IdentifiedError as error:
        raise BadInput(f"{settings.locate('start.airspeed')}: {error}") from None
    if not found.holds_circle:
        raise BadInput(f"{settings.locate('law.max_heading_rate')}: {found.following.reason}")
    if found.left_out:
        click.echo(f"warning: {found.left_out}", err=True)
    if as_json:
        click.echo(json.dumps(report.document(found), allow_nan=False))
        return
    name, _ = kind_of_class(type(flight.law)) or (type(flight.law).__name__, None)
    gains = getattr(flight.law, "gains", "")
    law = f"{short(name)} with gains {gains}" if gains else short(name)
    where = f"{found.aircraft} at {found.airspeed:g} m/s in still air"
    click.echo(f"{law} on {where}, with commands held for {found.period:g} s")
    for line in [*table([], report.rows(found)), *report.sentences(found)]:
        click.echo(line)
