"""The air: discrete gusts and shear in closed form, and that each plant flies in it."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import aircraft
from autopilot.laws import law
from harness.checks import problems
from harness.doctor.self_tests import wind_triangle_error
from harness.flight import Flight, air_of
from harness.loop import observe, simulate
from harness.plants.kinematic import Kinematic
from harness.plants.plant import Start
from harness.plants.sixdof import SixDof
from harness.world.air import Air
from harness.world.target import TargetState
from harness.world.wind import Gust, Wind

STICK = aircraft.folder("ultra_stick_25e")
GUST = Gust(from_=1.0, to=3.0, velocity=(2.0, -4.0, 1.0))
WIND = Wind(steady=(1.0, 2.0), gusts=(GUST, Gust(from_=2.0, to=2.5, velocity=(0.0, 1.0, 0.0))), shear=(0.05, -0.02))
FLIGHT = Flight(plant="kinematic", law=law("smc"), duration=5.0, wind=WIND)


def air(wind: Wind, step: float = 0.005, duration: float = 5.0) -> Air:
    return wind.start(airspeed=13.0, altitude=150.0, step=step, duration=duration, seed=0)


def test_a_discrete_gust_is_half_of_one_minus_cosine() -> None:
    blowing = air(Wind(gusts=(GUST,)))
    for time, share in ((0.5, 0.0), (1.0, 0.0), (1.5, 0.5), (2.0, 1.0), (2.5, 0.5), (3.0, 0.0), (5.0, 0.0)):
        assert blowing.gust(round(time / 0.005)) == pytest.approx((2.0 * share, -4.0 * share, 1.0 * share), abs=1e-12)


def test_a_gust_carries_by_half_its_peak_times_its_length() -> None:
    assert air(Wind(gusts=(GUST,))).drift(0, 1000) == pytest.approx((2.0, -4.0))
    assert air(Wind(gusts=(GUST,))).drift(200, 400) == pytest.approx((1.0, -2.0))


def test_gusts_add_up() -> None:
    one, other = (air(Wind(gusts=(gust,))) for gust in WIND.gusts)
    assert air(WIND).gusts == pytest.approx(one.gusts + other.gusts, abs=1e-12)


def test_the_kinematic_aircraft_is_carried_by_the_gusts_whatever_the_period() -> None:
    start = Start(heading=0.3)
    calm, often, seldom = (Kinematic().start(start, air(wind)) for wind in (Wind(steady=(1.0, 2.0)), WIND, WIND))
    calm.advance(0.05, 5.0)
    seldom.advance(0.05, 5.0)
    for _ in range(100):
        often.advance(0.05, 0.05)
    carried = air(WIND).drift(0, 1000)
    for flying in (often, seldom):
        assert flying.state.north - calm.state.north == pytest.approx(carried[0], abs=1e-9)
        assert flying.state.east - calm.state.east == pytest.approx(carried[1], abs=1e-9)


def test_the_kinematic_aircraft_keeps_its_airspeed_and_heading_in_a_gust_and_moves_with_it() -> None:
    flying = Kinematic().start(Start(heading=0.3), air(WIND))
    flying.advance(0.0, 2.0)
    s = flying.state
    assert s.airspeed == 13.0
    assert s.heading == pytest.approx(0.3)
    assert (s.wind_north, s.wind_east, s.wind_down) == pytest.approx((3.0, -2.0, 1.0))
    assert s.velocity_north - s.wind_north == pytest.approx(13.0 * math.cos(0.3))
    assert s.velocity_east - s.wind_east == pytest.approx(13.0 * math.sin(0.3))


def test_a_law_sees_the_direction_of_ground_velocity_less_steady_wind_on_every_plant() -> None:
    for flying in (
        Kinematic().start(Start(heading=0.3), air(WIND)),
        SixDof(STICK, 0.005, True).start(Start(), air(WIND)),
    ):
        flying.advance(0.05, 1.5)
        s = flying.state
        seen = observe(s, 13.0, WIND.steady, TargetState(0.0, 0.0, 0.0, 0.0))
        assert seen.heading == math.atan2(s.velocity_east - 2.0, s.velocity_north - 1.0)


@pytest.mark.parametrize("name", aircraft.names())
def test_jsbsim_flies_in_the_air_that_it_is_given(name: str) -> None:
    """In the middle of two gusts, with shear: v_ground - v_air is the wind that the state shows."""
    start = Start(airspeed=float(aircraft.data(aircraft.folder(name))["envelope"]["V_design"]["v"]), heading=2.0)
    assert wind_triangle_error(aircraft.folder(name), start, air(WIND)) < 1e-6


def test_the_state_of_the_6_dof_aircraft_shows_steady_wind_gust_and_shear_at_its_height() -> None:
    blowing = air(WIND)
    flying = SixDof(STICK, 0.005, True).start(Start(), blowing)
    for k in (0, 200, 400, 500):
        if k:
            flying.advance(0.0, 1.0 if k < 500 else 0.5)
        s, (gust_x, gust_y, gust_z) = flying.state, blowing.gust(k)
        climbed = s.altitude - 150.0
        assert s.wind_north == pytest.approx(1.0 + gust_x + 0.05 * climbed, abs=1e-3)
        assert s.wind_east == pytest.approx(2.0 + gust_y - 0.02 * climbed, abs=1e-3)
        assert s.wind_down == pytest.approx(gust_z)
    assert abs(climbed) > 0.1


def test_shear_slows_a_climb_into_the_growing_tailwind() -> None:
    """A lighter aircraft 10 m higher: the airspeed loop has made up for the 1 m/s more that blow from behind."""
    flying = SixDof(STICK, 0.005, True).start(Start(heading=0.0), air(Wind(shear=(0.1, 0.0)), duration=60.0))
    flying.fdm["inner-loop/command/altitude-m"] = 160.0
    flying.advance(0.0, 60.0)
    s = flying.state
    assert s.wind_north == pytest.approx(1.0, abs=0.01)
    assert s.velocity_north == pytest.approx(14.0, abs=0.05)
    assert s.airspeed == pytest.approx(13.0, abs=0.05)


@pytest.mark.parametrize("plant", ["kinematic", "sixdof"])
def test_the_log_shows_the_same_air_on_either_plant(plant: str) -> None:
    log = simulate(replace(FLIGHT, plant=plant, wind=replace(WIND, shear=(0.0, 0.0))))
    expected = air_of(log.flight).gusts[::10] + np.array((1.0, 2.0, 0.0))
    flown = np.column_stack([log["wind_north"], log["wind_east"], log["wind_down"]])
    assert flown == pytest.approx(expected, abs=1e-9)


def test_a_gust_that_ends_before_it_begins_is_refused() -> None:
    (problem,) = problems(replace(FLIGHT, wind=Wind(gusts=(replace(GUST, to=1.0),))))
    assert problem.name == "wind.gusts.0.to"
    assert "must be after from_s, 1 s" in problem.message


def test_a_wind_made_with_a_list_is_the_same_air() -> None:
    as_list = Wind(steady=json.loads("[1.0, 2.0]"), turbulence="light")
    assert np.array_equal(air(as_list).gusts, air(Wind(steady=(1.0, 2.0), turbulence="light")).gusts)
