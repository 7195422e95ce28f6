"""`harness check`: is a settings file right?"""

from pathlib import Path

import click

from harness.cli._paths import PATH
from harness.cli._setting import SETTING


@click.command()
@click.argument("file", type=PATH)
@click.option(
    "--set", "overrides", multiple=True, type=SETTING, metavar="KEY=VALUE", help="Override a setting; repeatable."
)
def check(file: Path, overrides: tuple[str, ...]) -> None:
    """Check a settings file without flying it.

    Prints every mistake with its line, what is wrong and what is allowed; the warnings; and whether the circle can be
    held. Every flight of a matrix is checked.

    \b
    Example:
      harness check experiments/stationary.toml
    """
    from harness.cli._input import BadInput, flight_of, read_file
    from harness.cli._matrix import print_survey, surveyed
    from harness.feasibility import feasibility_line, warnings
    from harness.runs.matrix import read_matrix
    from harness.settings import SettingsError

    settings = read_file(file, overrides)
    matrix = read_matrix(settings, draft=True)
    try:
        size = surveyed(matrix)
    except SettingsError as error:
        raise BadInput(str(error)) from None
    if size.flights != 1:
        print_survey(matrix, size, 0)
    else:
        (combination,) = matrix.combinations()
        flight = flight_of(matrix.located(combination))
        click.echo(feasibility_line(flight))
        for warning in warnings(flight):
            click.echo(f"warning: {warning}", err=True)
    click.echo(f"{file}: ok")
