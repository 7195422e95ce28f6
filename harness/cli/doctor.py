"""`harness doctor`: is this installation sound?"""

import click


@click.command()
def doctor() -> None:
    """Check this installation: packages, wind, units and the bits of flights.

    Prints a table of what was checked, with "ok", "MISSING" or "BAD", and whether the installation is sound. Packages
    are loaded, and the viewer's program is started. Each airframe is flown in JSBSim to check wind and units. Thirty
    stored flights are flown anew: where another processor or another version of a library moves their last bits, the
    table reports by how much, and which results changed. Exit code 1 when a check fails.

    \b
    Example:
      harness doctor
    """
    from harness.cli._progress import busy
    from harness.doctor import Soundness, examine
    from harness.tables import table

    with busy("examining this installation"):
        findings = list(examine())
    for line in table(["", "what", "measured"], ([found.state, found.name, found.measured] for found in findings)):
        click.echo(line)
    states = {found.state for found in findings}
    if Soundness.BAD in states:
        click.echo("NOT SOUND: results of this installation cannot be trusted")
    elif Soundness.MISSING in states:
        click.echo("INCOMPLETE: install what is missing")
    else:
        click.echo("sound")
    raise SystemExit(0 if states == {Soundness.OK} else 1)
