"""`harness check`: is a settings file right?"""

from pathlib import Path

import click


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="Override a setting; may be repeated.")
def check(file: Path, overrides: tuple[str, ...]) -> None:
    """Validate FILE without flying: every error with its line, then the warnings.

    \b
    Example:
      harness check experiments/stationary.toml
    """
    from harness.commands.telling import feasibility_line, read_flight_file
    from harness.flight import warnings

    _, flight = read_flight_file(file, overrides)
    click.echo(feasibility_line(flight))
    for warning in warnings(flight):
        click.echo(f"warning: {warning}")
    click.echo(f"{file}: ok")
