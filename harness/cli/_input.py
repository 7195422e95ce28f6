"""What several commands do alike: bad input told, files read and places tried."""

from __future__ import annotations

import os
import shlex
import sys
import tempfile
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from harness.flight import Flight
    from harness.settings import SettingsFile


class BadInput(click.ClickException):
    """What the user gave cannot be used: its text, as it is, on stderr; exit code 2."""

    exit_code = 2

    def show(self, file: IO[Any] | None = None) -> None:
        click.echo(self.message, err=True)


def read_file(path: Path, overrides: tuple[str, ...]) -> SettingsFile:
    """The file as read."""
    from harness.settings import SettingsError, read_settings

    try:
        return read_settings(path, overrides)
    except SettingsError as error:
        raise BadInput(str(error)) from None


def flight_of(file: SettingsFile) -> Flight:
    """The flight that a file describes, once put to its start: what cannot start is bad input."""
    from harness.checks import try_start
    from harness.plants.plant import PlantError
    from harness.settings import SettingsError

    try:
        flight = file.flight()
    except SettingsError as error:
        raise BadInput(str(error)) from None
    try:
        try_start(flight)
    except PlantError as error:
        raise BadInput(f"{file.locate(error.key)}: {error}") from None
    return flight


def typed() -> str:
    """The command as it was typed."""
    return shlex.join(["harness", *sys.argv[1:]])


def busy(what: str) -> AbstractContextManager[object]:
    """Says on a terminal what takes its time."""
    from rich.console import Console

    terminal = Console(stderr=True)
    return terminal.status(what) if terminal.is_terminal else nullcontext()


def writable(path: Path) -> Path:
    """The path, if a file can be made there."""
    folder = path.parent
    try:
        if path.is_dir():
            raise BadInput(f"{path}: is a folder, not a file")
        if not folder.is_dir():
            raise BadInput(f"{path}: there is no folder {folder}")
        if path.exists() and not path.is_file():
            raise BadInput(f"{path}: is there, and no file that can be replaced")
        if path.exists() and not (os.access(path, os.W_OK) and path.stat().st_mode & 0o222):
            raise BadInput(f"{path}: is there, and write-protected")
        _probe(folder)
    except OSError as error:
        raise BadInput(f"{path}: cannot be written: {error.strerror}") from None
    return path


def writable_folder(path: Path) -> Path:
    """The folder, made if need be, if files can be made in it."""
    try:
        if path.exists() and not path.is_dir():
            raise BadInput(f"{path}: is a file, not a folder")
        path.mkdir(parents=True, exist_ok=True)
        _probe(path)
    except OSError as error:
        raise BadInput(f"{path}: cannot be written to: {error.strerror}") from None
    return path


def _probe(folder: Path) -> None:
    with tempfile.TemporaryFile(dir=folder):
        pass
