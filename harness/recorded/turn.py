"""The turn relation of a recorded flight: turn rate of the air velocity over g tan(bank) / V.

In each window of turning flight the direction of (ground velocity - wind) is regressed on the integral of
g tan(bank) / V: the slope is the relation, 1 in a coordinated turn. In a steady turn the slope is independent of the
latency of the two messages; where the bank changes, the latency between them is fitted.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from harness.plants.turn import GRAVITY
from harness.recorded.recorded_flight import Channel
from harness.recorded.wind import Fit, GroundTrack

Array = NDArray[np.float64]

STEEPEST = math.radians(60.0)  # largest bank at which the turn relation is judged
LEAST_BANK = math.radians(2.5)  # least bank of a turn
LEAST_TURN = math.radians(15.0)  # least change of direction in a window
WINDOW = 8.0  # s: length of the windows of a long turn
LEAST_TIME = 3.0  # s: shortest window
_GRID = 0.05  # s: time step of the integrals
_AGES = np.arange(-0.5, 1.01, 0.05)  # s: candidates for the latency of the track minus that of the bank
_SMOOTHED = 1.0  # s: length of the moving average of the bank


class TurnWindow(NamedTuple):
    """A piece of turning flight, s."""

    begin: float
    end: float
    is_right: bool
    steepest: float  # rad


class TurnRelation(NamedTuple):
    """Slope of the turn relation, and the bias of the bank, rad; 0 if only one direction was flown."""

    slope: float
    bank_error: float


class Integrals(NamedTuple):
    """The time, s, and the tangent of the bank on a fine grid."""

    time: Array
    tangent: Array


def windows(bank: Channel) -> list[TurnWindow]:
    """The pieces of turning flight: one direction each, `LEAST_TURN` at an airspeed of 15 m/s or more."""
    time = np.arange(bank.time[0], bank.time[-1], _GRID)
    values = bank.at(time)
    width = max(1, round(_SMOOTHED / _GRID))
    if len(time) < width:
        return []
    smooth = np.convolve(np.nan_to_num(values), np.ones(width) / width, mode="same")
    sign = np.where(np.abs(smooth) >= LEAST_BANK, np.sign(smooth), 0.0)
    sign[np.isnan(values)] = 0.0
    begins = np.flatnonzero(np.diff(sign, prepend=0.0) != 0.0)
    ends = np.append(begins, len(sign))[1:]
    found = []
    for begin, end in zip(begins, ends, strict=True):
        if sign[begin] == 0.0:
            continue
        turned = GRAVITY / 15.0 * np.abs(np.tan(np.clip(values[begin:end], -1.2, 1.2))).sum() * _GRID
        length = (end - begin) * _GRID
        count = max(1, min(int(length / WINDOW), int(turned / LEAST_TURN)))
        if length < LEAST_TIME or turned < LEAST_TURN:
            continue
        edges = np.linspace(begin, end, count + 1).astype(int)
        found += [
            TurnWindow(float(time[a]), float(time[b - 1]), bool(sign[begin] > 0.0), float(np.abs(values[a:b]).max()))
            for a, b in pairwise(edges)
        ]
    return found


def integrals(bank: Channel, begin: float, end: float) -> Integrals:
    """tan(bank) on a fine grid."""
    time = np.arange(begin, end, _GRID)
    return Integrals(time, np.tan(np.clip(np.nan_to_num(bank.at(time)), -1.2, 1.2)))


class _Rows(NamedTuple):
    """For each window, its rows about their means: the direction, and the integrals of g tan(bank)/V and of g/V."""

    angle: Array
    turn: Array
    drift: Array
    window: NDArray[np.intp]


def _rows(track: GroundTrack, of: Integrals, wind: Fit, at: Sequence[TurnWindow], age: float) -> _Rows:
    north, east = track.north - wind.north, track.east - wind.east
    angle = np.unwrap(np.arctan2(east, north))
    per_speed = GRAVITY / np.interp(of.time, track.time - age, np.hypot(north, east))
    turn = np.cumsum(of.tangent * per_speed) * _GRID
    drift = np.cumsum(per_speed) * _GRID
    time = track.time - age
    parts: list[tuple[Array, Array, Array, NDArray[np.intp]]] = []
    for i, window in enumerate(at):
        first, last = np.searchsorted(time, (window.begin, window.end))
        here = slice(int(first), int(last))
        if last - first < 3:
            continue
        columns = [angle[here], np.interp(time[here], of.time, turn), np.interp(time[here], of.time, drift)]
        centred = [column - column.mean() for column in columns]
        parts.append((centred[0], centred[1], centred[2], np.full(last - first, i)))
    if not parts:
        return _Rows(np.empty(0), np.empty(0), np.empty(0), np.empty(0, np.intp))
    return _Rows(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def relation(
    track: GroundTrack, of: Integrals, wind: Fit, at: Sequence[TurnWindow], age: float, *, bank_error: bool
) -> tuple[TurnRelation, float]:
    """The relation over these windows, and the sum of its squared residuals, rad^2."""
    rows = _rows(track, of, wind, at, age)
    columns = np.column_stack([rows.turn, rows.drift] if bank_error else [rows.turn])
    found, *_ = np.linalg.lstsq(columns, rows.angle, rcond=None)
    off = rows.angle - columns @ found
    slope = float(found[0])
    return TurnRelation(slope, float(found[1]) / slope if bank_error and slope else 0.0), float(off @ off)


def age_of(track: GroundTrack, of: Integrals, wind: Fit, at: Sequence[TurnWindow], *, bank_error: bool) -> float:
    """Latency of the track minus that of the bank, s, by least squares."""
    left = [relation(track, of, wind, at, float(age), bank_error=bank_error)[1] for age in _AGES]
    return float(_AGES[int(np.argmin(left))])
