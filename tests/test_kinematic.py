"""The kinematic plant against closed forms of Eq. (1)."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.plants.kinematic import Kinematic
from harness.plants.plant import Start
from harness.world.air import Air

START = Start(position=(5.0, -7.0), heading=0.3, airspeed=13.0)
WIND = Air(steady=(1.5, -2.5))
RATES = st.floats(-0.6, 0.6)


@given(rate=RATES, period=st.floats(0.001, 20.0))
def test_one_long_command_lands_where_the_circle_carried_by_the_wind_does(rate: float, period: float) -> None:
    flying = Kinematic().start(START, WIND)
    flying.advance(rate, period)
    psi = START.heading
    if abs(rate) > 1e-3:
        dn = 13.0 / rate * (math.sin(psi + rate * period) - math.sin(psi))
        de = -13.0 / rate * (math.cos(psi + rate * period) - math.cos(psi))
    else:  # to second order in the turn
        dn = 13.0 * period * (math.cos(psi) - 0.5 * rate * period * math.sin(psi))
        de = 13.0 * period * (math.sin(psi) + 0.5 * rate * period * math.cos(psi))
    assert flying.state.north == pytest.approx(5.0 + dn + 1.5 * period, abs=2e-2 if abs(rate) <= 1e-3 else 1e-9)
    assert flying.state.east == pytest.approx(-7.0 + de - 2.5 * period, abs=2e-2 if abs(rate) <= 1e-3 else 1e-9)


@given(rate=RATES, pieces=st.integers(2, 40))
def test_a_command_in_pieces_flies_as_the_command_whole(rate: float, pieces: int) -> None:
    whole, cut = Kinematic().start(START, WIND), Kinematic().start(START, WIND)
    whole.advance(rate, 4.0)
    for _ in range(pieces):
        cut.advance(rate, 4.0 / pieces)
    assert cut.state.north == pytest.approx(whole.state.north, abs=1e-10)
    assert cut.state.east == pytest.approx(whole.state.east, abs=1e-10)
    assert cut.state.heading == pytest.approx(whole.state.heading, abs=1e-12)


def test_a_full_turn_ends_where_it_began_but_for_the_wind() -> None:
    flying = Kinematic().start(START, WIND)
    rate = math.radians(5.0)
    for _ in range(72):
        flying.advance(rate, 1.0)
    assert flying.state.north == pytest.approx(5.0 + 72 * 1.5, abs=1e-9)
    assert flying.state.east == pytest.approx(-7.0 - 72 * 2.5, abs=1e-9)


def test_speed_over_the_ground_is_air_velocity_plus_wind() -> None:
    state = Kinematic().start(START, WIND).state
    assert (state.velocity_north - 1.5, state.velocity_east + 2.5) == pytest.approx(
        (13.0 * math.cos(0.3), 13.0 * math.sin(0.3))
    )
