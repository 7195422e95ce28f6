"""A recorded track of the target: a CSV file of times and positions, interpolated smoothly.

The interpolant is a cubic spline (not-a-knot): velocity, acceleration and turn rate are continuous, and a track that is
a cubic in time is reproduced exactly. A monotone interpolant (PCHIP) would not oscillate where a target starts or
stops, but its acceleration jumps at every row, and the law would take these jumps for the target's.
"""

import math
from bisect import bisect_right
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from harness.error import HarnessError
from harness.files import read

HEADER = ("time_s", "north_m", "east_m")
FEWEST = 4  # least number of rows: a cubic is determined
LARGEST = 1e9  # s or m: largest number in a track
SOONEST = 1e-6  # s: least time between rows, for finite coefficients of the cubic

_SLOWEST = 1e-6  # m/s: a slower target has no direction
_Row = tuple[float, float, float]
TargetMotion = tuple[float, float, float, float, float, float]  # the fields of `TargetState`, in their order


class TrackError(HarnessError, ValueError):
    """A mistake in a track's file, in one line: `FILE:LINE: what is wrong`."""


class Cubic(NamedTuple):
    """The track from the row at `begin`, s, to the next: coefficients in (time - begin), highest power first. SI."""

    begin: float
    north: list[float]
    east: list[float]

    def at(self, time: float) -> TargetMotion:
        """The target's motion at `time`, s. SI, rad, turning clockwise."""
        t = time - self.begin
        (x3, x2, x1, x0), (y3, y2, y1, y0) = self.north, self.east
        v_x, v_y = (3.0 * x3 * t + 2.0 * x2) * t + x1, (3.0 * y3 * t + 2.0 * y2) * t + y1
        a_x, a_y = 6.0 * x3 * t + 2.0 * x2, 6.0 * y3 * t + 2.0 * y2
        v = math.hypot(v_x, v_y)
        along, turn = 0.0, 0.0
        if v > _SLOWEST:
            along, turn = (v_x * a_x + v_y * a_y) / v, (v_x * a_y - v_y * a_x) / (v * v)
        return ((x3 * t + x2) * t + x1) * t + x0, ((y3 * t + y2) * t + y1) * t + y0, v_x, v_y, along, turn


class Track:
    """The track as a function of time. It ends at `end`, s."""

    def __init__(self, cubics: list[Cubic], end: float) -> None:
        self.begins, self.end = [cubic.begin for cubic in cubics], end
        self._cubics = cubics

    def at(self, time: float) -> TargetMotion:
        """The target's motion at `time`, s; beyond the last row it continues with the last cubic."""
        return self._cubics[max(0, bisect_right(self.begins, time) - 1)].at(time)


def load_track(path: Path) -> Track:
    """The track in a file. Raises `TrackError`."""
    try:
        return _parsed(path, read(path))
    except TrackError:
        raise
    except OSError as error:
        raise TrackError(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise TrackError(f"{path}: not text in UTF-8") from None
    except ValueError as error:  # not a path, e.g. with a null character
        raise TrackError(f"{str(path)!r}: {error}") from None


@lru_cache(maxsize=16)
def _parsed(path: Path, content: bytes) -> Track:
    """The track that the content of a file describes; `path` is for messages."""
    from scipy.interpolate import CubicSpline  # imported when used: it takes a tenth of a second to import

    times, norths, easts = zip(*_rows(path, content.decode("utf-8-sig")), strict=True)
    north, east = (CubicSpline(times, values).c.T.tolist() for values in (norths, easts))
    return Track([Cubic(*cubic) for cubic in zip(times[:-1], north, east, strict=True)], times[-1])


def _rows(path: Path, text: str) -> list[_Row]:
    lines = text.rstrip().splitlines() or [""]
    header = tuple(cell.strip() for cell in lines[0].split(","))
    if header != HEADER:
        raise TrackError(f"{path}:1: the header is {lines[0].strip()[:60]!r}, must be {','.join(HEADER)!r}")
    rows: list[_Row] = []
    for number, line in enumerate(lines[1:], 2):
        try:
            row = _row(line)
            if rows and row[0] <= rows[-1][0]:
                how = "is given twice" if row[0] == rows[-1][0] else f"comes after {rows[-1][0]:g}"
                raise ValueError(f"time_s {row[0]:g} {how}, must increase from row to row")
            if rows and row[0] - rows[-1][0] < SOONEST:
                raise ValueError(
                    f"time_s comes {row[0] - rows[-1][0]:g} s after the row before, must be at least {SOONEST:g} s"
                )
            if not rows and row[0] > 0.0:
                raise ValueError(f"the track begins at {row[0]:g} s, must begin at 0 or before, as the flight does")
        except ValueError as error:
            raise TrackError(f"{path}:{number}: {error}") from None
        rows.append(row)
    if len(rows) < FEWEST:
        raise TrackError(f"{path}:{len(lines)}: {len(rows)} rows under the header, must be at least {FEWEST}")
    return rows


def _row(line: str) -> _Row:
    cells = [cell.strip() for cell in line.split(",")]
    if len(cells) != len(HEADER):
        raise ValueError(f"{len(cells) if line.strip() else 'no'} numbers, must be {len(HEADER)}: {', '.join(HEADER)}")
    time, north, east = (_number(name, cell) for name, cell in zip(HEADER, cells, strict=True))
    return time, north, east


def _number(name: str, cell: str) -> float:
    try:
        number = float(cell)
    except ValueError:
        number = math.nan
    if not abs(number) <= LARGEST:
        allowed = "must be a finite number" + (f", of {LARGEST:g} at most in size" if math.isfinite(number) else "")
        raise ValueError(f"{name} is {cell[:60]!r}, {allowed}" if cell else f"{name} is missing")
    return number
