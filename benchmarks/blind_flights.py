"""Flights of the 6-DOF aircraft, logged as an autopilot would: what is hidden in the logs is drawn at random."""

import math
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import aircraft
import harness
from benchmarks.blind_files import FORMATS, Stream
from harness.flight import Flight
from harness.log import FlightLog
from harness.loop import simulate
from harness.plants.plant import Start
from harness.recorded import response_fit, turn
from harness.recorded.assessment import LATERAL, assess
from harness.recorded.following import BANK, HEADING_RATE, Commanded
from harness.recorded.recorded_flight import Basis, Channel, RecordedFlight
from harness.recorded.wind import Fit, track_of
from harness.verdict.parts import PARTS
from harness.world.target import Segment, Target
from harness.world.wind import Wind

Array = NDArray[np.float64]

OTHERS = (
    PARTS["altitude_deviation_peak_m"],
    PARTS["airspeed_deviation"],
    LATERAL,
    BANK.gain,
    HEADING_RATE.gain,
)  # parts without a hidden number
KINDS = ("circles", "manoeuvres", "straight")
SHARES = (0.4, 0.4, 0.2)
FOLLOWED = (BANK, HEADING_RATE)


@dataclass(frozen=True, slots=True)
class Hidden:
    """What `assess` is not told."""

    kind: str
    format: str  # of the file
    scale: float  # true airspeed over the logged one
    wind_reversed: bool  # the autopilot's wind points to where it comes from
    bank_reversed: bool
    of_receipt: bool  # the times are of receipt, with the age of the telemetry
    turbulent: bool
    turn_ratio: float  # of the same windows of the true flight; NaN without turns
    wind: tuple[float, float]  # mean over the flight, m/s north, east
    lags: Mapping[str, float]  # behind the command, s, by noun; NaN where the command does not move
    words: Mapping[str, str]  # of the other parts, by title, as the true flight has them


@dataclass(frozen=True, slots=True)
class BlindLog:
    """A flight as an autopilot would log it."""

    flight: Flight
    streams: Mapping[str, Stream]
    hidden: Hidden

    def recorded(self) -> RecordedFlight:
        """The log, written to a file and read back."""
        with tempfile.TemporaryDirectory() as folder:
            return FORMATS[self.hidden.format](Path(folder), self.streams, self.hidden.of_receipt)


def flight_of(of: np.random.Generator, kind: str) -> Flight:
    """A flight of this kind: on a circle, behind a target that turns left and right, or straight ahead."""
    name = str(of.choice(aircraft.names()))
    airspeed = aircraft.limits(aircraft.folder(name)).design_airspeed
    standoff, heading = of.uniform(4.5, 16.0) * airspeed, of.uniform(-math.pi, math.pi)
    duration = float(round(of.uniform(100.0, 240.0)))
    target, position = Target(), (-standoff, 0.3 * standoff)
    if kind == "manoeuvres":
        segments, time = [], 10.0
        while time < duration - 10.0:
            end = time + of.uniform(8.0, 20.0)
            rate = of.choice([-1.0, 1.0]) * math.radians(of.uniform(3.0, 12.0))
            segments.append(Segment(from_=time, to=end, turn_rate=float(rate)))
            time = end + of.uniform(3.0, 10.0)
        target = Target(speed=of.uniform(0.3, 0.5) * airspeed, heading=heading, segments=tuple(segments))
        standoff = of.uniform(2.5, 5.0) * airspeed
    elif kind == "straight":
        duration = min(duration, 150.0)
        way = 2.0 * airspeed * duration
        target = Target(position=(way * math.cos(heading), way * math.sin(heading)))
        position = (0.0, 0.0)
    gains: dict[str, Any] = {} if of.random() < 0.7 else {"k2": 0.6, "k3": 0.6}
    law = harness.law(
        "nftsm", str(of.choice(["paper_1", "fitted"])), standoff=standoff,
        max_heading_rate=math.radians(of.uniform(8.0, 20.0)), direction=str(of.choice(["paper", "mirrored"])), **gains,
    )  # fmt: skip
    speed, towards = of.uniform(0.0, 0.35) * airspeed, of.uniform(-math.pi, math.pi)
    return Flight(
        plant="sixdof", law=law, aircraft=name, duration=duration, seed=int(of.integers(10**9)), target=target,
        start=Start(position=position, heading=heading, airspeed=airspeed, altitude=100.0),
        wind=Wind(
            steady=(speed * math.cos(towards), speed * math.sin(towards)),
            turbulence=str(of.choice(["none", "none", "light"])),
        ),
    )  # fmt: skip


def blind_log(seed: int) -> BlindLog:
    """The log of this seed, with what is hidden in it."""
    of = np.random.default_rng([seed, 19])
    kind = str(of.choice(KINDS, p=SHARES))
    while True:
        log = simulate(flight_of(of, kind))
        if not log.outcome.failed and log["time"][-1] >= 60.0:
            return logged(log, kind, of)


def logged(log: FlightLog, kind: str, of: np.random.Generator) -> BlindLog:
    """The flight as messages of an autopilot on board, or of its telemetry."""
    of_receipt = bool(of.random() < 0.5)
    written = "CSV" if of_receipt else str(of.choice(list(FORMATS)))  # autopilots log on board in their own formats
    link = of.uniform(0.0, 0.8) if of_receipt else 0.0
    attitude = of.uniform(4.0, 20.0) if of_receipt else of.uniform(10.0, 20.0)
    scale, bank_reversed, wind_reversed = of.uniform(0.88, 1.12), bool(of.random() < 0.2), bool(of.random() < 0.4)
    late = link + (of.uniform(0.0, 0.2) if of_receipt else 0.0)
    sign = -1.0 if bank_reversed else 1.0
    held = np.append(log["bank_command"][1:], log["bank_command"][-1])  # of the period that begins
    repeated = of_receipt and of.random() < 0.6

    def stream(rate: float, age: float, basis: Basis, noise: float, **columns: Array) -> Stream:
        time = np.arange(of.uniform(0.0, 1.0 / rate), log["time"][-1], 1.0 / rate)
        time += of.uniform(0.0, 0.1 / rate, len(time))
        values = {name: _at(log["time"], column, time, basis) for name, column in columns.items()}
        if basis is Basis.COMMANDED:
            return Stream(time + age, basis, values)
        values = {name: column + of.normal(0.0, noise, len(time)) for name, column in values.items()}
        time = time + age
        if repeated:
            rows = np.arange(time[0], time[-1], 1.0 / (of.uniform(1.5, 4.0) * rate))
            latest = np.searchsorted(time, rows, side="right") - 1
            return Stream(rows, basis, {name: column[latest] for name, column in values.items()})
        return Stream(time, basis, values)

    asked = {"heading_rate_command": log["heading_rate_command"]} if written == "CSV" else {}
    measured, estimated, commanded = Basis.MEASURED, Basis.ESTIMATED, Basis.COMMANDED
    streams = {
        "attitude": stream(attitude, late, estimated, math.radians(of.uniform(0.05, 0.5)),
                           bank=sign * log["bank"], pitch=log["pitch"], yaw=np.unwrap(log["yaw"])),
        "track": stream(of.uniform(4.0, 10.0), link + of.uniform(0.0, 0.25), estimated, of.uniform(0.05, 0.2),
                        velocity_north=log["velocity_north"], velocity_east=log["velocity_east"],
                        velocity_down=log["velocity_down"], altitude=log["altitude"]),
        "airspeed": stream(of.uniform(2.0, 10.0), link, measured, of.uniform(0.1, 0.4),
                           airspeed=log["airspeed"] / scale),
        "command": stream(of.uniform(10.0, 20.0), link, commanded, 0.0, bank_command=sign * held, **asked),
        "imu": stream(of.uniform(10.0, 20.0), link, measured, of.uniform(0.05, 0.3),
                      lateral_acceleration=log["lateral_acceleration"] + of.normal(0.0, 0.1)),
        "wind": _wind(log, of, link, -1.0 if wind_reversed else 1.0),
    }  # fmt: skip
    if written == "DataFlash":  # command and attitude in one message
        time = streams["attitude"].time
        streams["command"] = Stream(time, commanded, {"bank_command": _at(log["time"], sign * held, time, commanded)})
    hidden = Hidden(
        kind=kind, format=written, scale=scale, wind_reversed=wind_reversed, bank_reversed=bank_reversed,
        of_receipt=of_receipt,
        turbulent=log.flight.wind.turbulence != "none", turn_ratio=_true_turn_ratio(log),
        wind=(float(log["wind_north"].mean()), float(log["wind_east"].mean())),
        lags={each.noun: _true_lag(log, each) for each in FOLLOWED}, words=_true_words(log),
    )  # fmt: skip
    return BlindLog(log.flight, streams, hidden)


def _at(time: Array, column: Array, when: Array, basis: Basis) -> Array:
    if basis is Basis.COMMANDED:
        return np.asarray(column[np.clip(np.searchsorted(time, when, side="right") - 1, 0, None)])
    return np.interp(when, time, column)


def _wind(log: FlightLog, of: np.random.Generator, age: float, sign: float) -> Stream:
    """An estimate that settles, with an error that stays."""
    time = np.arange(0.5, log["time"][-1], 0.5)
    settling = np.exp(-time / of.uniform(5.0, 30.0))[:, np.newaxis]
    wind = np.array(log.flight.wind.steady) + of.normal(0.0, 0.3, 2) + of.normal(0.0, 3.0, 2) * settling
    north, east = sign * (wind + of.normal(0.0, 0.05, wind.shape)).T
    return Stream(time + age, Basis.ESTIMATED, {"wind_north": north, "wind_east": east})


def true_flight(log: FlightLog) -> RecordedFlight:
    """The flight with every value as it was, on board."""
    names = ("bank", "yaw", "velocity_north", "velocity_east", "airspeed", "altitude", "lateral_acceleration")
    columns = {name: np.unwrap(log[name]) if name == "yaw" else log[name] for name in names}
    channels = {name: Channel(log["time"], each, Basis.MEASURED, "", len(log)) for name, each in columns.items()}
    return RecordedFlight(name="true", sources=(), clock="", channels=channels)


def _true_turn_ratio(log: FlightLog) -> float:
    """The relation over the windows of the true flight in the wind that there was."""
    flight = true_flight(log)
    windows = turn.windows(flight["bank"])
    if not windows:
        return math.nan
    of = turn.integrals(flight["bank"], float(log["time"][0]), float(log["time"][-1]))
    wind = Fit(float(log["wind_north"].mean()), float(log["wind_east"].mean()), 1.0)
    return turn.relation(track_of(flight), of, wind, windows, 0.0, bank_error=False)[0].slope


def _commanded(log: FlightLog, of: Commanded) -> Channel:
    """The command when it is given, as one that is there at once."""
    values = log[of.command]
    if of is BANK:  # a row has the bank command that led to it
        values = np.append(values[1:], values[-1])
    return Channel(log["time"] + 0.5 * log.flight.guidance_period, values, Basis.COMMANDED, "", len(log))


def _true_lag(log: FlightLog, of: Commanded) -> float:
    values = np.unwrap(log[of.flown]) if of.is_rate else log[of.flown]
    flown = Channel(log["time"], values, Basis.MEASURED, "", len(log))
    fit = response_fit.fitted(_commanded(log, of), flown, of.is_rate)
    return fit.lag if fit else math.nan


def _true_words(log: FlightLog) -> dict[str, str]:
    flight = true_flight(log)
    for of in FOLLOWED:
        flight = flight.with_channel(of.command, _commanded(log, of))
    found = assess(flight)
    return {part.title: found[part.title].word for part in OTHERS}
