"""Validation of a JSBSim model: the recorded surface commands of a flight are replayed on it."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from harness.plants.replay import REPLAYED, SURFACES, Moment, replay
from harness.recorded.recorded_flight import Array, LogError, RecordedFlight

JUDGED = ("roll_rate", "pitch_rate", "yaw_rate", "bank", "pitch", "yaw")
RATES = JUDGED[:3]
HORIZONS = (1.0, 2.0, 3.0)  # s: lengths of the replays
APART = 0.25  # s between two starts
_FIT_APART = 0.5  # s between two starts of the fit of offsets
STEP = 0.005  # s: simulation step
ALTITUDE = 100.0  # m: assumed, since a log gives only its own origin; density changes by 1 % in 100 m
SLOWEST = 10.0  # 1/s: least update rate of the surfaces; slower logs miss changes
LONGEST_DELAY = 0.15  # s: largest delay that is fitted
LARGEST_OFFSET = math.radians(12.0)
_NEEDED = (
    "aileron", "elevator", "throttle", "bank", "pitch", "yaw", "roll_rate", "pitch_rate", "yaw_rate", "velocity_north",
    "velocity_east", "velocity_down",
)  # fmt: skip


class Adjusted(NamedTuple):
    """Adjustments of the recorded commands: offsets of the surfaces, rad, and a delay, s."""

    aileron: float = 0.0
    elevator: float = 0.0
    delay: float = 0.0


class Replay(NamedTuple):
    """One replay, from `time[0]` on: the recorded and the simulated values of `REPLAYED`, (times, quantities)."""

    flight: str
    time: Array
    recorded: Array
    simulated: Array


class ReplayFit(NamedTuple):
    """How much of the variance of each of `JUDGED` the model explains from all starts, %, at each of `HORIZONS`."""

    adjusted: Adjusted
    explained: Mapping[str, tuple[float, ...]]
    starts: tuple[int, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Validation:
    """A model beside the flights of an aircraft."""

    airframe: Path
    flights: tuple[RecordedFlight, ...]
    as_recorded: ReplayFit
    adjusted: ReplayFit  # with the offsets and the delay that fit best
    curves: tuple[Replay, ...]  # adjusted, over the longest horizon, one after the other
    notes: tuple[str, ...]


def validated(airframe: Path, flights: Sequence[RecordedFlight]) -> Validation:
    """The model of this airframe beside the flights. Raises `LogError` for a flight that cannot be replayed."""
    notes = tuple(note for flight in flights for note in _checked(airframe, flight))
    found = _fitted(airframe, flights)
    longest = max(h for h in HORIZONS if any(list(_starts(flight, h, h)) for flight in flights))
    curves = [one for flight in flights for one in _replays(airframe, flight, longest, longest, found)]
    return Validation(
        airframe,
        tuple(flights),
        _fit(airframe, flights, Adjusted()),
        _fit(airframe, flights, found),
        tuple(curves),
        notes,
    )


def _checked(airframe: Path, flight: RecordedFlight) -> Iterator[str]:
    """The notes on a replay of this flight. Raises `LogError`."""
    import aircraft

    if flight.refusals:
        raise LogError(flight.refusals[0])
    rudder = bool(aircraft.data(airframe)["meta"].get("has_rudder", True))
    missing = [name for name in (*_NEEDED, *(["rudder"] if rudder else [])) if not flight.has(name)]
    if missing:
        raise LogError(f"{flight.name}: cannot be replayed: has no {', '.join(missing)}")
    slow = [name for name in ("aileron", "elevator", *RATES) if flight[name].rate < SLOWEST]
    if slow:
        raise LogError(
            f"{flight.name}: cannot be replayed: {slow[0]} changes {flight[slow[0]].rate:.3g} times a second, "
            f"at least {SLOWEST:g} are needed"
        )
    if not list(_starts(flight, HORIZONS[0], APART)):
        raise LogError(f"{flight.name}: cannot be replayed: no second of it has all that is needed")
    if not flight.has("wind_north", "wind_east"):
        yield f"{flight.name}: without a wind: the air is taken to be still"
    elif not flight.has("wind_down"):
        yield f"{flight.name}: without a vertical wind: taken to be none"


def _starts(flight: RecordedFlight, horizon: float, apart: float) -> Iterator[float]:
    """The times from which this much of the flight can be replayed, s."""
    begin = max(float(flight[name].time[0]) for name in _NEEDED)
    end = min(float(flight[name].time[-1]) for name in (*_NEEDED[:2], *_NEEDED[3:]))
    for start in np.arange(begin, end - horizon + 1e-9, apart):
        time = np.arange(start, start + horizon, 0.05)
        if np.isfinite(flight.table(_NEEDED[3:], time)).all():
            yield float(start)


def _replays(
    airframe: Path, flight: RecordedFlight, horizon: float, apart: float, adjusted: Adjusted
) -> Iterator[Replay]:
    for start in _starts(flight, horizon, apart):
        time: Array = start + STEP * np.arange(round(horizon / STEP) + 1.0)
        names = Moment._fields[1:]
        at_start = flight.table(names, time[:1])[0]
        commands = _commands(flight, time, adjusted)
        simulated = replay(airframe, STEP, Moment(ALTITUDE, *at_start.tolist()), commands)
        simulated[:, 2] = np.unwrap(simulated[:, 2])
        recorded = np.column_stack(
            [flight[name].at(time) if name in flight else np.full(len(time), np.nan) for name in REPLAYED]
        )
        simulated[:, 2] += 2.0 * np.pi * np.round((recorded[0, 2] - simulated[0, 2]) / (2.0 * np.pi))
        yield Replay(flight.name, time, recorded, simulated)


def _commands(flight: RecordedFlight, time: Array, adjusted: Adjusted) -> Array:
    """The rows of `replay`; a command stays what it was before the log's first and after its last row."""
    columns = []
    for name in (*SURFACES, "wind_north", "wind_east", "wind_down"):
        if name not in flight:
            columns.append(np.zeros(len(time)))
            continue
        channel = flight[name]
        late = adjusted.delay if name in SURFACES else 0.0
        offset = {"aileron": adjusted.aileron, "elevator": adjusted.elevator}.get(name, 0.0)
        columns.append(np.interp(time - late, channel.time, channel.values) + offset)
    return np.column_stack(columns)


def _fitted(airframe: Path, flights: Sequence[RecordedFlight]) -> Adjusted:
    """The offsets and the delay with which the rates over `HORIZONS[0]` fit best."""
    from scipy.optimize import least_squares

    def residuals(x: Array) -> Array:
        replays = [
            one
            for flight in flights
            for one in _replays(airframe, flight, HORIZONS[0], _FIT_APART, Adjusted(*x.tolist()))
        ]
        columns = [REPLAYED.index(name) for name in RATES]
        return np.concatenate([_errors(one)[::5, columns].ravel() for one in replays])

    most = [LARGEST_OFFSET, LARGEST_OFFSET, LONGEST_DELAY]
    found = least_squares(
        residuals, [0.0, 0.0, 0.04], diff_step=[0.01, 0.01, 0.2], x_scale=[0.02] * 3, max_nfev=10,
        bounds=([-LARGEST_OFFSET, -LARGEST_OFFSET, 0.0], most),
    )  # fmt: skip
    return Adjusted(*found.x.tolist())


def _errors(replay: Replay) -> Array:
    """Simulated minus recorded; what is not finite is as wrong as a turn in the wrong direction."""
    errors = replay.simulated - replay.recorded
    return np.where(np.isfinite(replay.simulated), errors, np.pi)


def explained(
    airframe: Path, flights: Sequence[RecordedFlight], adjusted: Adjusted, horizon: float
) -> dict[str, float]:
    """How much of the variance of each of `JUDGED` the model explains over this horizon, %; NaN without any start."""
    return _explained([r for flight in flights for r in _replays(airframe, flight, horizon, APART, adjusted)])


def _explained(replays: Sequence[Replay]) -> dict[str, float]:
    shares = {}
    for name in JUDGED:
        k = REPLAYED.index(name)
        wrong = sum(float(np.sum(_errors(replay)[:, k] ** 2)) for replay in replays)
        varied = sum(float(np.sum((r.recorded[:, k] - r.recorded[:, k].mean()) ** 2)) for r in replays)
        shares[name] = 100.0 * (1.0 - wrong / varied) if varied else math.nan
    return shares


def _fit(airframe: Path, flights: Sequence[RecordedFlight], adjusted: Adjusted) -> ReplayFit:
    replays = {
        horizon: [r for flight in flights for r in _replays(airframe, flight, horizon, APART, adjusted)]
        for horizon in HORIZONS
    }
    shares = [_explained(replays[horizon]) for horizon in HORIZONS]
    by_name = {name: tuple(share[name] for share in shares) for name in JUDGED}
    return ReplayFit(adjusted, by_name, tuple(len(replays[horizon]) for horizon in HORIZONS))
