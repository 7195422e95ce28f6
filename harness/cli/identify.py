"""`harness identify`: the inner loop's step and frequency response, and the plants fitted to them."""

from pathlib import Path

import click


@click.command()
@click.argument("aircraft")
@click.option("--airspeed", type=float, help="m/s; without it the one that the inner loop was tuned at.")
@click.option(
    "--out", type=click.Path(path_type=Path, file_okay=False), default=Path("out/identify"), show_default=True
)
def identify(aircraft: str, airspeed: float | None, out: Path) -> None:
    """Fly steps and sweeps of heading-rate command on AIRCRAFT (a name, or a folder); fit `lagged` and `coordinated`.

    The parameters and their errors are kept beside the aircraft, in identified.toml, for each airspeed; a step and a
    Bode plot are drawn into OUT. Takes about 10 s.

    \b
    Example:
      harness identify ultra_stick_25e --airspeed 15
    """
    from rich.console import Console
    from rich.progress import Progress

    from aircraft import identified as file_of
    from aircraft import limits
    from harness.checks import airframe_of
    from harness.cli._input import BadInput
    from harness.cli._paths import writable, writable_folder
    from harness.files import replacing
    from harness.identification import identify as job
    from harness.identification.figures import bode_plot, step_plot
    from harness.identification.summary import summary_lines
    from harness.plants.identified import IdentifiedError, document, read
    from harness.plants.plant import End, PlantError

    try:
        airframe = airframe_of(aircraft)
    except ValueError as error:
        raise BadInput(f"AIRCRAFT: {error}") from None
    speed = limits(airframe).design_airspeed if airspeed is None else airspeed
    file = writable(file_of(airframe))
    writable_folder(out)
    plots = {
        writable(out / f"{airframe.name}_step.svg"): step_plot,
        writable(out / f"{airframe.name}_bode.svg"): bode_plot,
    }
    try:
        others = [one for one in read(airframe) if one.airspeed != speed]
    except IdentifiedError:
        others = []  # a damaged file is written anew
    terminal = Console(stderr=True)
    with Progress(console=terminal, transient=True, disable=not terminal.is_terminal) as progress:
        flying = progress.add_task(f"flying {airframe.name}", total=job.FLIGHTS)
        try:
            found = job.identify(airframe, speed, done=lambda: progress.advance(flying))
        except PlantError as error:
            raise BadInput(f"--airspeed: {error}") from None
        except End as end:
            raise BadInput(f"--airspeed: at {speed:g} m/s a manoeuvre ended early, {end.outcome}: {end}") from None
    for line in summary_lines(found):
        click.echo(line)
    drawn = {path: plot(found) for path, plot in plots.items()}
    for path, text in {file: document(airframe, [*others, found.identified]), **drawn}.items():
        with replacing(path) as partial:
            partial.write_text(text, encoding="utf-8")
    click.echo(f"kept in {file}; drawn in {', '.join(map(str, plots))}")
