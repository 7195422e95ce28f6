"""The laws against what they are derived from: their own differential equations, symmetries, and limits."""

import math
from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autopilot import nftsm
from autopilot.angles import wrap
from autopilot.guidance import UNKNOWN, Context, Guidance, Law, Observation
from autopilot.laws import LAWS, law
from autopilot.response import plain
from autopilot.standoff import AIRSPEEDS, course_rate_ratio, ground_speed, heading_from_course, relative_motion

V_A, R_D = 13.0, 200.0
WIND = (0.1, 2.0)
TARGET = {"speed": 3.0, "heading": 0.8, "acceleration": 0.05, "turn_rate": 0.07}


def moment(t: float, psi: float = 0.4, turn: float = 0.0) -> Observation:
    """An aircraft on an exact arc of rate `turn` and a target accelerating and turning, at time t."""
    h = 0.5 * turn * t
    chord = V_A * t * (math.sin(h) / h if h else 1.0)
    v_t, psi_t = TARGET["speed"] + TARGET["acceleration"] * t, TARGET["heading"] + TARGET["turn_rate"] * t
    a, w = TARGET["acceleration"], TARGET["turn_rate"]
    v0, psi0 = TARGET["speed"], TARGET["heading"]
    x_t = (v_t * math.sin(psi_t) - v0 * math.sin(psi0)) / w + a * (math.cos(psi_t) - math.cos(psi0)) / w**2
    y_t = (v0 * math.cos(psi0) - v_t * math.cos(psi_t)) / w + a * (math.sin(psi_t) - math.sin(psi0)) / w**2
    heading = psi + turn * t
    v_n, v_e = V_A * math.cos(heading) + WIND[0], V_A * math.sin(heading) + WIND[1]
    return Observation(
        north=-150.0 + chord * math.cos(psi + h) + WIND[0] * t,
        east=180.0 + chord * math.sin(psi + h) + WIND[1] * t,
        velocity_north=v_n,
        velocity_east=v_e,
        airspeed=V_A,
        nominal_airspeed=V_A,
        heading=heading,
        heading_rate=turn,
        bank=0.0,
        roll_rate=0.0,
        wind_north=WIND[0],
        wind_east=WIND[1],
        target_north=x_t,
        target_east=y_t,
        target_velocity_north=v_t * math.cos(psi_t),
        target_velocity_east=v_t * math.sin(psi_t),
        target_acceleration=a,
        target_turn_rate=w,
    )


def sig(x: float, power: float) -> float:
    """The signed power of the paper, after Eq. (11)."""
    return math.copysign(abs(x) ** power, x)


def rate(f: Callable[[float], float], dt: float = 1e-4) -> float:
    return (f(dt) - f(-dt)) / (2.0 * dt)


def fly_at(o: Observation, steering: Law) -> Guidance:
    return steering.start(UNKNOWN)(o)


def test_range_and_azimuth_rates_are_the_derivatives_along_the_motion() -> None:
    def geometry(t: float) -> tuple[float, float]:
        o = moment(t)
        x, y = o.north - o.target_north, o.east - o.target_east
        return math.hypot(x, y) - R_D, math.atan2(y, x)

    r, r_dot, lam_dot, _, _ = relative_motion(moment(0.0), R_D, V_A, moment(0.0).heading)
    assert r == pytest.approx(geometry(0.0)[0])
    assert r_dot == pytest.approx(rate(lambda t: geometry(t)[0]), rel=1e-7)
    assert lam_dot == pytest.approx(rate(lambda t: geometry(t)[1]), rel=1e-7)


def test_the_desired_heading_moves_as_eq_20_says_once_wind_and_target_turn_are_in_it() -> None:
    def desired(t: float) -> float:  # psi_a^d = lam + bar psi_a^d = psi_a - error
        o = moment(t)
        return o.heading - relative_motion(o, R_D, V_A, o.heading)[3]

    _, _, lam_dot, _, psi_a_d_dot = relative_motion(moment(0.0), R_D, V_A, moment(0.0).heading)
    assert lam_dot + psi_a_d_dot == pytest.approx(rate(desired), rel=1e-7)


def test_the_distance_is_steady_at_the_desired_heading() -> None:
    o = moment(0.0)
    error = relative_motion(o, R_D, V_A, o.heading)[3]
    assert relative_motion(o, R_D, V_A, o.heading - error)[1] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("gains", ["paper", "paper_1"])
@pytest.mark.parametrize("psi", [-2.0, 0.4, 2.9])
def test_nftsm_unlimited_makes_s_follow_its_reaching_law(gains: str, psi: float) -> None:
    steering = law("nftsm", gains, max_heading_rate=1e9)
    assert isinstance(steering, nftsm.Nftsm)
    now = fly_at(moment(0.0, psi), steering)
    turn = now.heading_rate
    s_dot = rate(lambda t: fly_at(moment(t, psi, turn), steering).sliding_variable, 1e-6)
    s = now.sliding_variable
    assert s_dot == pytest.approx(-steering.k2 * s - steering.k3 * sig(s, steering.gamma1), rel=1e-5)  # Eq. (18)


def test_smc_unlimited_makes_s_follow_its_reaching_law() -> None:
    steering = law("smc", "paper", max_heading_rate=1e9)
    now = fly_at(moment(0.0), steering)
    s_dot = rate(lambda t: fly_at(moment(t, turn=now.heading_rate), steering).sliding_variable, 1e-5)
    s = now.sliding_variable
    assert s_dot == pytest.approx(-0.005 * max(-1.0, min(1.0, s / 0.2)), rel=1e-5)


def manifold(ell: float, beta3: float, eta: float, **gains: float) -> tuple[float, float]:
    """f(ell) of Section 3.3 and its slope, as the law has them: s and the command on the circle's tangent."""
    g = law("nftsm", "paper_1", beta3=beta3, eta=eta, **gains)
    assert isinstance(g, nftsm.Nftsm)
    _, rest, f = nftsm.reaching(g)((math.tan(ell) / g.k1, 1.0, 0.0, 0.0, 0.0))
    return f, -(rest + g.k2 * f + g.k3 * sig(f, g.gamma1)) / (g.k1 * math.cos(ell) ** 2)


@pytest.mark.parametrize(
    ("ell", "f"),
    [
        (1.0, 0.6 + 0.8),  # where every power is one
        (0.25, 0.6 * 0.25**2 + 0.8 * 0.5),
        (0.02, 0.6 * 0.02**2 + 0.8 * 0.125),  # within eta: 7.5 ell - 62.5 ell^2 in place of the root
    ],
)
def test_the_manifold_has_the_values_of_eq_17_and_is_odd(ell: float, f: float) -> None:
    values = [manifold(x, 0.5, 0.04, alpha2=0.6, beta2=2.0, alpha3=0.8)[0] for x in (ell, -ell)]
    assert values == pytest.approx([f, -f], rel=1e-12)


@given(beta3=st.floats(0.1, 0.9), eta=st.floats(1e-4, 0.1))
def test_the_manifold_and_its_slope_are_continuous_at_eta(beta3: float, eta: float) -> None:
    inside, outside = manifold(eta * (1 - 1e-9), beta3, eta), manifold(eta * (1 + 1e-9), beta3, eta)
    assert inside == pytest.approx(outside, rel=1e-6)


@given(x=st.floats(-0.2, 0.2).filter(lambda x: abs(x) > 1e-3))
def test_the_slope_of_the_manifold_is_its_derivative_on_both_sides_of_zero_and_of_eta(x: float) -> None:
    h = 1e-6 * abs(x)
    numeric = (manifold(x + h, 0.6, 0.05)[0] - manifold(x - h, 0.6, 0.05)[0]) / (2 * h)
    assert manifold(x, 0.6, 0.05)[1] == pytest.approx(numeric, rel=1e-4)


FLYABLE = st.floats(-1e5, 1e5)
OBSERVATIONS = st.builds(Observation, **dict.fromkeys(Observation._fields, FLYABLE))
ANY_LAW = st.sampled_from([(name, gains) for name, kind in LAWS.items() for gains in kind.gain_sets])
COMMANDS = ("heading_rate", "course_rate")


@settings(max_examples=400)
@given(ANY_LAW, st.sampled_from(sorted(AIRSPEEDS)), st.sampled_from(COMMANDS), OBSERVATIONS, st.booleans())
def test_every_answer_is_finite_for_every_finite_observation(
    which: tuple[str, str], airspeed: str, command: str, o: Observation, at_the_target: bool
) -> None:
    name, gains = which
    steering = law(name, gains, airspeed=airspeed, command=command)
    o = o._replace(airspeed=abs(o.airspeed), nominal_airspeed=13.0)
    if at_the_target:
        o = o._replace(target_north=o.north, target_east=o.east)
    answer = fly_at(o, steering)
    assert all(math.isfinite(number) for number in answer)
    if command == "heading_rate":
        assert abs(answer.heading_rate) <= steering.max_heading_rate


@pytest.mark.parametrize("speed", [0.0, 5e-324, 3e-306, 1e-12])
@pytest.mark.parametrize("name", sorted(LAWS))
def test_a_target_that_speeds_up_from_rest_leaves_every_answer_finite(name: str, speed: float) -> None:
    o = moment(0.0)._replace(target_velocity_north=0.0, target_velocity_east=speed, target_acceleration=1e3)
    step = law(name).start(Context(0.05, V_A, response=plain(0.1, 5.0, 0.7)))
    assert all(math.isfinite(number) for _ in range(3) for number in step(o))


@pytest.mark.parametrize("drift", [0.0, 5e-324, 2e-5, 1e-3])
@pytest.mark.parametrize("wind", [1e-3, 13.0, 1440.0])
def test_an_aircraft_that_the_wind_holds_in_place_is_answered(wind: float, drift: float) -> None:
    steering = law("nftsm", airspeed="ground", command="course_rate")
    o = moment(0.0)._replace(wind_north=0.0, wind_east=-wind, velocity_north=0.0, velocity_east=drift)
    answer = fly_at(o, steering)
    assert all(math.isfinite(number) for number in answer)


@pytest.mark.parametrize("direction", ["paper", "mirrored"])
def test_ground_takes_the_airspeed_from_ground_velocity_and_estimated_wind(direction: str) -> None:
    o = moment(0.0)._replace(velocity_north=9.0, velocity_east=-2.0, wind_north=3.0, wind_east=6.0)
    by_ground = law("nftsm", airspeed="ground", direction=direction)
    told = law("nftsm", direction=direction, airspeed="nominal")
    assert fly_at(o, by_ground) == fly_at(o._replace(nominal_airspeed=10.0), told) != fly_at(o, told)


@settings(max_examples=100)
@given(v=st.tuples(*[st.floats(-30.0, 30.0)] * 4))
def test_with_ground_the_range_rate_is_that_of_the_ground_velocity_however_wrong_the_wind(
    v: tuple[float, float, float, float],
) -> None:
    v_n, v_e, wind_n, wind_e = v
    o = moment(0.0)._replace(velocity_north=v_n, velocity_east=v_e, wind_north=wind_n, wind_east=wind_e)
    psi_a = math.atan2(v_e - wind_e, v_n - wind_n)
    x, y = o.north - o.target_north, o.east - o.target_east
    away = (v_n - o.target_velocity_north) * x + (v_e - o.target_velocity_east) * y
    assert relative_motion(o, R_D, AIRSPEEDS["ground"](o), psi_a)[1] == pytest.approx(
        away / math.hypot(x, y), abs=2e-3 if math.hypot(v_n - wind_n, v_e - wind_e) < 2e-3 else 1e-9
    )


def test_the_singular_paper_set_is_finite_exactly_on_the_circle() -> None:
    o = moment(0.0)._replace(target_north=0.0, target_east=0.0, north=R_D, east=0.0)
    assert math.isfinite(fly_at(o, law("nftsm", "paper")).unlimited_command)


@pytest.mark.parametrize("name", list(LAWS))
def test_the_largest_floats_still_give_a_limited_command(name: str) -> None:
    o = moment(0.0)._replace(north=1.7e308, target_north=-1.7e308, target_velocity_east=1.7e308)
    assert abs(fly_at(o, law(name)).heading_rate) <= math.radians(5.0)


def mirrored(o: Observation) -> Observation:
    flip = ("east", "velocity_east", "heading", "heading_rate", "bank", "roll_rate", "wind_east", "target_east")
    more = ("target_velocity_east", "target_turn_rate")
    return o._replace(**{name: -getattr(o, name) for name in flip + more})


@pytest.mark.parametrize("name", list(LAWS))
def test_the_mirrored_law_in_the_mirrored_world_commands_the_mirrored_rate(name: str) -> None:
    paper = fly_at(moment(0.0), law(name, max_heading_rate=1e9))
    other = fly_at(mirrored(moment(0.0)), law(name, max_heading_rate=1e9, direction="mirrored"))
    assert other.heading_rate == -paper.heading_rate
    assert other.range_error == paper.range_error
    assert other.sliding_variable == -paper.sliding_variable


def test_the_course_rate_law_knows_the_same_without_air_data() -> None:
    o = moment(0.0)
    by_heading = fly_at(o, law("nftsm", "paper_1", max_heading_rate=1e9))
    by_course = fly_at(o, law("nftsm", "paper_1", max_heading_rate=1e9, command="course_rate"))
    assert by_course.heading_rate == pytest.approx(by_heading.heading_rate, rel=1e-9)


def test_the_course_rate_limit_holds_for_the_course() -> None:
    o = moment(0.0)
    answer = fly_at(o, law("nftsm", "paper_1", command="course_rate"))
    ratio = course_rate_ratio(V_A, o.heading, *WIND)
    assert abs(answer.unlimited_command) > 1.0
    assert abs(answer.heading_rate * ratio) == pytest.approx(math.radians(5.0))


@given(psi=st.floats(-math.pi, math.pi), wind=st.floats(0.0, 12.9), towards=st.floats(-math.pi, math.pi))
def test_ground_speed_and_course_rate_ratio_are_those_of_the_wind_triangle(
    psi: float, wind: float, towards: float
) -> None:
    W_x, W_y = wind * math.cos(towards), wind * math.sin(towards)
    v_n, v_e = V_A * math.cos(psi) + W_x, V_A * math.sin(psi) + W_y
    chi = math.atan2(v_e, v_n)
    assert ground_speed(V_A, chi, W_x, W_y) == pytest.approx(math.hypot(v_n, v_e), abs=1e-6)
    assert wrap(heading_from_course(V_A, chi, W_x, W_y) - psi) == pytest.approx(0.0, abs=1e-6)
    chi_dot = (v_n * V_A * math.cos(psi) + v_e * V_A * math.sin(psi)) / (v_n**2 + v_e**2)  # for a heading rate of 1
    assert course_rate_ratio(V_A, psi, W_x, W_y) == pytest.approx(chi_dot, rel=1e-6)


def test_the_course_rate_ratio_exceeds_one_in_a_headwind() -> None:
    assert course_rate_ratio(13.0, 0.0, -5.0, 0.0) == pytest.approx(1.625)  # the paper says (1/2, 1]


def test_measured_airspeed_is_what_the_law_then_computes_with() -> None:
    o = moment(0.0)._replace(airspeed=12.0)
    slow = o._replace(nominal_airspeed=12.0)
    measured = fly_at(o, law("nftsm", "paper_1", airspeed="measured", max_heading_rate=1e9))
    nominal = fly_at(slow, law("nftsm", "paper_1", airspeed="nominal", max_heading_rate=1e9))
    assert measured == nominal


def test_gain_sets_say_which_of_the_papers_conditions_they_break() -> None:
    assert ["Definition 5" in text for text in law("nftsm", "paper").broken_conditions(0.0)] == [True]
    broken = law("nftsm", "paper_1").broken_conditions(0.0)
    assert [("Eq. (28)" in text, "Eq. (30)" in text) for text in broken] == [(True, False), (False, True)]
    assert law("smc").broken_conditions(0.0) == []
    assert law("nftsm", "paper", beta2=1.0).broken_conditions(0.0) == []


@given(st.floats(-1e6, 1e6))
def test_wrapping_keeps_the_direction_and_lands_in_range(angle: float) -> None:
    wrapped = wrap(angle)
    assert -math.pi <= wrapped < math.pi
    assert math.cos(wrapped - angle) == pytest.approx(1.0, abs=1e-9)
