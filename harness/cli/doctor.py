"""`harness doctor`: is this installation sound?"""

import click


@click.command()
def doctor() -> None:
    """Check this installation: versions, wind and units.

    Prints a table of what was checked, with "ok" or "BAD", and whether the installation is sound. The wind and the
    units are checked by flying each airframe in JSBSim. Exit code 1 when a check fails.

    \b
    Example:
      harness doctor
    """
    from harness.doctor import examine
    from harness.tables import table

    tests = list(examine())
    sound = all(test.passed for test in tests)
    rows = (["ok" if test.passed else "BAD", test.name, test.measured] for test in tests)
    for line in table(["", "what", "measured"], rows):
        click.echo(line)
    click.echo("sound" if sound else "NOT SOUND: results of this installation cannot be trusted")
    raise SystemExit(0 if sound else 1)
