"""`harness doctor`: is this installation sound?"""

import click


@click.command()
def doctor() -> None:
    """Versions, and self-tests of wind and units on JSBSim.

    \b
    Example:
      harness doctor
    """
    from harness.doctor import examine

    sound = True
    for test in examine():
        sound = sound and test.passed
        click.echo(f"{'ok  ' if test.passed else 'BAD '} {test.name:32} {test.measured}")
    click.echo("sound" if sound else "NOT SOUND: results of this installation cannot be trusted")
    raise SystemExit(0 if sound else 1)
