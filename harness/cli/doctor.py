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
    for finding in examine():
        sound = sound and finding.sound
        click.echo(f"{'ok  ' if finding.sound else 'BAD '} {finding.what:32} {finding.measured}")
    click.echo("sound" if sound else "NOT SOUND: results of this installation cannot be trusted")
    raise SystemExit(0 if sound else 1)
