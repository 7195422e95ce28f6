"""Standard output that is closed or full; characters that it or standard error cannot encode."""

import codecs
import io
import os
import sys
from typing import Any

import click

from harness.cli._input import BadInput

_ANY_TEXT = "harness"  # the name under which Python knows `_encoded`
CLOSED = 141  # the exit code of a program that SIGPIPE ends, as shells report it


def guard() -> None:
    """Makes a failing write end the command: silently on a closed pipe, otherwise as bad input with the reason.

    Names of files are written as the bytes that they are, and other characters outside the encoding as escapes.
    """
    codecs.register_error(_ANY_TEXT, _encoded)
    if (out := sys.stdout) is not None:
        raw = io.BufferedWriter(_Stdout(out.fileno(), "w", closefd=False))
        sys.stdout = io.TextIOWrapper(raw, _encoding(out.encoding), _ANY_TEXT, line_buffering=out.isatty())
    if sys.stderr is None:  # closed: the first file that is opened would take its place
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    if sys.stderr is None or isinstance(sys.stderr, io.TextIOWrapper):
        encoding = "utf-8" if sys.stderr is None else _encoding(sys.stderr.encoding)
        quiet = io.BufferedWriter(_Stderr(2, "w", closefd=False))
        sys.stderr = io.TextIOWrapper(quiet, encoding, _ANY_TEXT, line_buffering=True)


def _encoding(declared: str) -> str:
    """The encoding to write in: where a locale knows ASCII alone, its terminal shows UTF-8 all the same."""
    return "utf-8" if codecs.lookup(declared).name == "ascii" else declared


def _encoded(error: UnicodeError) -> tuple[str | bytes, int]:
    try:
        return codecs.lookup_error("surrogateescape")(error)
    except UnicodeError:
        return codecs.backslashreplace_errors(error)


class _Stderr(io.FileIO):
    """Standard error whose failures are ignored, so that they do not end a run."""

    def write(self, content: Any) -> int:
        try:
            return super().write(content)
        except OSError:
            return len(content)


class _Stdout(io.FileIO):
    """Standard output whose failures are not mistaken for an `OSError` of a file that a command handles."""

    def write(self, content: Any) -> int:
        try:
            return super().write(content)
        except OSError as error:
            os.dup2(os.open(os.devnull, os.O_WRONLY), self.fileno())  # what is left would fail again at the exit
            if isinstance(error, BrokenPipeError):
                raise click.exceptions.Exit(CLOSED) from None
            raise BadInput(f"standard output: {error.strerror}") from None
