"""Files and folders on the command line; those that a command will write are tried before the work begins."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Any

import click

from harness.cli._input import BadInput
from harness.files import make_folder


class PathType(click.Path):
    """A path that is not empty: an empty one would be the working folder."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if str(value) == "":
            self.fail("is empty, must name a file or a folder", param, ctx)
        return super().convert(value, param, ctx)


PATH = PathType(path_type=Path)
PATH_OR_ROW = PathType(path_type=str)  # DIR:KEY is no path


def writable(path: Path) -> Path:
    """The path, if a file can be written there. Raises `BadInput`."""
    folder = path.parent
    try:
        if path.is_dir():
            raise BadInput(f"{path}: is a folder, not a file")
        if not folder.is_dir():
            raise BadInput(f"{path}: the folder {folder} does not exist")
        if path.exists() and not path.is_file():
            raise BadInput(f"{path}: exists and is not a regular file, so it cannot be replaced")
        if path.exists() and not (os.access(path, os.W_OK) and path.stat().st_mode & 0o222):
            raise BadInput(f"{path}: exists and is write-protected")
        _try_to_write(folder)
    except OSError as error:
        raise BadInput(f"{path}: cannot be written: {error.strerror}") from None
    return path


def writable_folder(path: Path) -> Path:
    """The folder, which is made when it does not exist, if files can be written in it. Raises `BadInput`."""
    try:
        if path.exists() and not path.is_dir():
            raise BadInput(f"{path}: is a file, not a folder")
        make_folder(path)
        _try_to_write(path)
    except OSError as error:
        raise BadInput(f"{path}: cannot be written to: {error.strerror}") from None
    return path


def _try_to_write(folder: Path) -> None:
    with tempfile.TemporaryFile(dir=folder):
        pass
