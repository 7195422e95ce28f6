"""`harness list`: what there is."""

import click


@click.command("list")
@click.argument("kind", type=click.Choice(["laws", "aircraft", "plants", "metrics", "margins"]))
def list_(kind: str) -> None:
    """What there is of a KIND, a line each.

    \b
    Example:
      harness list laws
    """
    from harness.catalog import lines

    for line in lines(kind):
        click.echo(line)
