"""`harness show`: a row of a run in words."""

import click


@click.command()
@click.argument("row", metavar="DIR:KEY")
def show(row: str) -> None:
    """Tell the story of a flight of a run: its settings, its metrics, why it ended, where it comes from.

    The beginning of the key is enough.

    \b
    Example:
      harness show out/wind:3f2a
    """
    from harness.commands.telling import BadInput
    from harness.runs.recall import place_of
    from harness.runs.store import StoreError, find
    from harness.runs.story import story

    place = place_of(row)
    if place is None:
        raise BadInput(f"{row}: is no DIR:KEY, a directory of `harness run` and the beginning of a key")
    try:
        for line in story(place.folder, find(*place)):
            click.echo(line)
    except StoreError as error:
        raise BadInput(str(error)) from None
