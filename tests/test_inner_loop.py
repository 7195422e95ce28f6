"""The inner loop on each airframe, measured as the rate of the air-velocity direction."""

import math
from functools import lru_cache

import numpy as np
import pytest

import aircraft
from harness.plants.plant import Start
from harness.plants.sixdof import SixDof
from harness.plants.state import State
from harness.world.air import Air

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
def test_engagement_leaves_no_transient(name: str, wind: tuple[float, float]) -> None:
    x = flown(name, 0.0, 60.0, wind)
    assert departure(x["airspeed"]) <= 1e-3
    assert departure(x["altitude"]) <= 1e-3
    assert departure(x["heading"]) <= 1e-4


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
