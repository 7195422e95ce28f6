"""What is said of a flight before it is flown."""

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from autopilot.laws import law
from harness.checks import problems
from harness.feasibility import feasibility_line, feasibility_margin, needed_rate, warnings
from harness.flight import Flight
from harness.key import flight_key
from harness.loop import simulate
from harness.plants.kinematic import Kinematic
from harness.plants.plant import Start
from harness.world.air import Air
from harness.world.target import Segment, Target
from harness.world.wind import Gust, Wind

FLIGHT = Flight(plant="kinematic", law=law("smc", max_heading_rate=math.radians(5.0)))


@pytest.mark.parametrize(
    ("wind", "target_speed", "needed_deg_s"), [(0, 0, 3.72), (2, 0, 4.96), (5, 0, 7.14), (0, 7, 8.81), (0, 11, 12.70)]
)
def test_holding_the_circle_takes_the_rate_of_the_formula(
    wind: float, target_speed: float, needed_deg_s: float
) -> None:
    flight = replace(FLIGHT, wind=Wind(steady=(wind, 0.0)), target=Target(speed=target_speed))
    assert math.degrees(needed_rate(flight)) == pytest.approx(needed_deg_s, abs=0.01)
    assert math.degrees(feasibility_margin(flight)) == pytest.approx(5.0 - needed_deg_s, abs=0.01)


def test_a_limited_course_rate_holds_the_circle_where_a_limited_heading_rate_does_not() -> None:
    """On the circle around a target at rest the course turns by v_g / R_d, (v_a + w) / R_d at most: 4.58 deg/s."""
    windy = replace(FLIGHT, wind=Wind(steady=(3.0, 0.0)), duration=300.0)
    for command, limit, needed, held in (
        ("heading_rate", 5.0, 16.0**2 / (13.0 * 200.0), False),
        ("course_rate", 4.7, 16.0 / 200.0, True),
        ("course_rate", 4.4, 16.0 / 200.0, False),
    ):
        steering = law("nftsm", "fitted", max_heading_rate=math.radians(limit), command=command)
        flight = replace(windy, law=steering)
        assert needed_rate(flight) == pytest.approx(needed, rel=1e-9)
        assert (feasibility_margin(flight) > 0) is held
        assert bool(np.abs(simulate(flight)["range_error"][4000:]).max() < 0.1) is held


@pytest.mark.parametrize("target", [(0.0, 0.0), (3.0, 2.0), (-4.0, 1.0)])
def test_the_needed_course_rate_is_the_largest_flown_by_an_unlimited_law(target: tuple[float, float]) -> None:
    speed, heading = math.hypot(*target), math.atan2(target[1], target[0])
    steering = law("nftsm", "fitted", max_heading_rate=math.inf, command="course_rate")
    flown = replace(
        FLIGHT, law=steering, duration=400.0, guidance_period=0.02,
        wind=Wind(steady=(-2.0, 3.0)), target=Target(speed=speed, heading=heading),
    )  # fmt: skip
    log = simulate(flown)
    course = np.unwrap(np.arctan2(log["velocity_east"], log["velocity_north"]))[10000:]
    assert needed_rate(flown) == pytest.approx(np.abs(np.diff(course)).max() / 0.02, rel=1e-3)


def test_the_needed_rate_is_the_largest_on_a_circle_really_flown_round_a_moving_target() -> None:
    """Fly the target-fixed circle point by point in the kinematics and differentiate the heading."""
    wind, speed, v_a, R_d = (0.0, -3.0), 4.0, 13.0, 200.0
    w = (wind[0] - speed, wind[1])
    angles = [k * math.tau / 200000 for k in range(200001)]
    headings, rates = [], []
    for theta in angles:  # relative to the target: air velocity + w must lie along the tangent
        tangent = (math.sin(theta), -math.cos(theta))
        across = w[0] * math.cos(theta) + w[1] * math.sin(theta)
        headings.append(math.atan2(tangent[1], tangent[0]) - math.asin(across / v_a))
        along = w[0] * tangent[0] + w[1] * tangent[1]
        rates.append((math.sqrt(v_a**2 - across**2) + along) / R_d)  # of the azimuth
    d = [math.remainder(b - a, math.tau) / (angles[1] - angles[0]) for a, b in pairwise(headings)]
    flown = max(abs(slope * rate) for slope, rate in zip(d, rates, strict=False))
    flight = replace(FLIGHT, wind=Wind(steady=wind), target=Target(speed=speed))
    assert needed_rate(flight) == pytest.approx(flown, rel=1e-3)


def test_a_target_that_speeds_up_counts_at_its_fastest() -> None:
    fast = Target(speed=0.0, segments=(Segment(from_=10.0, to=20.0, acceleration=0.5),))
    assert feasibility_margin(replace(FLIGHT, target=fast)) == feasibility_margin(
        replace(FLIGHT, target=Target(speed=5.0))
    )


@pytest.mark.parametrize("command", ["heading_rate", "course_rate"])
@pytest.mark.parametrize("limit", [45.0, math.inf])
@pytest.mark.parametrize(
    ("wind", "target", "held"),
    [
        ((0.0, 0.0), Target(speed=12.9), True),
        ((0.0, 0.0), Target(speed=13.0, heading=0.7), False),
        ((0.0, 0.0), Target(speed=30.0), False),
        ((-5.0, 0.0), Target(speed=8.0), False),
        ((5.0, 0.0), Target(speed=17.0), True),  # the air takes the aircraft along
        ((0.0, 0.0), Target(segments=(Segment(from_=10.0, to=40.0, acceleration=0.5),)), False),
    ],
)
def test_a_target_as_fast_against_the_air_as_the_aircraft_is_circled_at_no_heading_rate(
    command: Literal["heading_rate", "course_rate"],
    limit: float,
    wind: tuple[float, float],
    target: Target,
    held: bool,
) -> None:
    steering = law("nftsm", max_heading_rate=math.radians(limit), command=command)
    flight = replace(FLIGHT, law=steering, wind=Wind(steady=wind), target=target)
    assert (feasibility_margin(flight) == -math.inf) is not held
    assert ("cannot be held at any heading rate" in feasibility_line(flight)) is not held
    assert ("cannot be held at any heading rate" in " ".join(warnings(flight))) is not held


@pytest.mark.parametrize(
    ("velocity", "warned"),
    [((12.9, 0.0, 0.0), False), ((13.1, 0.0, 0.0), True), ((0.0, -6.6, 0.0), False), ((0.0, 0.0, -13.0), True)],
)
def test_gusts_as_fast_as_the_aircraft_are_a_warning(velocity: tuple[float, float, float], warned: bool) -> None:
    gusty = replace(FLIGHT, wind=Wind(gusts=(Gust(from_=10.0, to=20.0, velocity=velocity),)))
    assert any("wind and gusts reach 13" in text for text in warnings(gusty)) is warned
    late = replace(gusty, duration=10.0)
    assert not any("gusts" in text for text in warnings(late))
    twice = replace(gusty, wind=Wind(steady=(0.0, -1.0), gusts=gusty.wind.gusts * 2))
    assert any("wind and gusts reach" in text for text in warnings(twice))


def test_impossible_settings_are_named() -> None:
    wrong = replace(
        FLIGHT,
        guidance_period=0.052,
        wind=Wind(steady=(12.0, 5.0)),
        aircraft="ultrastick",
        target=Target(speed=1.0, segments=(Segment(from_=3.0, to=2.0), Segment(from_=5.0, to=9.0, acceleration=-1.0))),
    )
    assert [p.name for p in problems(wrong)] == [
        "guidance_period", "wind.steady", "target.segments.0.to", "target.segments", "aircraft",
    ]  # fmt: skip
    assert "did you mean 'ultra_stick_25e'" in problems(wrong)[-1].message


def test_a_folder_that_is_no_airframe_is_told_what_it_must_hold(tmp_path: Path) -> None:
    (problem,) = problems(replace(FLIGHT, aircraft=str(tmp_path)))
    told = f"{tmp_path}: the folder must hold airframe.toml and a JSBSim model, {tmp_path.name}.xml"
    assert problem.message == told


def test_remark_1_and_an_infeasible_circle_are_warnings() -> None:
    said = " ".join(warnings(replace(FLIGHT, wind=Wind(steady=(8.0, 0.0)), target=Target(speed=6.0, heading=2.0))))
    assert "Remark 1" in said
    assert "infeasible" in said
    assert warnings(FLIGHT) == []


def test_more_heading_rate_than_the_bank_limit_gives_is_a_warning() -> None:
    steep = replace(FLIGHT, plant="sixdof", law=law("smc", max_heading_rate=math.radians(60.0)))
    assert ["inner loop" in text for text in warnings(steep)] == [True]


def test_an_airspeed_outside_the_envelope_is_a_warning() -> None:
    slow = replace(FLIGHT, plant="sixdof", aircraft="aerosonde")
    assert ["18 to 35 m/s" in text for text in warnings(slow)] == [True]


@pytest.mark.parametrize("changed", ["PHYSICS_VERSION", "METRICS_VERSION"])
def test_other_physics_or_metrics_give_another_key(monkeypatch: pytest.MonkeyPatch, changed: str) -> None:
    before = flight_key(FLIGHT)
    monkeypatch.setattr(f"harness.key.{changed}", 0)
    assert flight_key(FLIGHT) != before


def test_a_kinematic_start_needs_no_height() -> None:
    assert Kinematic().start(Start(altitude=0.0), Air()).state.altitude == 0.0
