"""The target's motion against integration, and its seams."""

import math

import numpy as np
import pytest

from harness.world.target import Segment, Target

SECTION_4_3 = Target(
    speed=2.0,
    heading=math.radians(-45.0),
    segments=(
        Segment(from_=300.0, to=350.0, acceleration=0.1),
        Segment(from_=400.0, to=410.0, turn_rate=math.radians(-10.0)),
        Segment(from_=460.0, to=470.0, acceleration=0.4, turn_rate=math.radians(3.0)),
        Segment(from_=550.0, to=570.0, turn_rate=math.radians(1.0)),
    ),
)


def test_the_manoeuvring_target_of_section_4_3_reaches_its_speeds_and_headings() -> None:
    at = SECTION_4_3.start()
    for time, speed, heading in (
        (299.0, 2, -45),
        (355.0, 7, -45),
        (420.0, 7, -145),
        (480.0, 11, -115),
        (900.0, 11, -95),
    ):
        seen = at(time)
        velocity = (seen.target_velocity_north, seen.target_velocity_east)
        expected = (speed * math.cos(math.radians(heading)), speed * math.sin(math.radians(heading)))
        assert velocity == pytest.approx(expected, abs=1e-9)


def test_position_is_the_integral_of_velocity() -> None:
    at = SECTION_4_3.start()
    dt = 0.01
    middles = [at(dt * (k + 0.5)) for k in range(60000)]  # midpoint rule over 600 s, all manoeuvres
    north = 10.0 + dt * np.sum([m.target_velocity_north for m in middles])
    east = 10.0 + dt * np.sum([m.target_velocity_east for m in middles])
    assert (at(600.0).target_north, at(600.0).target_east) == pytest.approx((north, east), abs=1e-3)


def test_overlapping_segments_add_up() -> None:
    parts = (Segment(from_=1.0, to=5.0, acceleration=0.2), Segment(from_=3.0, to=7.0, acceleration=0.3, turn_rate=0.1))
    legs = Target(segments=parts).legs()
    assert [leg.begin for leg in legs] == [0.0, 1.0, 3.0, 5.0, 7.0]
    assert [leg.acceleration for leg in legs] == pytest.approx([0.0, 0.2, 0.5, 0.3, 0.0])
    assert [leg.turn_rate for leg in legs] == pytest.approx([0.0, 0.0, 0.1, 0.1, 0.0])


def test_a_hardly_turning_target_goes_as_a_straight_one() -> None:
    straight = Target(speed=5.0, heading=0.7, segments=(Segment(from_=0.0, to=100.0, acceleration=0.1),)).start()
    turning = Target(
        speed=5.0, heading=0.7, segments=(Segment(from_=0.0, to=100.0, acceleration=0.1, turn_rate=1e-9),)
    ).start()
    assert turning(90.0)[:2] == pytest.approx(straight(90.0)[:2], abs=1e-4)
