"""The options of all commands that fly many flights."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import click

from harness.cli._setting import SETTING

Command = TypeVar("Command", bound=Callable[..., Any])

_OPTIONS = (
    click.option(
        "--workers", type=click.IntRange(0, 1024), help="Processes; 0: this one. [default: one per processor]"
    ),
    click.option(
        "--dask", metavar="SCHEDULER", help="Fly on a Dask cluster: the address or the file of its scheduler."
    ),
    click.option(
        "--set", "overrides", multiple=True, type=SETTING, metavar="KEY=VALUE",
        help="Set a key, or several values of it; repeatable.",
    ),
    click.option(
        "--retry", type=click.Choice(["failed"]),
        help="Fly invalid flights again; timed-out flights and dead workers always are.",
    ),
    click.option(
        "--engine", type=click.Choice(["python", "compiled"]), help="Simulation engine. [default: compiled if faster]"
    ),
    click.option("--flight-timeout", type=float, metavar="S", help="End a flight that hangs for S s. [default: 60]"),
)  # fmt: skip


def flying(command: Command) -> Command:
    """The command with these options: workers, dask, overrides, retry, engine, flight_timeout."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command
