"""The inner loop on each airframe, measured as the rate of the air-velocity direction."""

import math
from functools import lru_cache

import numpy as np
import pytest

import aircraft
from harness.plants.model import load
from harness.plants.plant import Start
from harness.plants.sixdof import SixDof, trim
from harness.plants.state import State
from harness.world.air import Air
from harness.world.wind import Wind

AIRFRAMES = aircraft.names()
STEP = 0.005
FIVE = math.radians(5.0)


@lru_cache
def flown(
    name: str, rate: float, duration: float, wind: tuple[float, float] = (0.0, 0.0), rate_trim: bool = True
) -> dict[str, np.ndarray]:
    """A flight from trim with this heading-rate command from the first moment on, a row per step."""
    airframe = aircraft.folder(name)
    start = Start(airspeed=aircraft.limits(airframe).design_airspeed, heading=0.4)
    flying = SixDof(airframe, STEP, rate_trim).start(start, Air(steady=wind))
    states = [flying.state]
    for _ in range(round(duration / STEP)):
        flying.advance(rate, STEP)
        states.append(flying.state)
    return {field: np.array(column) for field, column in zip(State._fields, zip(*states, strict=True), strict=True)}


def departure(values: np.ndarray) -> float:
    return float(np.abs(values - values[0]).max())


@pytest.mark.parametrize("name", AIRFRAMES)
def test_a_step_to_5_deg_s_is_quick_and_does_not_overshoot(name: str) -> None:
    share = flown(name, FIVE, 30.0)["heading_rate"] / FIVE
    assert STEP * np.argmax(share >= 1.0 - math.exp(-1.0)) <= 0.45
    assert share.max() <= 1.03


@pytest.mark.parametrize("name", AIRFRAMES)
def test_a_step_to_5_deg_s_keeps_altitude_and_airspeed(name: str) -> None:
    x = flown(name, FIVE, 30.0)
    assert departure(x["altitude"]) <= 0.2
    assert departure(x["airspeed"]) <= 0.05


@pytest.mark.parametrize("name", AIRFRAMES)
def test_with_the_rate_trim_the_turn_is_steady_at_the_command(name: str) -> None:
    steady = flown(name, FIVE, 30.0)["heading_rate"][-2000:]
    assert steady == pytest.approx(FIVE, rel=0.003)


def test_without_the_rate_trim_the_rudderless_wing_falls_7_to_8_percent_short() -> None:
    x = flown("skywalker_x8", FIVE, 30.0, rate_trim=False)
    assert 0.92 <= x["heading_rate"][-1] / FIVE <= 0.93
    assert x["bank"][-1] == pytest.approx(math.atan(13.0 * FIVE / 9.80665), rel=1e-3)


@pytest.mark.parametrize("wind", [(0.0, 0.0), (3.0, -4.0)])
@pytest.mark.parametrize("name", AIRFRAMES)
def test_without_a_command_nothing_moves_after_trim(name: str, wind: tuple[float, float]) -> None:
    """To rounding in still air. The trim knows of no drift over the sphere: 5 m/s turn the level by 1e-6 rad/s."""
    still, drift = wind == (0.0, 0.0), 1e-5
    x = flown(name, 0.0, 60.0, wind)
    for field in ("bank", "pitch", "sideslip", "angle_of_attack", "aileron", "elevator", "throttle", "heading"):
        assert departure(x[field]) <= (1e-8 if still else drift), field
    assert departure(x["airspeed"]) <= (1e-8 if still else drift)
    assert departure(x["altitude"]) <= (1e-7 if still else drift)


@pytest.mark.parametrize("name", AIRFRAMES)
def test_a_flight_begins_in_trim_and_its_clock_at_nought(name: str) -> None:
    airframe = aircraft.folder(name)
    start = Start(airspeed=aircraft.limits(airframe).design_airspeed, heading=0.4)
    trimmed = trim(load(airframe, STEP), start, Air())
    x = flown(name, FIVE, 1.0)
    for field, value in (*trimmed._asdict().items(), ("aileron", 0.0), ("bank", 0.0), ("heading", 0.4)):
        assert x[field][0] == pytest.approx(value, abs=1e-10), field
    for axis, speed in (("north", math.cos(0.4)), ("east", math.sin(0.4))):  # a step on, it has flown one step's way
        assert x[axis][1] - x[axis][0] == pytest.approx(STEP * start.airspeed * speed, abs=1e-6)


@pytest.mark.parametrize("air", ["still air", "moderate turbulence"])
@pytest.mark.parametrize("rate", [5.0, -20.0])
@pytest.mark.parametrize("name", AIRFRAMES)
def test_no_surface_moves_faster_than_its_servo_can(name: str, rate: float, air: str) -> None:
    """From the first step on: a reversed command, every surface in every step; elevons one by one."""
    airframe = aircraft.folder(name)
    start = Start(airspeed=aircraft.limits(airframe).design_airspeed, heading=0.4)
    rough = Wind(steady=(2.0, 1.0), turbulence="moderate").start(
        airspeed=start.airspeed, altitude=start.altitude, step=STEP, duration=6.0, seed=3
    )
    flying = SixDof(airframe, STEP, True).start(start, Air() if air == "still air" else rough)
    states = [flying.state]
    for k in range(1200):
        flying.advance(math.radians(rate if k < 600 else -rate), STEP)
        states.append(flying.state)
    aileron, elevator, rudder = np.array([(s.aileron, s.elevator, s.rudder) for s in states]).T
    servos = aircraft.data(airframe)["actuators"]
    moved = {"aileron": aileron, "elevator": elevator, "rudder": rudder}
    if servos["elevator"]["order"]["v"] == 2.0:  # elevons; the limit is each one's
        moved = {"elevator": elevator + aileron, "aileron": elevator - aileron}
    fastest = {surface: float(np.abs(np.diff(angle)).max()) / STEP for surface, angle in moved.items()}
    for surface, speed in fastest.items():
        assert speed <= servos[surface]["rate_limit"]["v"] * (1.0 + 1e-9), surface
    if rate == -20.0:  # so quick a command takes the servo to its limit: the test would see a faster one
        assert fastest["aileron"] == pytest.approx(servos["aileron"]["rate_limit"]["v"])


@pytest.mark.parametrize("name", AIRFRAMES)
def test_the_command_is_limited_at_the_bank_limit_and_unwinds_at_once(name: str) -> None:
    """Direction-aware anti-windup: after 10 s of an unreachable command the way back starts as from any turn."""
    airframe = aircraft.folder(name)
    start = Start(airspeed=aircraft.limits(airframe).design_airspeed)
    flying = SixDof(airframe, STEP, True).start(start, Air())
    for _ in range(2000):
        flying.advance(math.radians(60.0), STEP)
    assert flying.state.bank_command == pytest.approx(aircraft.limits(airframe).bank)
    for _ in range(100):
        flying.advance(0.0, STEP)
    assert flying.state.bank_command < 0.5 * aircraft.limits(airframe).bank


def test_a_turn_to_the_left_mirrors_one_to_the_right() -> None:
    right, left = flown("aerosonde", FIVE, 20.0), flown("aerosonde", -FIVE, 20.0)
    assert left["bank"] == pytest.approx(-right["bank"], abs=1e-9)
    assert left["altitude"] == pytest.approx(right["altitude"], abs=1e-7)
