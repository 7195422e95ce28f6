"""The steady wind and the scale of the airspeed, fitted to a recorded track.

At every time |ground velocity - wind| = scale * airspeed: three unknowns, observable by flying in many directions. The
autopilot's estimate is compared with it, with both signs.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from harness.recorded.recorded_flight import RecordedFlight

Array = NDArray[np.float64]

LEAST_SPAN = math.radians(180.0)  # least span of directions flown, for wind and scale to be observable
SETTLED_WITHIN = 1.0  # m/s: an estimate has settled once it stays this close to its end
TURNED_ROUND = 0.8  # the wind is inverted if that leaves less than this share of the misfit
_STEPS = 30
_PIECES = 8


class Fit(NamedTuple):
    """Wind, m/s north and east, and true airspeed over the airspeed as logged."""

    north: float
    east: float
    scale: float


class GroundTrack(NamedTuple):
    """Ground velocity, m/s, at its own times, with the logged airspeed there; NaN where it is not known."""

    time: Array
    north: Array
    east: Array
    airspeed: Array

    @property
    def span(self) -> float:
        """Span of the courses, rad: a whole turn minus the widest gap."""
        courses = np.sort(np.arctan2(self.east, self.north))
        gaps = np.diff(np.append(courses, courses[0] + math.tau))
        return float(math.tau - gaps.max())


@dataclass(frozen=True, slots=True)
class Estimated:
    """The autopilot's estimate of the wind: its mean after it settled, m/s."""

    north: float
    east: float
    settled: float  # s: from then on it stays within `SETTLED_WITHIN` of its end
    is_reversed: bool  # the log gives where the wind comes from; here it is already inverted
    misfit: float  # m/s rms: |ground velocity - wind| minus the airspeed, with the better sign
    other_misfit: float  # with the other sign; NaN without an airspeed


def track_of(flight: RecordedFlight) -> GroundTrack:
    """The flight's track; rows without a ground velocity are left out."""
    north, east = flight["velocity_north"], flight["velocity_east"]
    time = north.time if len(north) >= len(east) else east.time
    airspeed = flight["airspeed"].at(time) if flight.has("airspeed") else np.full(len(time), math.nan)
    track = GroundTrack(time, north.at(time), east.at(time), airspeed)
    known = np.isfinite(track.north) & np.isfinite(track.east)
    return GroundTrack(*(column[known] for column in track))


def fitted(track: GroundTrack, used: NDArray[np.bool_] | None = None) -> Fit:
    """The wind and the scale that fit the track best."""
    north, east, scale, *_ = _fitted(track, used, changing=False).tolist()
    return Fit(north, east, scale)


def change(track: GroundTrack) -> tuple[float, float]:
    """Change of a linearly changing wind from beginning to end, m/s, and its standard error."""
    piece = _PIECES * (track.time - track.time[0]) / (track.time[-1] - track.time[0])
    whole = _fitted(track, None, changing=True)[3:]
    left = np.array([_fitted(track, piece.astype(int) != k, changing=True)[3:] for k in range(_PIECES)])
    error = math.sqrt((_PIECES - 1) / _PIECES * float(np.sum((left - left.mean(axis=0)) ** 2)))
    return math.hypot(*whole), error


def _fitted(track: GroundTrack, used: NDArray[np.bool_] | None, *, changing: bool) -> Array:
    """Wind north and east in the middle, scale, and the change of the wind from beginning to end; by Gauss-Newton."""
    known = np.isfinite(track.airspeed) if used is None else used & np.isfinite(track.airspeed)
    if known.sum() < 5:  # a piece left out held nearly all that is known: the interval is to be wide
        return np.array([0.0, 0.0, 1.0, 0.0, 0.0])
    v, airspeed = np.stack([track.north[known], track.east[known]]), track.airspeed[known]
    since = (track.time[known] - track.time.mean()) / (track.time[-1] - track.time[0])
    x = np.array([0.0, 0.0, float(np.hypot(*v).mean() / airspeed.mean()), 0.0, 0.0])
    free = slice(0, 5 if changing else 3)
    for _ in range(_STEPS):
        off = v - x[:2, np.newaxis] - x[3:, np.newaxis] * since
        size = np.maximum(np.hypot(*off), 1e-6)
        towards = off / size
        jacobian = np.column_stack([*towards, airspeed, *(towards * since)])[:, free]
        step = np.linalg.lstsq(jacobian, size - x[2] * airspeed, rcond=None)[0]
        x[free] += step
        if np.abs(step).max() < 1e-9:
            break
    return x


def misfit(track: GroundTrack, north: float, east: float) -> float:
    """The rms of |ground velocity - wind| minus the airspeed at the best scale, m/s."""
    known = np.isfinite(track.airspeed)
    size = np.hypot(track.north[known] - north, track.east[known] - east)
    airspeed = track.airspeed[known]
    scale = float(size @ airspeed / max(float(airspeed @ airspeed), 1e-9))
    return float(np.sqrt(np.mean((size - scale * airspeed) ** 2)))


def estimated(flight: RecordedFlight, track: GroundTrack) -> Estimated | None:
    """The autopilot's wind; None where the log has none."""
    if not flight.has("wind_north", "wind_east"):
        return None
    time = flight["wind_north"].time
    wind = np.column_stack([flight["wind_north"].values, flight["wind_east"].at(time)])
    known = np.isfinite(wind).all(axis=1)
    time, wind = time[known], wind[known]
    if not len(wind):
        return None
    end = np.median(wind[-max(1, len(wind) // 4) :], axis=0)
    away = np.flatnonzero(np.hypot(*(wind - end).T) > SETTLED_WITHIN)
    first = int(away[-1]) + 1 if len(away) else 0
    first = min(first, len(wind) - 1)
    north, east = wind[first:].mean(axis=0).tolist()
    if not np.isfinite(track.airspeed).any():
        return Estimated(north, east, float(time[first]), is_reversed=False, misfit=math.nan, other_misfit=math.nan)
    as_given, turned = misfit(track, north, east), misfit(track, -north, -east)
    if turned < TURNED_ROUND * as_given:
        return Estimated(-north, -east, float(time[first]), is_reversed=True, misfit=turned, other_misfit=as_given)
    return Estimated(north, east, float(time[first]), is_reversed=False, misfit=as_given, other_misfit=turned)
