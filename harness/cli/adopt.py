"""`harness adopt`: an aircraft from a third-party JSBSim model."""

import math
from pathlib import Path

import click

from harness.cli._paths import PATH


@click.command()
@click.argument("model")
@click.option(
    "--airspeed", type=click.FloatRange(min=1.0, max=1e4), help="Trim airspeed, m/s. [default: found from the lift]"
)
@click.option(
    "--altitude", type=click.FloatRange(min=20.0, max=3e4), default=1000.0, show_default=True, help="Altitude, m."
)
@click.option(
    "--max-bank",
    type=click.FloatRange(min=5.0, max=60.0),
    default=35.0,
    show_default=True,
    help="Bank limit in turns, degrees.",
)
@click.option(
    "--bandwidth",
    type=click.FloatRange(min=0.05, max=100.0),
    help="Target bandwidth of the bank loop, rad/s. [default: what the aircraft allows]",
)
@click.option(
    "--controls", type=PATH, help="A TOML file that names the properties of elevator, aileron, rudder and throttle."
)
@click.option("--out", type=PATH, default=Path(), show_default=True, help="Write the aircraft's folder here.")
def adopt(
    model: str,
    airspeed: float | None,
    altitude: float,
    max_bank: float,
    bandwidth: float | None,
    controls: Path | None,
    out: Path,
) -> None:
    """Make an aircraft of a JSBSim model, with an inner loop of its own.

    MODEL is a file, or the name of a model that comes with JSBSim. Starts its engines, trims it, measures its
    derivatives, designs gains by one rule for all aircraft, flies a change of course by 90 deg and a circle, and
    identifies how the aircraft follows its commands. Prints a line for each stage. When all of it succeeds, the folder
    OUT/NAME is written: `aircraft = "OUT/NAME"` then flies it, and circle.toml in it is an experiment to begin with.
    Otherwise the stage reports why, and the exit code is 1. An aircraft that cannot be identified is still adopted,
    without the plants lagged and coordinated. Takes about 10 s, a minute at most.

    \b
    Examples:
      harness adopt c172p
      harness adopt my_models/glider_tug.xml --airspeed 40 --out aircraft
      harness adopt f16 --bandwidth 1.5
    """
    from harness.adoption.adopt import adopt as stages
    from harness.adoption.adoption import Wish
    from harness.adoption.refusal import NoSuchPropertyError, RefusalError
    from harness.cli._input import BadInput
    from harness.cli._paths import writable_folder

    for option, value in (
        ("--airspeed", airspeed), ("--altitude", altitude), ("--max-bank", max_bank), ("--bandwidth", bandwidth)
    ):  # fmt: skip
        if value is not None and not math.isfinite(value):
            raise BadInput(f"{option}: {value}, must be a finite number")
    names, places = _controls(controls) if controls else (None, {})
    writable_folder(out)
    wish = Wish(
        airspeed=airspeed,
        altitude=altitude,
        max_bank=math.radians(max_bank),
        bandwidth=bandwidth,
        controls=names,
    )
    try:
        for stage, found in stages(model, out, wish):
            click.echo(f"{stage:<10} {found}")
    except NoSuchPropertyError as error:
        raise BadInput(f"{places[error.name]}: {error.message}") from None
    except RefusalError as error:
        if error.stage == "guard":
            raise BadInput(str(error)) from None
        click.echo(f"not adopted: {error}", err=True)
        raise SystemExit(1) from None
    name = Path(model).stem
    click.echo(f'adopted: aircraft = "{out / name}"; try harness fly {out / name / "circle.toml"}')


def _controls(file: Path) -> tuple[dict[str, object], dict[str, str]]:
    """The names of properties in the file, and where each stands. Raises `BadInput`."""
    import tomllib

    from harness.cli._input import BadInput
    from harness.fence import fault_of_command
    from harness.files import read
    from harness.settings.toml_locator import key_lines, nearest_line

    allowed = ("elevator", "aileron", "rudder", "throttle")
    try:
        content = read(file).decode()
        table = tomllib.loads(content)
    except OSError as error:
        raise BadInput(f"--controls: {file}: {error.strerror}") from None
    except ValueError as error:
        raise BadInput(f"--controls: {file}: {error}") from None
    lines, places = key_lines(content), {}
    for name, value in table.items():
        at = f"--controls: {file}:{nearest_line(lines, (name,))}: {name}"
        if name not in allowed:
            raise BadInput(f"{at} is not one of {', '.join(allowed)}")
        texts = value if isinstance(value, list) and name == "throttle" else [value]
        if not texts or not all(isinstance(text, str) and text.strip() for text in texts):
            raise BadInput(f"{at} must be the name of a property")
        for i, text in enumerate(texts):
            places[text] = f"--controls: {file}:{nearest_line(lines, (name, i))}: {name}"
            if fault := fault_of_command(text):
                raise BadInput(f"{places[text]}: {fault}")
    return table, places
