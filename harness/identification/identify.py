"""Identifies an airframe's inner loop: flies manoeuvres on the plant sixdof, fits responses, and validates them."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import aircraft
from autopilot.response import Response
from harness.identification import manoeuvres
from harness.identification.fit import Array, Training, airspeed_change, fit, fit_airspeed, means
from harness.identification.manoeuvres import (
    STEP,
    STEPS_DEG_S,
    SWEEP_PERIOD,
    WHOLE,
    Programme,
    Record,
    begins,
    flown,
    quick,
    sweep,
)
from harness.plants.coordinated import bank_command
from harness.plants.identified import Identified, Sweep
from harness.plants.plant import Plant, Start
from harness.plants.state import State
from harness.plants.turn import rate_of_turn
from harness.series import rms
from harness.world.air import Air

_BANK = State._fields.index("bank")
_SMALL_LAG = 0.28  # s: time to 63 % of a step of the small aircraft for which the fit was designed


@dataclass(frozen=True, slots=True)
class StepResponse:
    """A flown step response of the heading rate, relative to its command."""

    amplitude: float  # rad/s
    rate: Array  # heading rate over the step of its command, a value per simulation step
    lag: float  # time to 63 %, s; NaN where it is not reached
    overshoot: float
    gain: float  # mean of the last 2 s
    turn_ratio: float  # heading rate over g tan(bank) / V, over the same 2 s
    bank: float  # rad, the largest


@dataclass(frozen=True, slots=True)
class FrequencyResponse:
    """A flown sweep: heading rate over its command at each frequency of `manoeuvres.lines()`."""

    rms: float  # rad/s, of the command
    ratio: NDArray[np.complex128]

    @property
    def bandwidth(self) -> float:
        """The frequency at which the gain first falls below -3 dB, rad/s; NaN if it never does."""
        gain, omega = np.abs(self.ratio), np.log(manoeuvres.lines())
        below = np.flatnonzero((gain[1:] < math.sqrt(0.5)) & (gain[:-1] >= math.sqrt(0.5)))
        if not below.size:
            return math.nan
        i = below[0]
        return math.exp(float(np.interp(-math.sqrt(0.5), -gain[i : i + 2], omega[i : i + 2])))

    def at(self, omega: float) -> tuple[float, float]:
        """Gain and phase, rad, at the frequency `omega`, rad/s, interpolated between the lines."""
        lines = np.log(manoeuvres.lines())
        phase = np.unwrap(np.angle(self.ratio))
        return float(np.interp(math.log(omega), lines, np.abs(self.ratio))), float(
            np.interp(math.log(omega), lines, phase)
        )

    @property
    def sweep(self) -> Sweep:
        """The result as numbers to store."""
        phase = np.unwrap(np.angle(self.ratio))
        return Sweep._make(tuple(values.tolist()) for values in (manoeuvres.lines(), np.abs(self.ratio), phase))


@dataclass(frozen=True, slots=True)
class Identification:
    """All results of `harness identify`."""

    airframe: Path
    identified: Identified
    steps: tuple[StepResponse, ...]
    sweeps: Mapping[str, FrequencyResponse]
    airspeed_error: tuple[float, float]  # RMS, m/s, in the largest step: of the fitted hold, and of constant airspeed


_FIT = 700.0  # the work of fitting one response, see `work`


def work(airframe: Path) -> float:
    """The work of an identification, in seconds of simulated flight."""
    return STEP * sum(len(command) for command, _ in _programme(airframe).flights()) + 2 * _FIT


def identify(airframe: Path, airspeed: float, done: Callable[[float], None] = lambda work: None) -> Identification:
    """Flies, fits and validates at this airspeed, m/s; `done` is called after each part of `work`, with its size.

    The commands suit small aircraft. An adopted one has a share of them, because a fast one turns slowly at a large
    bank; and where it follows slowly, they are slower.

    Raises `PlantError` when a manoeuvre cannot start, `End` when one ends early.
    """
    scale, programme = _scale(airframe, airspeed), _programme(airframe)
    records: list[tuple[Array, bool, Record]] = []
    for command, rate_trim in programme.flights():
        scaled = command * scale if scale != 1.0 else command
        records.append((command, rate_trim, flown(airframe, airspeed, scaled, rate_trim)))
        done(STEP * len(command))

    def flight(command: Array, rate_trim: bool = True) -> Record:
        record = next(record for known, trimmed, record in records if trimmed == rate_trim and begins(command, known))
        return record.beginning(len(command))

    def fitted_to(records: Sequence[Training]) -> Response:
        response = fit(records, pace)
        done(_FIT)
        return response

    limit = aircraft.limits(airframe).bank
    steps = tuple(step_response(flight(command)) for command in programme.steps)
    five = steps[STEPS_DEG_S.index(5.0)]
    pace = min(1.0, _SMALL_LAG / _lag(airframe))
    sweeps = {name: frequency_response(flight(sweep(rms, periods=2))) for name, rms in programme.swept.items()}
    heading_rate = fitted_to([of_heading_rate(flight(command)) for command in programme.training.values()])
    bank = fitted_to([of_bank(flight(command, rate_trim=False), limit) for command in programme.training.values()])
    entries = [of_airspeed(flight(command)) for command in programme.entries]
    fitted = Identified(
        airspeed=airspeed, heading_rate=heading_rate, bank=bank, hold=fit_airspeed(entries), bank_limit=limit,
        measured={}, errors={},
    )  # fmt: skip
    measured = {
        "gain": five.gain, "lag_s": five.lag, "overshoot": five.overshoot, "turn_ratio": five.turn_ratio,
        "bandwidth_rad_s": sweeps["medium"].bandwidth,
    }  # fmt: skip
    change = airspeed_change(fitted.hold, entries[-1].input)
    return Identification(
        airframe=airframe,
        identified=replace(
            fitted,
            measured=measured,
            errors={
                _told(name, scale, _slower(airframe)): _errors(fitted, flight(command))
                for name, command in programme.held_out.items()
            },
            sweep=next(iter(sweeps.values())).sweep,
        ),
        steps=steps,
        sweeps=sweeps,
        airspeed_error=(rms(change - entries[-1].output), rms(entries[-1].output)),
    )


def _programme(airframe: Path) -> Programme:
    return quick(_slower(airframe)) if aircraft.adopted(airframe) else WHOLE


def _slower(airframe: Path) -> int:
    """How many times as slow the commands are: a step lasts seven lags, and no longer than a minute."""
    return min(max(round(_lag(airframe)), 1), 4)


def _lag(airframe: Path) -> float:
    """Approximate lag of the aircraft, s."""
    return aircraft.adopted_lag(airframe) or _SMALL_LAG  # of the harness's own: the committed fits were made so


def _scale(airframe: Path, airspeed: float) -> float:
    """The scale of the commands, which keeps an adopted aircraft within its bank limit."""
    if not aircraft.adopted(airframe):
        return 1.0
    largest = 0.85 * float(rate_of_turn(np.array(airspeed), np.array(aircraft.limits(airframe).bank)))
    return min(1.0, float(f"{largest / math.radians(STEPS_DEG_S[-1]):.2g}"))


def _told(manoeuvre: str, scale: float, slower: int) -> str:
    return (
        ("" if scale == 1.0 else f"{scale:g} times the ")
        + manoeuvre
        + ("" if slower == 1 else f", {slower} times as slow")
    )


def of_heading_rate(record: Record) -> Training:
    """The record for a fit of the heading rate from its command."""
    return Training(record.command, record.heading_rate)


def of_bank(record: Record, limit: float) -> Training:
    """The record for a fit of the bank from the bank command that the inner loop computes; `limit` in rad."""
    commanded = np.array([bank_command(rate, record.airspeed, limit) for rate in record.command.tolist()])
    bank = record.states[:, _BANK]
    return Training(commanded, 0.5 * (bank[1:] + bank[:-1]))


def of_airspeed(record: Record) -> Training:
    """The record for a fit of the change of airspeed from the load factor beyond one."""
    return Training(1.0 / np.cos(record.states[:-1, _BANK]) - 1.0, record["airspeed"] - record.airspeed)


def step_response(record: Record) -> StepResponse:
    """Lag, overshoot, gain, turn ratio and bank of a flown step."""
    amplitude = float(record.command[0])
    share = record.heading_rate / amplitude
    reached = 1.0 - math.exp(-1.0)
    after = int(np.argmax(share >= reached))
    before = max(after - 1, 0)
    lag = STEP * (
        0.5 + float(np.interp(reached, share[[before, after]], [before, after]))
    )  # a mean over a step belongs to its middle
    if share[after] < reached:
        lag = math.nan
    last = slice(-round(2.0 / STEP), None)
    coordinated = rate_of_turn(record["airspeed"], record["bank"])
    gain = float(share[last].mean())
    return StepResponse(
        amplitude=amplitude,
        rate=share,
        lag=lag,
        overshoot=max(0.0, float(share.max()) - 1.0),
        gain=gain,
        turn_ratio=gain * amplitude / float(coordinated[last].mean()),
        bank=float(np.abs(record["bank"]).max()),
    )


def frequency_response(record: Record) -> FrequencyResponse:
    """The frequency response from the second period of a sweep, when the transient of the first has died away."""
    count = round(SWEEP_PERIOD / STEP)
    multiples = np.round(manoeuvres.lines() / manoeuvres.SLOWEST).astype(int)
    command, rate = (np.fft.rfft(values[-count:])[multiples] for values in (record.command, record.heading_rate))
    return FrequencyResponse(rms(record.command), rate / command)


def _errors(fitted: Identified, record: Record) -> tuple[float, float]:
    """The errors of the plants lagged and coordinated in heading rate: RMS of means over 20 ms over the command's."""
    lagged, coordinated = (_followed(plant, record) for plant in (fitted.lagged, fitted.coordinated))
    scale = rms(record.command)
    return (
        rms(means(lagged - record.heading_rate)) / scale,
        rms(means(coordinated - record.heading_rate)) / scale,
    )


def _followed(plant: Plant, record: Record) -> Array:
    """The mean heading rate of the plant over each step, rad/s, for the command of the record."""
    flying = plant.start(Start(airspeed=record.airspeed, heading=0.0), Air())
    headings = [0.0]
    for rate in record.command.tolist():
        flying.advance(rate, STEP)
        headings.append(flying.state.heading)
    return np.diff(np.unwrap(headings)) / STEP
