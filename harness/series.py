"""Summaries of a time series: rms, peak, settling time, overshoot. Arrays of one dimension."""

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def rms(x: Array) -> float:
    """The root mean square; NaN for an empty array."""
    return math.sqrt(np.mean(x * x)) if len(x) else math.nan


def peak(x: Array) -> float:
    """The largest absolute value; NaN for an empty array, or if one value is NaN."""
    return float(np.abs(x).max()) if len(x) else math.nan


def settling_time(time: Array, error: Array, tolerance: float, least: float) -> float | None:
    """The first time after which |error| stays below `tolerance`; None if less than `least` seconds remain then.

    `time` in s, increasing; `error` and `tolerance` in the same unit. A non-finite error is outside.
    """
    outside = np.flatnonzero(~(np.abs(error) < tolerance))
    first = outside[-1] + 1 if outside.size else 0
    if first >= len(time) or time[-1] - time[first] < least:
        return None
    return float(time[first])


def overshoot(error: Array) -> float:
    """The largest size of the sign that the error does not begin with; 0 when it never has that sign."""
    beyond = error[error * error[0] < 0.0] if len(error) else error
    return float(np.abs(beyond).max()) if beyond.size else 0.0


def unwrapped(angle: Array) -> Array:
    """Unwrapped angles, rad: bit-identical to `np.unwrap`, without its work where nothing jumps."""
    step = np.diff(angle)
    jumps = np.flatnonzero(~(np.abs(step) < math.pi))
    if not jumps.size:
        return angle + 0.0
    jumped = step[jumps]
    within = np.mod(jumped + math.pi, math.tau) - math.pi
    within[(within == -math.pi) & (jumped > 0.0)] = math.pi
    turns = np.zeros(len(angle))
    turns[jumps + 1] = within - jumped
    return np.asarray(angle + np.cumsum(turns))


def azimuth(north: Array, east: Array) -> Array:
    """The direction of a position, rad, clockwise from north, unwrapped."""
    return unwrapped(np.arctan2(east, north))
