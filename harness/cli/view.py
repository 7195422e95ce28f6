"""`harness view`: flights in the Rerun viewer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from harness.cli._paths import PATH, PATH_OR_ROW

if TYPE_CHECKING:
    from harness.log import FlightLog

_MOST_OFFERED = 20  # largest number of flights listed when none is chosen


@click.command()
@click.argument("what", metavar="[DIR|DIR:KEY|FILE.rrd|FILE.toml]", type=PATH_OR_ROW, required=False)
@click.option(
    "--flight", "flights", multiple=True, metavar="KEY", help="A flight to show, up to 6; the first is the reference."
)
@click.option("--pair", metavar="KEY", help="Show this flight on every plant; kinematic is the reference.")
@click.option("--save", type=PATH, metavar="FILE.rrd", help="Write this recording; open no viewer.")
@click.option("--web", is_flag=True, help="Serve the viewer to a browser, here or by SSH; open no window.")
@click.option("--port", type=click.IntRange(1, 65535), default=9876, show_default=True, help="Port of the viewer.")
def view(what: str | None, flights: tuple[str, ...], pair: str | None, save: Path | None, web: bool, port: int) -> None:
    """Open flights in the Rerun viewer.

    Several flights share one scene and the same plots. The beginning of a KEY is enough; for a FILE.rrd with
    several flights, KEY is the name of a flight. A flight without a recording is flown again and compared with what
    is stored; a FILE.toml, such as the counter-example of `harness falsify`, is flown. Without arguments an empty
    viewer opens, for `harness fly --live`. With --save prints the file written. With --web, for a machine without a
    screen, prints the address to open and the SSH tunnel to type, and listens on 127.0.0.1 alone.

    \b
    Examples:
      harness view flight.rrd
      harness view out/wind --flight 3f2a --flight 9c01
      harness view out/wind --pair 3f2a --save pair.rrd
      harness view out/wind --pair 3f2a --web
      harness view out/falsify/counterexample.toml
    """
    import tempfile

    from harness.cli._input import BadInput, typed
    from harness.cli._paths import writable

    if what is None:
        if flights or pair or save or web:
            raise BadInput(
                "--flight, --pair, --save and --web require a folder or a file: harness view DIR|FILE.rrd ..."
            )
        click.echo(
            f"opening an empty viewer, for harness fly --live{'' if port == 9876 else f' --port {port}'}", err=True
        )
        return _open(None, port)
    if save is not None and web:
        raise BadInput("--save and --web exclude each other")
    if save is not None:
        writable(save)
    logs = _logs(what, flights, pair)
    if logs is None and save is None:
        return _open(Path(what), port, web)
    if logs is None:
        raise BadInput(f"{what}: is a recording already; copy it, or choose some simulated flights with --flight NAME")

    from harness.review.recording import write_recording

    title = f"{Path(what).name}: {' | '.join(logs)}"
    if save is not None:
        write_recording(save, logs, title, command=typed())
        click.echo(f"{save}: {', '.join(logs)}. To open it: harness view {save}")
        return None
    with tempfile.TemporaryDirectory(prefix="standoff-harness-") as folder:
        path = Path(folder) / "flights.rrd"
        write_recording(path, logs, title, command=typed())
        _open(path, port, web)
    return None


def _logs(what: str, flights: tuple[str, ...], pair: str | None) -> dict[str, FlightLog] | None:
    """The requested flights, by name; None: all of a recording, as it is."""
    from harness.cli._flights import say
    from harness.cli._input import BadInput
    from harness.review.styled import MOST
    from harness.runs.journal import StoreError
    from harness.runs.logs import distinctly_named, pair_of_row
    from harness.runs.recall import row_address
    from harness.settings import SettingsError

    if pair is not None and flights:
        raise BadInput("--pair and --flight exclude each other")
    if len(flights) > MOST:
        raise BadInput(f"--flight is given {len(flights)} times, must be at most {MOST} times")
    path = Path(what)
    if path.is_file():
        if pair is not None:
            raise BadInput(f"{what}: is a file; --pair is for a folder that `harness run` wrote")
        if path.suffix == ".toml":
            if flights:
                raise BadInput(f"{what}: is one flight; --flight is for a folder or a recording")
            return _of_settings(path)
        return _of_file(path, flights)
    place = row_address(what)
    if place is not None:
        flights, path = (place.beginning, *flights), place.folder
    elif not path.is_dir():
        raise BadInput(f"{what}: no such file or folder")
    elif not flights and pair is None:
        from harness.cli.show import show

        click.get_current_context().invoke(show, row=what, limit=_MOST_OFFERED)
        raise BadInput(f"{what}: choose flights with --flight KEY or --pair KEY; `harness show {what}` lists the keys")
    if pair is None:
        return distinctly_named(_rows(path, flights))
    try:
        return distinctly_named(pair_of_row(path, pair, say))
    except (StoreError, SettingsError, ValueError) as error:
        raise BadInput(str(error)) from None


def _of_settings(path: Path) -> dict[str, FlightLog]:
    """The flight of a settings file, flown."""
    from harness.cli._input import flight_of, read_file
    from harness.cli.fly import log_of

    flight = flight_of(read_file(path, ()))
    return {flight.plant: log_of(flight)}


def _rows(folder: Path, keys: tuple[str, ...]) -> list[FlightLog]:
    from harness.cli._flights import row
    from harness.cli._progress import progress

    logs = []
    with progress("reading flights", len(keys)) as advance:
        for key in keys:
            logs.append(row(folder, key))
            advance()
    return logs


def _of_file(path: Path, names: tuple[str, ...]) -> dict[str, FlightLog] | None:
    from harness.cli._flights import recorded
    from harness.cli._input import BadInput

    if not names:
        return None
    held = recorded(path)
    if not held:
        raise BadInput(f"{path}: holds no simulated flight; `harness view {path}` opens it as it is")
    for name in names:
        if name not in held:
            raise BadInput(f"{path}: holds no flight {name!r}; it holds {', '.join(held)}")
    return {name: held[name] for name in names}


def _open(path: Path | None, port: int, web: bool = False) -> None:
    from harness.cli._input import BadInput
    from harness.review.viewer import ViewerError, serve, show

    try:
        if web and path is not None:
            serve(path, click.echo, port)
        else:
            show(path, port)
    except ViewerError as error:
        raise BadInput(str(error)) from None
