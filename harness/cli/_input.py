"""User input: the command line as typed, the settings file and its flight, and the error for invalid input."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from harness.flight import Flight
    from harness.settings import SettingsFile


class BadInput(click.ClickException):
    """Invalid input: only the message goes to stderr; exit code 2."""

    exit_code = 2

    def show(self, file: IO[Any] | None = None) -> None:
        click.echo(self.message, err=True)


def read_file(path: Path, overrides: tuple[str, ...]) -> SettingsFile:
    """The file as read. Raises `BadInput`."""
    from harness.settings import SettingsError, read_settings

    try:
        return read_settings(path, overrides)
    except SettingsError as error:
        raise BadInput(str(error)) from None


def flight_of(file: SettingsFile) -> Flight:
    """The flight that a file describes. Its start is tried: a flight that cannot start raises `BadInput`."""
    from harness.settings import SettingsError

    try:
        return file.flight(started=True)
    except SettingsError as error:
        raise BadInput(str(error)) from None


def typed() -> str:
    """The command as the user typed it."""
    return shlex.join(["harness", *sys.argv[1:]])
