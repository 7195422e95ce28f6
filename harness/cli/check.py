"""`harness check`: is a settings file right?"""

from pathlib import Path

import click


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="Override a setting; may be repeated.")
def check(file: Path, overrides: tuple[str, ...]) -> None:
    """Validate FILE without flying: every error with its line, then the warnings. A matrix is checked whole.

    \b
    Example:
      harness check experiments/stationary.toml
    """
    from harness.cli._input import BadInput, flight_of, read_file
    from harness.cli._progress import surveyed, tell_survey
    from harness.feasibility import feasibility_line, warnings
    from harness.runs.matrix import read_matrix
    from harness.settings import SettingsError

    settings = read_file(file, overrides)
    if settings.document.get("matrix"):
        try:
            matrix = read_matrix(settings)
            tell_survey(matrix, surveyed(matrix), 0)
        except SettingsError as error:
            raise BadInput(str(error)) from None
    else:
        flight = flight_of(settings)
        click.echo(feasibility_line(flight))
        for warning in warnings(flight):
            click.echo(f"warning: {warning}")
    click.echo(f"{file}: ok")
