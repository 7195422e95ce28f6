"""`harness check`: checks a settings file, or a user-defined law."""

from pathlib import Path

import click

from harness.cli._paths import PATH
from harness.cli._setting import SETTING


@click.command()
@click.argument("file", metavar="FILE", type=PATH)
@click.option(
    "--set", "overrides", multiple=True, type=SETTING, metavar="KEY=VALUE", help="Override a setting; repeatable."
)
def check(file: Path, overrides: tuple[str, ...]) -> None:
    """Check a settings file, or a user-defined law, without flying it.

    Prints every mistake with its line, what is wrong and what is allowed; the warnings; and whether the circle can be
    held. Every flight of a matrix is checked. For a law, FILE.py or FILE.py:CLASS, it prints whether each command is
    finite, limited, reproducible and mirrored in a mirrored world, whether two simultaneous flights are independent,
    and the computing time of a command.

    \b
    Examples:
      harness check experiments/stationary.toml
      harness check my_law.py
    """
    from harness.cli._input import BadInput, flight_of, read_file
    from harness.cli._matrix import print_survey, surveyed
    from harness.feasibility import feasibility_line, warnings
    from harness.runs.matrix import read_matrix
    from harness.settings import SettingsError
    from harness.settings.laws import source_of
    from harness.settings.tried import slowness

    if file.suffix == ".py" or ".py:" in file.name:
        if overrides:
            raise BadInput("--set is for a settings file")
        _check_law(str(file))
        return
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
        for warning in [*warnings(flight, of_circle=False), *(slowness(flight) if source_of(flight.law) else ())]:
            click.echo(f"warning: {warning}", err=True)
    click.echo(f"{file}: ok")


def _check_law(what: str) -> None:
    """Examines the laws of a file. Raises `BadInput` with what is wrong."""
    from harness.cli._input import BadInput
    from harness.doctor.own_law import classes, examined, flights
    from harness.settings import SettingsError
    from harness.settings.law_source import LawError
    from harness.settings.laws import absolute, kind_of
    from harness.tables import table

    path, colon, name = what.rpartition(":") if not what.endswith(".py") else (what, "", "")
    try:
        names = [name] if colon else classes(Path(path))
    except OSError as error:
        raise BadInput(f"{path}: {error.strerror or error}") from None
    except (SyntaxError, ValueError) as error:
        raise BadInput(f"{path}:{getattr(error, 'lineno', None) or 1}: is not valid Python: {error}") from None
    if not names:
        raise BadInput(f"{path}: it has no class; `harness init --law NAME` writes one")
    wrong = []
    for name in names:
        law = absolute(f"{path}:{name}", Path())
        try:
            of_sets = flights(law, kind_of(law, run=True).sets)
        except (LawError, SettingsError) as error:
            wrong.append(str(error))
            continue
        for gains, flight in of_sets.items():
            called = f"{name} with gains {gains}" if gains else name
            click.echo(f"{called}:")
            found = list(examined(flight))
            rows = [[f"  {one.question}", "ok" if one.is_right else "WRONG", one.text] for one in found]
            for line in table([], rows):
                click.echo(line)
            wrong += [f"{path}: {called}: {one.question}: {one.text}" for one in found if not one.is_right]
    if wrong:
        raise BadInput("\n".join(wrong))
    click.echo(f"{what}: ok")
