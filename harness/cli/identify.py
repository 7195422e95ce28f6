"""`harness identify`: the inner loop's step and frequency response, and the plants fitted to them."""

from pathlib import Path

import click

from harness.cli._paths import PATH


@click.command()
@click.argument("aircraft")
@click.option("--airspeed", type=float, help="Airspeed, m/s. [default: the inner loop's design airspeed]")
@click.option("--out", type=PATH, default=Path("out/identify"), show_default=True, help="Write the results here.")
@click.option("--keep", is_flag=True, help="Keep the parameters beside the airframe too; the plants use them.")
def identify(aircraft: str, airspeed: float | None, out: Path, keep: bool) -> None:
    """Identify how an airframe follows a heading-rate command.

    AIRCRAFT is a name or a folder. Flies steps and sweeps of the heading-rate command on the 6-DOF plant and fits the
    plants `lagged` and `coordinated` to them. Prints the step and frequency response, the fit, and its errors on
    manoeuvres that the fit did not use. The parameters, a step plot and a Bode plot are written to OUT; with --keep the
    parameters are kept in identified.toml beside the airframe too, for each airspeed. Takes 10 s to a minute; progress
    and remaining time are shown. `harness adopt` includes this step.

    \b
    Examples:
      harness identify ultra_stick_25e --airspeed 15
      harness identify my_airframe --keep
    """
    from aircraft import identified as file_of
    from aircraft import is_recorded, limits
    from harness.checks import airframe_of
    from harness.cli._input import BadInput
    from harness.cli._paths import writable, writable_folder
    from harness.cli._progress import progress
    from harness.files import write_text
    from harness.identification import identify as job
    from harness.identification.figures import bode_plot, step_plot
    from harness.identification.summary import summary_lines
    from harness.plants.identified import IdentifiedError, document, read
    from harness.plants.plant import End, PlantError

    try:
        airframe = airframe_of(aircraft)
        work = 0.0 if is_recorded(airframe) else job.work(airframe)
    except ValueError as error:
        raise BadInput(f"AIRCRAFT: {error}") from None
    if is_recorded(airframe):
        raise BadInput(f"AIRCRAFT: {airframe.name} is what was fitted to a recorded flight: there is no model to fly")
    speed = limits(airframe).design_airspeed if airspeed is None else airspeed
    writable_folder(out)
    files = [writable(out / f"{airframe.name}_identified.toml"), *([writable(file_of(airframe))] if keep else [])]
    plots = {
        writable(out / f"{airframe.name}_step.svg"): step_plot,
        writable(out / f"{airframe.name}_bode.svg"): bode_plot,
    }
    try:
        others = [other for other in read(airframe) if other.airspeed != speed]
    except IdentifiedError:
        others = []  # a damaged file is written anew
    try:
        with progress(f"identifying {airframe.name}", work, counted=False) as advance:
            identification = job.identify(airframe, speed, done=advance)
    except PlantError as error:
        raise BadInput(f"--airspeed: {error}") from None
    except End as end:
        raise BadInput(f"--airspeed: at {speed:g} m/s a manoeuvre ended in {end.outcome}: {end}") from None
    for line in summary_lines(identification):
        click.echo(line)
    drawn = {path: plot(identification) for path, plot in plots.items()}
    parameters = document(airframe, [*others, identification.identified])
    for path, text in {**dict.fromkeys(files, parameters), **drawn}.items():
        write_text(path, text)
    click.echo(f"parameters: {', '.join(map(str, files))}\nplots: {', '.join(map(str, plots))}")
