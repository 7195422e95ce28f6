"""What is measured on a flight of the paper's."""

import math

import numpy as np
from numpy.typing import NDArray

from harness import series
from harness.studies.paper.experiments import Trace

Array = NDArray[np.float64]

CONVERGED = 1e-4  # m, Table 3
ON_THE_CIRCLE = 1.0  # m: the "desired distance error range", on any aircraft
SETTLED_FOR = 1.0  # s that must be left: less tells nothing of "for good"


def settled(log: Trace, tolerance: float = CONVERGED, until: float = math.inf) -> float | None:
    """The first tenth of a second after which |r| stays below the tolerance; None when it does not for a second."""
    time = log["time"][log["time"] < until]
    at = series.settling_time(time, log["range_error"][: len(time)], tolerance, SETTLED_FOR)
    return None if at is None else math.ceil(10.0 * at - 1e-6) / 10.0


def settled_before_the_manoeuvres(log: Trace) -> float | None:
    """The same before 300 s."""
    return settled(log, until=300.0)


def settled_to_1_m_before_the_manoeuvres(log: Trace) -> float | None:
    """The same for 1 m, the "desired distance error range" of a law that never comes to 1e-4 m."""
    return settled(log, 1.0, until=300.0)


def restricted(log: Trace) -> tuple[float, float] | None:
    """From when to when the command first is at its limit, s."""
    beyond = np.abs(log["unlimited_command"]) > log.flight.law.max_heading_rate
    if not beyond.any():
        return None
    first = int(np.argmax(beyond))
    free = np.flatnonzero(~beyond[first:])
    return float(log["time"][first]), float(log["time"][first + free[0]] if free.size else log["time"][-1])


def final_error(log: Trace) -> float | None:
    """R at the end, m."""
    return float(log["range_error"][-1])


def error_after_320_s(log: Trace) -> float | None:
    """The size of r at 320 s, m."""
    return float(abs(log["range_error"][np.searchsorted(log["time"], 320.0)]))


def peak(log: Trace, begin: float, end: float = math.inf) -> float:
    """The largest |r| from `begin` to `end`, m."""
    during = (log["time"] >= begin) & (log["time"] <= end)
    return float(np.abs(log["range_error"][during]).max())


def peak_while_accelerating(log: Trace) -> float | None:
    """The largest |r| from 300 s to 350 s, m."""
    return peak(log, 300.0, 350.0)


def peak_in_all_manoeuvres(log: Trace) -> float | None:
    """The largest |r| from 300 s on, m."""
    return peak(log, 300.0)


def delay(log: Trace, other: Trace) -> float | None:
    """How much later than the other's the heading jumps from -180 to 180 deg, between 350 s and 400 s, s."""
    jumps = []
    for each in (log, other):
        time, heading = each["time"], each["heading"]
        at = time[1:][(np.abs(np.diff(heading)) > math.pi) & (time[1:] >= 350.0) & (time[1:] < 400.0)]
        if not at.size:
            return None
        jumps.append(float(at[0]))
    return jumps[0] - jumps[1]


def azimuth(log: Trace) -> Array:
    """The azimuth of the aircraft seen from the target, unwrapped, rad."""
    return series.azimuth(log["north"] - log["target_north"], log["east"] - log["target_east"])


def turns(log: Trace, begin: float) -> float:
    """How often the aircraft has gone round the target since `begin`."""
    angle = azimuth(log)[log["time"] >= begin]
    return float(abs(angle[-1] - angle[0])) / math.tau


def rms(log: Trace, begin: float = 0.0) -> float:
    """Of r from `begin` on, m; NaN of nothing."""
    return series.rms(log["range_error"][log["time"] >= begin])


def overshoot(log: Trace, until: float = math.inf) -> float:
    """The largest r of the opposite sign after the first crossing, m."""
    return series.overshoot(log["range_error"][log["time"] <= until])
