"""Standard output that nobody reads any more, or that has no room: told once, whichever command writes."""

import io
import os
import sys
from typing import Any

import click

from harness.cli._input import BadInput

CLOSED = 141  # the exit code of a program that SIGPIPE ends, as shells tell it


def guard() -> None:
    """From now on a write that fails ends the command: quietly on a closed pipe, else as bad input with the reason."""
    if (out := sys.stdout) is not None:
        raw = io.BufferedWriter(_Stdout(out.fileno(), "w", closefd=False))
        sys.stdout = io.TextIOWrapper(raw, out.encoding, out.errors, line_buffering=out.isatty())


class _Stdout(io.FileIO):
    """What fails here is no `OSError` of a file that a command handles."""

    def write(self, content: Any) -> int:
        try:
            return super().write(content)
        except OSError as error:
            os.dup2(os.open(os.devnull, os.O_WRONLY), self.fileno())  # what is left would fail again at the exit
            if isinstance(error, BrokenPipeError):
                raise click.exceptions.Exit(CLOSED) from None
            raise BadInput(f"standard output: {error.strerror}") from None
