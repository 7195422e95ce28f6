"""The laws that the field flies: against their closed forms, on the circle, and on an aircraft."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import aircraft
from autopilot import npfg
from autopilot.angles import wrap
from autopilot.circling import circling, heading_of_course, heading_rate
from autopilot.guidance import Law, Observation
from autopilot.laws import law
from autopilot.response import Response
from autopilot.standoff import course_rate_ratio, relative_motion
from harness.flight import Flight
from harness.loop import simulate
from harness.plants.identified import identified
from harness.plants.plant import Start
from harness.world.target import Target
from harness.world.wind import Wind
from tests.test_guidance import R_D, V_A, fly_at, moment, rate
from tests.test_rules import AIRSPEEDS, described

FIELD_LAWS = ("l1", "npfg", "lgvf", "orbit_field")
STILL = Observation(*(0.0,) * 18)._replace(nominal_airspeed=V_A, airspeed=V_A)


def free(name: str, **parameters: Any) -> Law:
    """The law without a limit of its command, whatever the velocity that is observed."""
    return law(name, max_heading_rate=1e9, airspeed="nominal", **parameters)


def north_of_target(L: float, bar_chi: float = 0.0) -> Observation:
    """In still air at a distance, on a course against the tangent: the paper's circle goes west there."""
    chi = bar_chi - 0.5 * math.pi
    velocity = V_A * math.cos(chi), V_A * math.sin(chi)
    return STILL._replace(north=L, velocity_north=velocity[0], velocity_east=velocity[1], heading=chi)


def on_the_circle(o: Observation) -> Observation:
    """The same moment, moved onto the circle with the heading that keeps the distance."""
    x, y = o.north - o.target_north, o.east - o.target_east
    o = o._replace(north=o.target_north + R_D * x / math.hypot(x, y), east=o.target_east + R_D * y / math.hypot(x, y))
    return o._replace(heading=wrap(o.heading - relative_motion(o, R_D, V_A, o.heading)[3]))


@pytest.mark.parametrize("name", FIELD_LAWS)
@pytest.mark.parametrize("psi", [-2.0, 0.4, 2.9])
def test_on_the_circle_each_law_commands_the_rate_that_keeps_it_in_wind_behind_a_manoeuvring_target(
    name: str, psi: float
) -> None:
    o = on_the_circle(moment(0.0, psi))
    _, r_dot, lam_dot, error, psi_a_d_dot = relative_motion(o, R_D, V_A, o.heading)
    assert (r_dot, error) == pytest.approx((0.0, 0.0), abs=1e-12)
    answer = fly_at(o, free(name))
    assert answer.heading_rate == pytest.approx(lam_dot + psi_a_d_dot, rel=1e-9)
    assert answer.feed_forward == pytest.approx(answer.heading_rate, rel=1e-9)
    assert (answer.range_error, answer.heading_error) == pytest.approx((0.0, 0.0), abs=1e-9)


@pytest.mark.parametrize("name", ["lgvf", "orbit_field"])
@pytest.mark.parametrize("psi", [-2.0, 0.4, 2.9])
def test_a_field_is_followed_with_an_error_that_decays_at_the_rate_k(name: str, psi: float) -> None:
    steering = free(name, k=0.8)
    now = fly_at(moment(0.0, psi), steering)
    error_dot = rate(lambda t: fly_at(moment(t, psi, now.heading_rate), steering).heading_error, 1e-6)
    assert error_dot == pytest.approx(-0.8 * now.heading_error, rel=1e-5)


@pytest.mark.parametrize("L", [1.0, 50.0, R_D, 600.0])
def test_the_rate_on_the_lyapunov_field_is_4_v_r3_over_r2_plus_d2_squared(L: float) -> None:
    bar_chi = math.atan2(R_D**2 - L**2, 2.0 * L * R_D)
    answer = fly_at(north_of_target(L, bar_chi), free("lgvf"))
    assert answer.heading_error == pytest.approx(0.0, abs=1e-12)
    assert answer.heading_rate == pytest.approx(-4.0 * V_A * R_D**3 / (L**2 + R_D**2) ** 2, rel=1e-9)


@given(st.floats(-math.pi, math.pi), st.floats(1.0, 1000.0), st.floats(0.0, 12.9), st.floats(-math.pi, math.pi))
def test_the_heading_of_the_lyapunov_field_makes_the_relative_velocity_parallel_to_it(
    azimuth: float, L: float, wind: float, towards: float
) -> None:
    o = STILL._replace(north=L * math.cos(azimuth), east=L * math.sin(azimuth))
    o = o._replace(wind_north=wind * math.cos(towards), wind_east=wind * math.sin(towards), heading=0.3)
    psi_d = o.heading - fly_at(o, free("lgvf")).heading_error
    x, y, R = o.north, o.east, R_D
    field = -(x * (L * L - R * R) - y * 2 * L * R), -(y * (L * L - R * R) + x * 2 * L * R)  # Lawrence, anticlockwise
    flown = V_A * math.cos(psi_d) + o.wind_north, V_A * math.sin(psi_d) + o.wind_east
    size = math.hypot(*field) * V_A
    assert (field[0] * flown[1] - field[1] * flown[0]) / size == pytest.approx(0.0, abs=1e-9)
    assert (field[0] * flown[0] + field[1] * flown[1]) / size >= -1e-9


def test_the_orbit_field_leans_by_the_arctangent_of_the_books_formula() -> None:
    for r in (-150.0, -10.0, 40.0, 900.0):
        error = fly_at(north_of_target(R_D + r), free("orbit_field", k_orbit=3.0)).heading_error
        assert error == pytest.approx(math.atan(3.0 * r / R_D))


@pytest.mark.parametrize("name", ["l1", "npfg"])
@pytest.mark.parametrize(("period", "damping"), [(17.0, 0.75), (9.0, 0.6)])
def test_around_the_circle_the_range_error_swings_with_the_period_and_the_damping_of_the_law(
    name: str, period: float, damping: float
) -> None:
    steering = free(name, period=period, damping=damping)
    start = Start(position=(R_D + 0.1, 0.0), heading=-0.5 * math.pi)
    flight = Flight(plant="kinematic", law=steering, start=start, duration=period, guidance_period=0.005, step=0.005)
    log = simulate(replace(flight, target=Target(position=(0.0, 0.0))))
    omega, t = 2.0 * math.pi / period, log["time"]
    damped = omega * math.sqrt(1.0 - damping**2)
    wave = np.cos(damped * t) + damping * omega / damped * np.sin(damped * t)
    assert log["range_error"] == pytest.approx(0.1 * np.exp(-damping * omega * t) * wave, abs=1e-3)


def test_l1_flies_to_the_centre_from_afar_and_leaves_the_capture_without_a_step() -> None:
    steering = free("l1")
    assert fly_at(north_of_target(2000.0, -0.5 * math.pi), steering).heading_rate == pytest.approx(0.0, abs=1e-12)
    across = fly_at(north_of_target(2000.0), steering).heading_rate
    assert across == pytest.approx(-4.0 * math.pi * 0.75 / 17.0)  # K_L1 V / L1, to the left
    rates = np.array([fly_at(north_of_target(L, -1.0), steering).heading_rate for L in np.arange(190.0, 400.0, 0.01)])
    assert np.abs(np.diff(rates)).max() < 1e-3


def test_l1_does_not_turn_the_wrong_way_when_it_flies_out_the_wrong_way_round() -> None:
    answer = fly_at(north_of_target(150.0, 0.75 * math.pi), free("l1"))
    assert answer.heading_rate == pytest.approx(answer.feed_forward)
    assert answer.heading_rate < 0.0


def test_the_look_ahead_of_npfg_is_a_right_angle_on_the_track_and_none_beyond_the_bound() -> None:
    assert npfg.look_ahead(0.0, 13.0, 7.0) == pytest.approx(0.5 * math.pi)
    assert npfg.look_ahead(0.5 * 91.0, 13.0, 7.0) == pytest.approx(0.125 * math.pi)
    assert npfg.look_ahead(91.0, 13.0, 7.0) == npfg.look_ahead(1e9, 13.0, 7.0) == 0.0
    assert npfg.look_ahead(1.0, 1.0, 7.0) == pytest.approx(npfg.look_ahead(1.0, 1.0 + 1e-9, 7.0))


@pytest.mark.parametrize(
    ("cross", "along", "feasible"),
    [(0.0, 3.0, 1.0), (11.5, 1.0, 1.0), (-12.25, 1.0, 0.5), (13.0, 1.0, 0.0), (15.0, 1.0, 0.0), (0.0, -12.25, 0.5)],
)
def test_a_bearing_becomes_infeasible_within_1_5_m_s_and_a_headwind_counts_whole(
    cross: float, along: float, feasible: float
) -> None:
    assert npfg.feasibility(V_A, cross, along, math.hypot(cross, along) if along < 0.0 else 20.0) == pytest.approx(
        feasible
    )


def test_npfg_turns_to_the_nearest_of_infeasible_bearings_and_drops_the_turn() -> None:
    """North of the target, where the circle goes west, in a wind from the west above the airspeed."""
    o = north_of_target(R_D)._replace(wind_east=20.0)
    answer = fly_at(o, free("npfg"))
    nearest = math.sqrt(20.0**2 - V_A**2) * np.array([0.0, -1.0]) - np.array([0.0, 20.0])
    assert o.heading - answer.heading_error == pytest.approx(math.atan2(nearest[1], nearest[0]))
    assert answer.feed_forward == 0.0


def test_the_period_of_npfg_keeps_to_its_bounds() -> None:
    def period(e: float = 0.0, w: float = 8.0, feasible: float = 1.0, **parameters: Any) -> float:
        g = law("npfg", **{"period": 1.0, **parameters})
        assert isinstance(g, npfg.Npfg)
        return npfg.bounded_period(g, e, V_A, V_A, w, feasible)

    straight, windy = 1.5 * math.pi * 0.5 / 0.7, 1.5 * 4.0 * math.pi * 0.5 * 0.7
    assert period(w=0.0) == pytest.approx(straight)
    assert period() == pytest.approx(windy)
    assert period(feasible=0.0) == pytest.approx(straight)
    assert period(e=1e3) == pytest.approx(straight)  # the circle's turn counts near the circle
    assert period(damping=0.4) == pytest.approx(1.5 * math.pi * 0.5 / 0.4)
    assert period(roll_time=0.0) == 1.0
    assert period(period=10.0) == 10.0
    upper = 4.0 * math.pi * 0.7 / (V_A / 20.0 * 2.0 * (1.0 - math.sqrt(1.0 - 8.0 / 13.0)))
    assert period(period=30.0, standoff=20.0) == pytest.approx(upper)
    assert period(period=30.0, standoff=20.0, e=1e3) == 30.0


@given(psi=st.floats(-math.pi, math.pi), wind=st.floats(0.0, 12.9), towards=st.floats(-math.pi, math.pi))
def test_a_course_rate_becomes_a_heading_rate_by_eq_3(psi: float, wind: float, towards: float) -> None:
    W_x, W_y = wind * math.cos(towards), wind * math.sin(towards)
    seen = circling(STILL._replace(north=300.0, wind_north=W_x, wind_east=W_y), R_D, V_A, psi)
    ratio = course_rate_ratio(V_A, psi, W_x, W_y)
    V = math.hypot(seen.v_along, seen.v_out)
    assert heading_rate(seen, 0.1 * V) == pytest.approx(0.1 / ratio, rel=1e-9)
    bar_chi = math.atan2(seen.v_out, seen.v_along)
    heading, turn = heading_of_course(seen, bar_chi, 0.1)
    assert wrap(heading - seen.bar_psi_a) == pytest.approx(0.0, abs=1e-6)
    assert turn == pytest.approx(0.1 / ratio, rel=1e-5)


def test_each_law_says_what_its_source_asks_for() -> None:
    assert [law(name).broken_conditions(0.5) for name in FIELD_LAWS] == [[]] * 4
    assert ["not below 1" in "".join(law(name).broken_conditions(1.0)) for name in FIELD_LAWS[1:]] == [True] * 3
    assert "damping" in law("l1", damping=0.4).broken_conditions(0.0)[0]
    broken = law("npfg", period=1.0, damping=0.45).broken_conditions(0.0)
    assert [("raises" in text, "below 0.5" in text) for text in broken] == [(True, False), (False, True)]


def by_lag(name: str, airframe: str, **given: float) -> tuple[Any, Response]:
    """The law by the rule for the scaled circle of an airframe, and the airframe's response."""
    airspeed = AIRSPEEDS[airframe]
    table = {"name": name, "gains": "by_lag", "airspeed": "nominal", "standoff_m": 200.0 / 13.0 * airspeed, **given}
    flight = described(table, plant="sixdof", aircraft=airframe, start={"airspeed_mps": airspeed})
    return flight.law, identified(aircraft.folder(airframe), airspeed).heading_rate


@pytest.mark.parametrize("airframe", aircraft.names())
def test_the_lag_of_a_response_is_how_late_it_is_to_a_slow_command(airframe: str) -> None:
    response = identified(aircraft.folder(airframe), AIRSPEEDS[airframe]).heading_rate
    slow = 1e-4
    assert response.lag == pytest.approx(-float(np.angle(response.at(np.array([slow])))[0]) / slow, rel=1e-5)


@pytest.mark.parametrize("airframe", aircraft.names())
def test_by_lag_each_law_feeds_the_course_back_with_the_same_gain(airframe: str) -> None:
    for name in FIELD_LAWS:
        steering, response = by_lag(name, airframe)
        free = replace(steering, max_heading_rate=1e9)
        L, V = steering.standoff, AIRSPEEDS[airframe]

        def command(bar_chi: float, free: Law = free, L: float = L, V: float = V) -> float:
            o = north_of_target(L, bar_chi)
            return fly_at(o._replace(nominal_airspeed=V), free).heading_rate

        gain = (command(-1e-6) - command(1e-6)) / 2e-6
        own_turn = 1.0 / 15.4 if name == "lgvf" else 0.0  # V / R_d: its field's slope is not a gain
        assert gain - own_turn == pytest.approx(1.0 / (1.5 * response.lag), rel=0.02)


def test_the_period_by_lag_is_the_bound_of_px4_with_its_margin() -> None:
    steering, response = by_lag("npfg", "skywalker_x8", damping=0.9)
    assert steering.period == pytest.approx(1.5 * 4.0 * math.pi * response.lag * 0.9, rel=5e-3)
    assert npfg.bounded_period(steering, 0.0, 13.0, 13.0, 6.0, 1.0) == pytest.approx(steering.period, rel=5e-3)


@pytest.mark.parametrize(("name", "parameters"), [("l1", {}), ("npfg", {}), ("orbit_field", {"k_orbit": 10.0})])
def test_on_an_aircraft_in_still_air_it_settles_to_a_micrometre_and_its_command_comes_to_rest(
    name: str, parameters: dict[str, Any]
) -> None:
    steering = law(name, max_heading_rate=math.radians(8.0), **parameters)
    log = simulate(Flight(plant="sixdof", aircraft="skywalker_x8", law=steering, duration=150.0))
    settled, late = log["time"] > 20.0, log["time"] > 120.0
    assert np.abs(log["range_error"][settled]).max() < 1.0
    assert np.abs(log["range_error"][late]).max() < 1e-6
    assert np.degrees(np.abs(np.diff(log["heading_rate_command"][late]))).max() < 1e-7


@pytest.mark.parametrize("name", FIELD_LAWS)
@pytest.mark.parametrize("plant", ["kinematic", "sixdof"])
def test_in_wind_of_60_percent_it_stays_within_half_a_metre(name: str, plant: str) -> None:
    steering = law(name, max_heading_rate=math.radians(15.0), airspeed="ground")
    log = simulate(Flight(plant=plant, law=steering, duration=200.0, wind=Wind(steady=(7.8, 0.0))))
    assert np.abs(log["range_error"][log["time"] > 150.0]).max() < 0.5


@pytest.mark.parametrize("name", FIELD_LAWS)
@pytest.mark.parametrize("plant", ["kinematic", "sixdof"])
def test_behind_a_target_that_outruns_it_the_aircraft_neither_circles_nor_swings(name: str, plant: str) -> None:
    steering = law(name, max_heading_rate=math.radians(8.0), airspeed="ground")
    log = simulate(Flight(plant=plant, law=steering, duration=120.0, target=Target(speed=16.0, heading=math.pi)))
    late = log["time"] > 60.0
    assert abs(np.ptp(np.unwrap(log["heading"][late]))) < math.radians(20.0)
    assert np.degrees(np.abs(np.diff(log["heading_rate_command"][late])).sum()) / 60.0 < 0.05
