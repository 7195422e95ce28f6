"""`harness check`: is a settings file right?"""

from pathlib import Path

import click

from harness.cli._paths import PATH


@click.command()
@click.argument("file", type=PATH)
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="Override a setting; repeatable.")
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
    if settings.document.get("matrix"):
        try:
            matrix = read_matrix(settings)
            print_survey(matrix, surveyed(matrix), 0)
        except SettingsError as error:
            raise BadInput(str(error)) from None
    else:
        flight = flight_of(settings)
        click.echo(feasibility_line(flight))
        for warning in warnings(flight):
            click.echo(f"warning: {warning}", err=True)
    click.echo(f"{file}: ok")
