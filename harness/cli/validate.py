"""`harness validate`: a recorded flight's surface commands, replayed on the model of an airframe."""

from __future__ import annotations

from pathlib import Path

import click

from harness.cli._paths import PATH


@click.command()
@click.argument("airframe")
@click.option(
    "--with", "logs", metavar="LOG", multiple=True, required=True, type=PATH, help="The log of a flight; repeatable."
)
@click.option("--map", "map_name", metavar="FILE.toml|NAME", help="Which column of a CSV is what; see the guide.")
@click.option("--save", type=PATH, metavar="FILE.svg|.png|.pdf", help="Draw recorded and simulated curves.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of the table.")
def validate(airframe: str, logs: tuple[Path, ...], map_name: str | None, save: Path | None, as_json: bool) -> None:
    """Replay the recorded surface commands of a flight on an airframe's model.

    AIRFRAME is a name or a folder. From starts along each flight the model begins where the aircraft was, in the wind
    of the log and without the inner loop, and is given the surfaces and the throttle that were commanded. Prints how
    much of the variance of rates and attitude it explains over 1, 2 and 3 s: as recorded, and with the offsets of the
    surfaces and the delay that fit best, since a log contains neither the surfaces' zero nor the delay of its clock.

    \b
    Examples:
      harness validate skywalker_x8 --with lateral_doublet_4.csv --with lateral_121_4.csv --save curves.svg
    """
    import json
    from functools import partial

    from harness.checks import airframe_of
    from harness.cli._input import BadInput
    from harness.cli._paths import writable
    from harness.drawing import PAGE, SUFFIXES, picture
    from harness.drawing import save as write
    from harness.files import replacing
    from harness.plants.plant import PlantError
    from harness.recorded import validation_lines
    from harness.recorded.read import read_log
    from harness.recorded.validation import validated

    try:
        folder = airframe_of(airframe)
    except ValueError as error:
        raise BadInput(f"AIRFRAME: {error}") from None
    if save is not None and writable(save).suffix.lower() not in SUFFIXES:
        raise BadInput(f"--save {save}: must end in {', '.join(SUFFIXES)}")
    try:
        found = validated(folder, [read_log([log], map_name) for log in logs])
    except PlantError as error:
        raise BadInput(f"AIRFRAME: {error}") from None
    if as_json:
        click.echo(json.dumps(validation_lines.as_json(found), indent=2))
    else:
        for line in validation_lines.lines(found):
            click.echo(line)
    if save is not None:
        figure = picture(partial(validation_lines.paint, found=found), PAGE, 8.0)
        with replacing(save) as partial_file:
            write(figure, partial_file, save.suffix.lower())
        click.echo(f"{save}: curves", err=as_json)
