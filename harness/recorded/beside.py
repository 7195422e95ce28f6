"""A 6-DOF flight with the bank, airspeed and wind of a recorded flight, judged in the same way."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import aircraft
from harness.plants.plant import End, Start
from harness.plants.sixdof import SixDof
from harness.plants.state import State
from harness.plants.turn import rate_of_turn
from harness.recorded.assessment import Assessment, assess, averaged
from harness.recorded.recorded_flight import Array, Basis, Channel, LogError, RecordedFlight
from harness.recorded.turn import STEEPEST
from harness.world.air import Air

PERIOD = 0.05  # s: guidance period
_STEP = 0.005  # s: simulation step
_ALTITUDE = 150.0  # m: altitude of the simulated flight
_ASSUMED = (
    "bank",
    "yaw",
    "airspeed",
    "velocity_north",
    "velocity_east",
    "altitude",
    "sideslip",
    "lateral_acceleration",
)


@dataclass(frozen=True, slots=True)
class ModelFlight:
    """The flight of the model."""

    airframe: str
    airspeed: float  # m/s
    assessment: Assessment
    ended: str  # why it ended before the recording; empty where it did not


def beside(found: Assessment, airframe: Path) -> ModelFlight:
    """Flies the airframe with the recorded bank, at the recorded airspeed and in the wind of the track.

    The command is the heading rate of a coordinated turn at that bank. Raises `LogError` if the log does not give
    bank, airspeed and wind, or the model does not fly so slowly or fast.
    """
    if aircraft.is_recorded(airframe):
        raise LogError(f"no model beside this log: {airframe.name} was fitted to a flight, and has none")
    flight, limits = found.flight, aircraft.limits(airframe)
    if not found.wind or not flight.has("bank"):
        raise LogError("no model beside this log: it gives no bank and wind")
    airspeed = _airspeed(found)
    if not limits.slowest <= airspeed <= limits.fastest:
        allowed = f"{airframe.name} flies from {limits.slowest:g} to {limits.fastest:g} m/s"
        raise LogError(f"no model beside this log: {allowed}, the flight was at {airspeed:.1f} m/s")
    time = np.arange(flight["bank"].time[0], flight["bank"].time[-1], PERIOD)
    bank = np.clip(np.nan_to_num(flight["bank"].at(time)), -STEEPEST, STEEPEST)
    commands = rate_of_turn(np.full(len(time), airspeed), bank)
    start = Start(airspeed=airspeed, heading=_heading(found), altitude=_ALTITUDE)
    flying = SixDof(airframe, _STEP, rate_trim=True).start(start, Air(steady=(found.wind.north[0], found.wind.east[0])))
    states, ended = [flying.state], ""
    try:
        for rate in commands.tolist():
            flying.advance(rate, PERIOD)
            states.append(flying.state)
    except End as end:
        ended = f"{end.outcome}: {end}"
    return ModelFlight(airframe.name, airspeed, assess(_recorded(airframe.name, np.array(states), commands)), ended)


def _airspeed(found: Assessment) -> float:
    """The usual true airspeed, m/s."""
    flight, wind = found.flight, found.wind
    assert wind
    if wind.scale and flight.has("airspeed"):
        return wind.scale[0] * float(np.median(averaged(flight["airspeed"], 1.0)[1]))
    north, east = flight["velocity_north"], flight["velocity_east"]
    return float(np.median(np.hypot(north.values - wind.north[0], east.at(north.time) - wind.east[0])))


def _heading(found: Assessment) -> float:
    """The direction of the air velocity at the beginning, rad."""
    flight, wind = found.flight, found.wind
    assert wind
    north, east = flight["velocity_north"], flight["velocity_east"]
    return math.atan2(float(east.values[0]) - wind.east[0], float(north.values[0]) - wind.north[0])


def _recorded(name: str, states: Array, commands: Array) -> RecordedFlight:
    """The states as a log without noise. The bank command of a row is the one that led to it."""
    time: Array = PERIOD * np.arange(len(states), dtype=np.float64)

    def column(name: str) -> Array:
        return np.asarray(states[:, State._fields.index(name)])

    channels = {field: Channel(time, column(field), Basis.MEASURED, "", len(time)) for field in _ASSUMED}
    channels["altitude_error"] = Channel(time, column("altitude") - _ALTITUDE, Basis.DERIVED, "", len(time))
    channels["yaw"] = replace(channels["yaw"], values=np.unwrap(channels["yaw"].values))
    led = np.append(column("bank_command")[1:], column("bank_command")[-1])
    channels["bank_command"] = Channel(time, led, Basis.COMMANDED, "", len(time))
    asked = np.append(commands, commands[-1])[: len(time)]
    channels["heading_rate_command"] = Channel(time, asked, Basis.COMMANDED, "", len(time))
    return RecordedFlight(name=name, sources=(), clock="", channels=channels)
