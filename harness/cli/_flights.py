"""Flights that the command line names: rows of a run, and what recordings hold."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from harness.cli._input import BadInput

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from harness.log import FlightLog


def flights_of(places: Sequence[str]) -> dict[str, FlightLog]:
    """The flights of `DIR:KEY` and `FILE.rrd`, by distinct names. Raises `BadInput`, for a folder with its flights."""
    from harness.cli._progress import progress
    from harness.runs.logs import distinctly_named

    held: list[Mapping[str, FlightLog]] = []
    with progress("reading flights", len(places)) as advance:
        for place in places:
            held.append(_held(place))
            advance()
    if len(held) == 1 and len(held[0]) > 1:
        return dict(held[0])  # by the names that the recording gives them
    return distinctly_named([log for logs in held for log in logs.values()])


def row(folder: Path, beginning: str) -> FlightLog:
    """The log of a row of a run, read or flown again, with what the user should know on standard error."""
    from harness.runs.journal import StoreError
    from harness.runs.logs import flight_of_row
    from harness.settings import SettingsError

    try:
        return flight_of_row(folder, beginning, say)
    except (StoreError, SettingsError, ValueError) as error:
        raise BadInput(str(error)) from None


def recorded(path: Path) -> dict[str, FlightLog]:
    """The flights of a recording, by name. Raises `BadInput`."""
    from harness.review.reading import read_logs

    try:
        return read_logs(path)
    except OSError as error:
        raise BadInput(f"{path}: {error.strerror or error}") from None
    except ValueError as error:
        raise BadInput(str(error)) from None


def choose_from(folder: Path, how: str) -> BadInput:
    """The error for a folder that is named without a flight: its flights, and how to choose one."""
    from harness.runs.journal import StoreError
    from harness.runs.results import load_results

    try:
        flights = load_results(folder)
    except StoreError as error:
        return BadInput(str(error))
    return BadInput(f"{folder}: holds {len(flights)} flights; choose with {how}")


def say(line: str) -> None:
    """A line on standard error."""
    click.echo(line, err=True)


def _held(place: str) -> Mapping[str, FlightLog]:
    from harness.runs.recall import row_address

    if address := row_address(place):
        return {place: row(*address)}
    path = Path(place)
    if path.is_dir():
        raise choose_from(path, f"{place}:KEY; `harness show {place}` lists them")
    if not path.is_file():
        raise BadInput(f"{place}: no such file or folder")
    return recorded(path)
