"""What several commands say alike: bad input, feasibility, numbers."""

from __future__ import annotations

import math
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


def read_flight_file(path: Path, overrides: tuple[str, ...]) -> tuple[SettingsFile, Flight]:
    """The file as read, and the flight that it describes."""
    from harness.settings import SettingsError, read_settings

    try:
        file = read_settings(path, overrides)
        return file, file.flight()
    except SettingsError as error:
        raise BadInput(str(error)) from None


def feasibility_line(flight: Flight) -> str:
    """Whether the circle can be held, and by what margin."""
    from harness.flight import feasibility_margin, needed_heading_rate

    margin, needed = (math.degrees(rate) for rate in (feasibility_margin(flight), needed_heading_rate(flight)))
    verdict = "feasible" if margin >= 0 else "INFEASIBLE"
    return (
        f"circle {verdict}: holding it takes up to {needed:.2f} deg/s, "
        f"the limit is {math.degrees(flight.law.max_heading_rate):g} deg/s (margin {margin:+.2f})"
    )


def number(value: float | None) -> str:
    """Three significant digits, or a dash for none."""
    if value is None:
        return "-"
    return f"{value:.3g}" if abs(value) >= 0.0005 else "0"


def writable(path: Path) -> Path:
    """The path, if a file can be made there."""
    folder = path.parent
    if path.is_dir():
        raise BadInput(f"{path}: is a folder, not a file")
    if not folder.is_dir():
        raise BadInput(f"{path}: there is no folder {folder}")
    try:
        probe = folder / f".{path.name}.probe"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise BadInput(f"{path}: cannot be written: {error.strerror}") from None
    return path
