"""Feasibility in flight: the margin at each moment, what is told of it, and a target that overtakes the aircraft."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from autopilot.laws import LAWS, law
from harness.feasibility import feasibility_margin
from harness.loop import simulate
from harness.plants.plant import Outcome
from harness.review.lanes import events
from harness.world.target import Segment, Target
from harness.world.wind import Gust, Wind
from tests.builders import FLIGHT, invoke, write

LIMIT = math.radians(10.0)
Limited = Literal["heading_rate", "course_rate"]


@pytest.mark.parametrize("command", ["heading_rate", "course_rate"])
def test_in_steady_wind_the_margin_in_flight_is_the_one_before_it(command: Limited) -> None:
    steering = law("nftsm", max_heading_rate=LIMIT, command=command)
    flight = replace(FLIGHT, law=steering, wind=Wind(steady=(3.0, -2.0)), target=Target(speed=2.0), duration=5.0)
    assert set(simulate(flight)["feasibility_margin"]) == {feasibility_margin(flight)}


def test_the_margin_in_flight_follows_the_gust_and_the_target() -> None:
    """(v_a + w)^2 / (v_a R_d) with w = |air - target|, at every row."""
    gusty = Wind(steady=(1.0, 0.0), gusts=(Gust(from_=1.0, to=4.0, velocity=(0.0, 6.0, 0.0)),))
    target = Target(segments=(Segment(from_=2.0, to=5.0, acceleration=1.0),))
    log = simulate(replace(FLIGHT, law=law("smc", max_heading_rate=LIMIT), wind=gusty, target=target, duration=6.0))
    w = np.hypot(log["wind_north"] - log["target_velocity_north"], log["wind_east"] - log["target_velocity_east"])
    assert np.ptp(w) > 4.0
    assert log["feasibility_margin"] == pytest.approx(LIMIT - (13.0 + w) ** 2 / (13.0 * 200.0))


def overtaking(heading: float, speed: float = 16.0) -> Target:
    """A target at rest that is as fast as `speed`, m/s, from 44 s to 64 s, and stands still again from 68 s on."""
    a = speed / 4.0
    faster, slower = (Segment(from_=t, to=t + 4.0, acceleration=by) for t, by in ((40.0, a), (64.0, -a)))
    return Target(position=(10.0, 10.0), heading=heading, segments=(faster, slower))


def test_where_the_target_outruns_the_aircraft_the_margin_is_minus_infinity_and_the_events_say_so() -> None:
    log = simulate(replace(FLIGHT, law=law("nftsm", max_heading_rate=LIMIT), target=overtaking(0.0), duration=120.0))
    outrun = log["target_velocity_north"] >= 13.0
    assert np.array_equal(np.isneginf(log["feasibility_margin"]), outrun)
    lost = log["feasibility_margin"] < 0.0
    assert log.metrics["infeasible_s"] == pytest.approx(0.05 * lost.sum())
    told = [(event.time, event.level, event.text) for event in events(log, {}) if "held" in event.text]
    first, last = (float(log["time"][np.flatnonzero(lost)[i]]) for i in (0, -1))
    assert [time for time, _, _ in told] == pytest.approx([first, last + 0.05])
    assert told[0][1:] == ("WARN", "the circle cannot be held: the command's limit is 0.092 deg/s too small")
    assert told[1][1:] == ("INFO", "the circle can be held again")


def test_a_flight_says_for_how_long_its_circle_could_not_be_held(tmp_path: Path) -> None:
    segments = "[{ from_s = 1.0, to_s = 3.0, acceleration_mps2 = 8.0 }]"
    text = f'[flight]\nplant = "kinematic"\nduration_s = 5.0\nlaw.name = "smc"\ntarget.segments = {segments}\n'
    told = invoke("fly", write(tmp_path / "a.toml", text)).stdout
    assert "For 3.7 s the circle was infeasible: wind and target required more than the command limit." in told
    calm = invoke("fly", write(tmp_path / "b.toml", text.replace("8.0", "0.1"))).stdout
    assert "the circle was infeasible" not in calm


@pytest.mark.parametrize("name", LAWS)
def test_a_law_that_is_overtaken_neither_winds_up_nor_spins_and_comes_back(name: str) -> None:
    """Through all that its target does the aircraft stays within one turn of headings.

    The paper's SMC alone is late: it nears its manifold at c3 = 0.3 deg/s, from which it may be 90 deg away.
    """
    steering = law(name, max_heading_rate=LIMIT)
    for k in range(8):
        log = simulate(replace(FLIGHT, law=steering, target=overtaking(k * math.tau / 8.0), duration=200.0))
        assert log.outcome is Outcome.COMPLETED
        assert np.abs(log["heading_rate_command"]).max() <= LIMIT
        chase = slice(800, 1800)
        assert np.ptp(np.unwrap(log["heading"][chase])) < math.tau
        back = np.abs(log["range_error"][-200:]).max()
        assert back < 1.0 or name == "smc"


@pytest.mark.parametrize("name", [name for name in LAWS if name != "smc"])
def test_on_6_dof_a_law_comes_back_as_well_to_a_target_that_overtook_it(name: str) -> None:
    flight = replace(FLIGHT, plant="sixdof", law=law(name, max_heading_rate=LIMIT), target=overtaking(0.0))
    log = simulate(replace(flight, duration=180.0))
    assert np.abs(log["heading_rate_command"]).max() <= LIMIT
    assert np.ptp(np.unwrap(log["heading"][800:1800])) < math.tau
    assert np.abs(log["range_error"][-200:]).max() < 1.0


def test_round_a_target_that_outruns_a_law_without_a_limit_the_margin_is_minus_infinity() -> None:
    flight = replace(FLIGHT, law=law("nftsm", max_heading_rate=math.inf), target=Target(speed=13.5), duration=1.0)
    assert (simulate(flight)["feasibility_margin"] == -math.inf).all()
