"""The turn relation of a recorded flight, with wind and airspeed scale, which are fitted together with it.

A window of turning flight is one draw: all is fitted anew with each window left out (the jackknife), so that the
intervals know of each other.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from harness.plants.turn import GRAVITY
from harness.recorded import turn
from harness.recorded import wind as air
from harness.recorded.cannot_judge import CannotJudgeError
from harness.recorded.recorded_flight import Basis, Channel, RecordedFlight
from harness.recorded.turn import TurnWindow
from harness.recorded.wind import Estimated, Fit, GroundTrack
from harness.verdict.statistics import LEAST_SEEDS, Sample

STOPPED = 1.0  # m/s: an airspeed sensor that shows less in flight is not working
LEAST_TRACK = 20  # least number of values of the ground velocity
LEAST_IN_WINDOW = 6  # least number of them in a window of turning flight
WIND_MOVED = 2.0  # m/s: largest change of the wind from the beginning to the end of a flight
MOST_PARTS = 100  # largest number of parts of a flight in the jackknife


@dataclass(frozen=True, slots=True)
class SteadyWind:
    """The wind fitted to the track, m/s, and the airspeed scale, each with its 95 % interval."""

    north: tuple[float, float, float]  # value, low, high
    east: tuple[float, float, float]
    scale: tuple[float, float, float] | None  # true airspeed over the logged one; None if it cannot be fitted
    source: str  # "track", or "autopilot"


@dataclass(frozen=True, slots=True)
class TurnPoint:
    """A window of turning flight, rad/s: the turn rate g tan(bank)/V and the flown one."""

    begin: float  # s
    end: float
    asked: float
    flown: float


@dataclass(frozen=True, slots=True)
class Turning:
    """The turn relation, with the wind, latency and windows it was computed from."""

    sample: Sample
    barred: str  # why nothing may be decided by it
    wind: SteadyWind | None
    estimated: Estimated | None
    points: tuple[TurnPoint, ...]
    age: float


def turning_of(flight: RecordedFlight, notes: list[str]) -> tuple[Turning | CannotJudgeError, RecordedFlight]:
    """The turn relation; the flight with its bank, inverted if necessary. Findings are added to the notes."""
    try:
        found = _relation(flight, notes)
        if found.sample.mean < 0.0:
            flight = flight.changed(np.negative, *(n for n in ("bank", "bank_command") if n in flight))
            notes.append("bank: the sign is opposite in this log (left wing down is positive); inverted")
            found = _relation(flight, [])
    except CannotJudgeError as refusal:
        return refusal, flight
    return found, flight


def _relation(flight: RecordedFlight, notes: list[str]) -> Turning:
    if not flight.has("bank"):
        raise CannotJudgeError("the log has no bank")
    if not flight.has("velocity_north", "velocity_east"):
        raise CannotJudgeError("the log has no velocity over the ground")
    track = air.track_of(flight)
    if len(track.time) < LEAST_TRACK:
        raise CannotJudgeError(f"too few samples: {len(track.time)} values of the velocity over the ground")
    measured = flight.has("airspeed") and flight["airspeed"].basis is Basis.MEASURED
    known = track.airspeed[np.isfinite(track.airspeed)]
    measured = measured and len(known) >= LEAST_TRACK and float(np.median(known)) > STOPPED
    if not measured:
        track = track._replace(airspeed=np.full(len(track.time), math.nan))
    if not measured and not flight.has("wind_north", "wind_east"):
        raise CannotJudgeError("no airspeed and no wind: the direction of the air velocity is not known")
    estimate = air.estimated(flight, track)
    fixed = _fixed_wind(track, estimate, measured=measured)
    windows = turn.windows(flight["bank"])
    windows = [window for window in windows if _sampled_in(track, window)]
    steep = [window for window in windows if window.steepest > turn.STEEPEST]
    windows = [window for window in windows if window.steepest <= turn.STEEPEST]
    if len(windows) < LEAST_SEEDS:
        beyond = f", {len(steep)} more with a bank beyond {math.degrees(turn.STEEPEST):.0f} deg" if steep else ""
        raise CannotJudgeError(f"{len(windows)} independent turn windows{beyond}; {LEAST_SEEDS} are needed")
    if fixed is None:
        _has_settled(track)
    turning = _jackknifed(flight["bank"], track, windows, fixed)
    _say(notes, turning, estimate, steep)
    return replace(turning, estimated=estimate)


def _sampled_in(track: GroundTrack, window: TurnWindow) -> bool:
    first, last = np.searchsorted(track.time, (window.begin, window.end))
    return bool(last - first >= LEAST_IN_WINDOW)


def _fixed_wind(track: GroundTrack, estimate: Estimated | None, *, measured: bool) -> Fit | None:
    """The autopilot's wind if none can be fitted to the track; None if one can. Raises `CannotJudgeError`."""
    if measured and track.span >= air.LEAST_SPAN:
        return None
    span = f"the flight covers {math.degrees(track.span):.0f} deg of the compass"
    if estimate is None:
        raise CannotJudgeError(
            f"wind not known: {span}, {math.degrees(air.LEAST_SPAN):.0f} are needed, and the log has no wind"
        )
    if estimate.settled > 0.5 * (track.time[0] + track.time[-1]):
        raise CannotJudgeError(
            f"wind not settled: the autopilot's estimate moves until {estimate.settled:.0f} s, and {span}"
        )
    return Fit(estimate.north, estimate.east, 1.0)


def _has_settled(track: GroundTrack) -> None:
    """Raises `CannotJudgeError` if the wind changes from the beginning to the end of the flight."""
    moved, error = air.change(track)
    if moved > max(WIND_MOVED, 4.0 * error):
        raise CannotJudgeError(f"wind not settled: by the track it changes by {moved:.1f} m/s from beginning to end")


def _jackknifed(bank: Channel, track: GroundTrack, windows: list[TurnWindow], fixed: Fit | None) -> Turning:
    """The turn relation by the jackknife: fitted again without each window and the flight around it.

    With more than `MOST_PARTS` windows, neighbours are left out together, to bound the time of long flights.
    """
    right = sum(window.is_right for window in windows)
    bank_error = min(right, len(windows) - right) >= 2
    of = turn.integrals(bank, bank.time[0], bank.time[-1])
    whole = fixed or air.fitted(track)
    age = turn.age_of(track, of, whole, windows, bank_error=bank_error)
    edges = [-math.inf, *(0.5 * (a.end + b.begin) for a, b in pairwise(windows)), math.inf]
    n = min(len(windows), MOST_PARTS)
    part = np.arange(len(windows)) * n // len(windows)
    part_of_row = part[np.searchsorted(edges, track.time, side="right") - 1]

    def numbers(wind: Fit, at: Sequence[TurnWindow]) -> list[float]:
        slope = turn.relation(track, of, wind, at, age, bank_error=bank_error)[0].slope
        return [slope, *wind]

    value = np.array(numbers(whole, windows))
    without = [
        numbers(fixed or air.fitted(track, part_of_row != k), [windows[i] for i in np.flatnonzero(part != k)])
        for k in range(n)
    ]
    pseudo = n * value - (n - 1) * np.array(without)
    samples = [Sample(column, n, drawn=True) for column in pseudo.T]
    with_interval = [(float(v), *(s.interval() or (float(v),) * 2)) for v, s in zip(value, samples, strict=True)]
    _, north, east, scale = with_interval
    wind = SteadyWind(north, east, None if fixed else scale, "autopilot" if fixed else "track")
    barred = "" if fixed is None else "the wind is the autopilot's, whose error the interval does not include"
    points = tuple(_points(track, of, whole, windows))
    return Turning(samples[0], barred, wind, None, points, age)


def _points(track: GroundTrack, of: turn.Integrals, wind: Fit, windows: Sequence[TurnWindow]) -> Iterator[TurnPoint]:
    """Mean turn rates of each window."""
    north, east = track.north - wind.north, track.east - wind.east
    angle, speed = np.unwrap(np.arctan2(east, north)), np.hypot(north, east)
    for window in windows:
        begin, end = np.interp([window.begin, window.end], track.time, angle).tolist()
        inside = slice(*np.searchsorted(of.time, [window.begin, window.end]).tolist())
        asked = GRAVITY * of.tangent[inside] / np.interp(of.time[inside], track.time, speed)
        yield TurnPoint(window.begin, window.end, float(asked.mean()), (end - begin) / (window.end - window.begin))


def _say(notes: list[str], turning: Turning, estimate: Estimated | None, steep: Sequence[TurnWindow]) -> None:
    wind = turning.wind
    if wind and wind.scale and not wind.scale[1] <= 1.0 <= wind.scale[2]:
        v, low, high = wind.scale
        notes.append(
            f"airspeed: scale {v:.3f} [{low:.3f}, {high:.3f}] over the logged airspeed, by the track; with the logged "
            f"airspeed the turn relation would be {turning.sample.mean / v:.3f}"
        )
    if estimate and estimate.is_reversed:
        notes.append(
            "wind: the autopilot's points to where the wind comes from; inverted it fits the airspeed to "
            f"{estimate.misfit:.1f} m/s rms, otherwise to {estimate.other_misfit:.1f}"
        )
    if estimate and wind and wind.source == "track":
        apart = math.hypot(estimate.north - wind.north[0], estimate.east - wind.east[0])
        notes.append(
            f"wind: the autopilot's estimate, settled from {estimate.settled:.0f} s on, differs by {apart:.1f} m/s "
            "from the track's"
        )
    if steep:
        beyond = math.degrees(turn.STEEPEST)
        notes.append(f"turn: {len(steep)} windows with a bank beyond {beyond:.0f} deg are left out")


def estimated_of(flight: RecordedFlight) -> Estimated | None:
    """The autopilot's estimate of the wind, where the log has one beside a track."""
    if not flight.has("velocity_north", "velocity_east"):
        return None
    return air.estimated(flight, air.track_of(flight))
