"""`harness view`: flights in the Rerun viewer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from harness.log import FlightLog


@click.command()
@click.argument("what", metavar="[DIR|DIR:KEY|FILE.rrd]", required=False)
@click.option(
    "--flight", "flights", multiple=True, metavar="KEY", help="A flight of it, up to 6; the first is the reference."
)
@click.option("--pair", metavar="KEY", help="The same flight on each plant, the kinematic one the reference.")
@click.option("--save", type=click.Path(path_type=Path), metavar="FILE.rrd", help="Write the recording; open nothing.")
@click.option(
    "--port", type=click.IntRange(1, 65535), default=9876, show_default=True, help="Where the viewer listens."
)
def view(what: str | None, flights: tuple[str, ...], pair: str | None, save: Path | None, port: int) -> None:
    """Open flights in the Rerun viewer, several in one scene and the same plots.

    The beginning of a KEY is enough; of a FILE.rrd with several flights, KEY is a flight's name. A flight without a
    recording is flown again from its row, and compared with what is stored. Without arguments an empty viewer opens,
    for `harness fly --live`.

    \b
    Examples:
      harness view flight.rrd
      harness view out/wind --flight 3f2a --flight 9c01
      harness view out/wind --pair 3f2a --save pair.rrd
    """
    import tempfile

    from harness.cli._input import BadInput, typed
    from harness.cli._paths import writable

    if what is None:
        if flights or pair or save:
            raise BadInput("of which directory or file? harness view DIR|FILE.rrd ...")
        click.echo(f"an empty viewer, for harness fly --live{'' if port == 9876 else f' --port {port}'}", err=True)
        return _open(None, port)
    if save is not None:
        writable(save)
    logs = _logs(what, flights, pair)
    if logs is None and save is None:
        return _open(Path(what), port)
    if logs is None:
        raise BadInput(f"{what}: is a recording already; choose of its flights with --flight NAME")

    from harness.review.recording import write_recording

    title = f"{Path(what).name}: {' | '.join(logs)}"
    if save is not None:
        write_recording(save, logs, title, command=typed())
        click.echo(f"{save}: {', '.join(logs)}. To open it: harness view {save}")
        return None
    with tempfile.TemporaryDirectory(prefix="standoff-harness-") as folder:
        path = Path(folder) / "flights.rrd"
        write_recording(path, logs, title, command=typed())
        _open(path, port)
    return None


def _logs(what: str, flights: tuple[str, ...], pair: str | None) -> dict[str, FlightLog] | None:
    """The flights asked for, by name; None: all of a recording, as it is."""
    from harness.cli._input import BadInput
    from harness.review.styled import MOST
    from harness.runs.logs import distinctly_named, pair_of_row
    from harness.runs.recall import row_address
    from harness.runs.store import StoreError
    from harness.settings import SettingsError

    if pair is not None and flights:
        raise BadInput("--pair or --flight, not both")
    if len(flights) > MOST:
        raise BadInput(f"{len(flights)} flights: up to {MOST} can be told apart")
    path = Path(what)
    if path.is_file():
        if pair is not None:
            raise BadInput(f"{what}: is one file; --pair is for a directory of `harness run`")
        return _of_file(path, flights)
    place = row_address(what)
    if place is not None:
        flights, path = (place.beginning, *flights), place.folder
    elif not path.is_dir():
        raise BadInput(f"{what}: there is no such file or directory")
    elif not flights and pair is None:
        raise BadInput(f"{what}: which flights? Name them with --flight KEY, or one with --pair KEY")
    try:
        if pair is not None:
            return distinctly_named(pair_of_row(path, pair, _say))
        return distinctly_named(_rows(path, flights))
    except (StoreError, SettingsError, ValueError) as error:
        raise BadInput(str(error)) from None


def _rows(folder: Path, keys: tuple[str, ...]) -> list[FlightLog]:
    from rich.console import Console
    from rich.progress import track

    from harness.runs.logs import flight_of_row

    terminal = Console(stderr=True)
    quiet = not terminal.is_terminal
    return [
        flight_of_row(folder, key, _say)
        for key in track(keys, "reading", console=terminal, transient=True, disable=quiet)
    ]


def _of_file(path: Path, names: tuple[str, ...]) -> dict[str, FlightLog] | None:
    from harness.cli._input import BadInput
    from harness.review.reading import read_logs

    if not names:
        return None
    try:
        held = read_logs(path)
    except (OSError, ValueError) as error:
        raise BadInput(str(error)) from None
    for name in names:
        if name not in held:
            raise BadInput(f"{path}: no flight {name!r}; it holds {', '.join(held)}")
    return {name: held[name] for name in names}


def _open(path: Path | None, port: int) -> None:
    from harness.cli._input import BadInput
    from harness.review.viewer import ViewerError, show

    try:
        show(path, port)
    except ViewerError as error:
        raise BadInput(str(error)) from None


def _say(line: str) -> None:
    click.echo(line, err=True)
