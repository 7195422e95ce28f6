"""The 6-DOF plant: its guards, its determinism, and the symmetry of the whole flight."""

import json
import math
from dataclasses import replace
from itertools import count
from pathlib import Path

import numpy as np
import pytest

import aircraft
from autopilot.guidance import Guidance, LawStep, Observation
from autopilot.laws import law
from harness.flight import MetricSettings
from harness.loop import simulate
from harness.plants.model import ModelError, load, write
from harness.plants.plant import End, Outcome, PlantError, Start
from harness.plants.sixdof import SixDof
from harness.world.air import Air
from harness.world.target import Segment, Target
from harness.world.wind import Wind
from tests.builders import FLIGHT, SIXDOF, OwnLaw, command, copied_airframe, turning

STEP = 0.005
STICK = aircraft.folder("ultra_stick_25e")


def test_position_is_the_integral_of_ground_velocity() -> None:
    log = simulate(replace(SIXDOF, wind=Wind(steady=(2.0, -4.0)), guidance_period=0.005))
    for place, speed in (("north", "velocity_north"), ("east", "velocity_east")):
        v = log[speed]
        travelled = 0.005 * (v.sum() - 0.5 * (v[0] + v[-1]))
        assert log[place][-1] - log[place][0] == pytest.approx(travelled, abs=2e-3)


def test_the_wind_a_flight_meets_is_the_one_it_is_given() -> None:
    flying = SixDof(STICK, STEP, True).start(Start(heading=1.0), Air(steady=(3.0, -2.0)))
    flying.advance(0.0, 1.0)
    state = flying.state
    air = (state.velocity_north - 3.0, state.velocity_east + 2.0)
    assert math.hypot(*air) == pytest.approx(state.airspeed, abs=1e-6)
    assert math.atan2(air[1], air[0]) == pytest.approx(1.0, abs=1e-6)


def test_flown_twice_in_two_processes_it_is_the_same_to_the_last_bit(tmp_path: Path) -> None:
    file = tmp_path / "flight.toml"
    file.write_text('[flight]\nplant = "sixdof"\nduration_s = 20.0\n[flight.law]\nname = "smc"\n', encoding="utf-8")
    answers = [json.loads(command("fly", file, "--json").stdout) for _ in range(2)]
    assert answers[0] == answers[1]
    here = simulate(replace(SIXDOF, law=law("smc")))
    assert here.digest == answers[0]["digest"]
    assert simulate(replace(SIXDOF, law=law("smc"))).digest == here.digest


@pytest.mark.parametrize(("plant", "tolerance"), [("kinematic", 1e-9), ("sixdof", 1e-3)])
def test_a_mirrored_flight_mirrors_the_flight(plant: str, tolerance: float) -> None:
    """To rounding on the kinematic plant; in JSBSim rounding grows in the limit cycle, to 1 mm in 30 s."""
    one = replace(
        SIXDOF,
        plant=plant,
        law=law("nftsm", "paper_1"),
        duration=30.0,
        wind=Wind(steady=(1.0, 2.0)),
        target=Target(
            position=(10.0, 20.0), speed=1.0, heading=0.5, segments=(Segment(from_=2.0, to=20.0, turn_rate=0.05),)
        ),
        start=Start(position=(-200.0, 150.0), heading=0.4),
    )
    other = replace(
        one,
        law=law("nftsm", "paper_1", direction="mirrored"),
        wind=Wind(steady=(1.0, -2.0)),
        target=Target(
            position=(10.0, -20.0), speed=1.0, heading=-0.5, segments=(Segment(from_=2.0, to=20.0, turn_rate=-0.05),)
        ),
        start=Start(position=(-200.0, -150.0), heading=-0.4),
    )
    a, b = simulate(one), simulate(other)
    assert b["north"] == pytest.approx(a["north"], abs=tolerance)
    assert b["east"] == pytest.approx(-a["east"], abs=tolerance)
    assert b["range_error"] == pytest.approx(a["range_error"], abs=tolerance)
    if plant == "sixdof":
        assert b["bank"] == pytest.approx(-a["bank"], abs=tolerance)


def test_a_flight_into_the_ground_ends_as_ground() -> None:
    flying = SixDof(STICK, STEP, True).start(Start(altitude=30.0), Air())
    flying.fdm["inner-loop/command/altitude-m"] = -100.0
    with pytest.raises(End) as end:
        for _ in range(2000):
            flying.advance(0.0, 0.05)
    assert end.value.outcome is Outcome.GROUND


def test_a_number_that_is_not_finite_ends_the_flight_as_invalid() -> None:
    flying = SixDof(STICK, STEP, True).start(Start(), Air())
    with pytest.raises(End) as end:
        for _ in range(10):
            flying.advance(math.nan, 0.05)
    assert end.value.outcome is Outcome.INVALID


def test_a_roll_beyond_80_degrees_ends_as_departed() -> None:
    flying = SixDof(STICK, STEP, True).start(Start(), Air())
    flying.fdm["inner-loop/gain/bank-p"] = -0.9  # a bank loop with its sign turned round
    with pytest.raises(End) as end:
        for _ in range(400):
            flying.advance(0.05, 0.05)
    assert end.value.outcome is Outcome.DEPARTED


def test_a_stall_that_lasts_ends_as_departed() -> None:
    flying = SixDof(STICK, STEP, True).start(Start(), Air())
    flying.fdm["inner-loop/limit/angle-of-attack-rad"] = 1.0  # the pitch hold as if there were no stall
    flying.fdm["inner-loop/command/airspeed-mps"] = 5.0
    with pytest.raises(End, match="stalled for 3 s") as end:
        for _ in range(400):
            flying.advance(0.0, 0.05)
    assert end.value.outcome is Outcome.DEPARTED


def faulty(answer: float | None) -> LawStep:
    """A law in flight that is right 20 times, then commands `answer`; None: it raises."""
    calls = count()

    def step(_: Observation) -> Guidance:
        rate = 0.0 if next(calls) < 20 else answer
        if rate is None:
            raise ZeroDivisionError("of its own")
        return turning(rate)

    return step


@pytest.mark.parametrize(
    ("answer", "reason"),
    [(None, "the law raised ZeroDivisionError: of its own"), (math.nan, "the law commanded nan")],
)
def test_a_law_at_fault_ends_as_invalid_with_what_was_flown_until_then(answer: float | None, reason: str) -> None:
    log = simulate(replace(FLIGHT, law=OwnLaw(lambda: faulty(answer))))
    assert (log.outcome, log.reason) == (Outcome.INVALID, reason)
    assert log.outcome.failed
    assert len(log) == 20


def test_a_log_ends_where_the_flight_ended() -> None:
    far = replace(SIXDOF, target=Target(position=(10.0, 900.0)), metrics=MetricSettings(monitoring_range=740.0))
    log = simulate(far)
    assert log.outcome is Outcome.TARGET_LOST
    assert len(log) < far.periods
    assert not np.isnan(log["range_error"]).any()


@pytest.mark.parametrize(
    ("broken", "with_"),
    [
        ("<system file=", "<system file='nowhere' "),
        ("</fdm_config>", ""),
        ("<summer ", "<sumer "),
        ("aero/q-hat </property>", "aero/q-hut </property>"),
    ],
)
def test_a_model_that_jsbsim_cannot_read_whole_is_refused(tmp_path: Path, broken: str, with_: str) -> None:
    airframe = copied_airframe("ultra_stick_25e", tmp_path / "broken")
    text = (airframe / "broken.xml").read_text(encoding="utf-8")
    assert broken in text
    (airframe / "broken.xml").write_text(text.replace(broken, with_, 1), encoding="utf-8")
    with pytest.raises(ModelError, match=r"broken\.xml"):
        SixDof(airframe, STEP, True).start(Start(), Air())


def test_a_property_that_nobody_made_cannot_be_written() -> None:
    with pytest.raises(ModelError, match="no property"):
        write(load(STICK, STEP), "inner-loop/gain/bank-q", 1.0)


def test_a_start_near_the_ground_is_refused() -> None:
    with pytest.raises(PlantError, match="15 m"):
        SixDof(STICK, STEP, True).start(Start(altitude=15.0), Air())


def test_an_airspeed_without_trim_is_refused_with_what_is_allowed() -> None:
    with pytest.raises(PlantError, match=r"no level trim at 7 m/s.* from 11\.5 to 25 m/s"):
        SixDof(STICK, STEP, True).start(Start(airspeed=7.0), Air())


@pytest.mark.parametrize("name", aircraft.names())
def test_a_command_moves_the_surfaces_in_its_own_step_and_the_aircraft_in_the_next(name: str) -> None:
    airspeed = aircraft.limits(aircraft.folder(name)).design_airspeed
    flying = SixDof(aircraft.folder(name), 0.005, True).start(Start(airspeed=airspeed), Air())
    before = flying.state
    flying.advance(math.radians(5.0), 0.005)
    first = flying.state
    flying.advance(math.radians(5.0), 0.005)
    assert abs(first.aileron - before.aileron) > math.radians(0.1)
    assert abs(first.roll_rate - before.roll_rate) < 1e-12
    assert abs(flying.state.roll_rate - before.roll_rate) > 1e-4
