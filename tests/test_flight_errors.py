"""The errors of a flight: each does what it says, and nothing else."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

import aircraft
from autopilot.guidance import Context, Guidance, LawStep, Observation
from autopilot.laws import law
from harness.flight import Flight
from harness.flight_errors import Errors
from harness.log import FlightLog
from harness.loop import simulate
from harness.plants.identified import identified
from harness.plants.ladder import PLANTS
from harness.settings import SettingsError, flight_from_document
from harness.world.wind import Wind
from tests.builders import FLIGHT, OwnLaw, turning

STICK = aircraft.folder("ultra_stick_25e")
PERIOD = FLIGHT.guidance_period


def observed(flight: Flight, rates: Sequence[float] = ()) -> tuple[FlightLog, list[Observation]]:
    """The flight under these commands, rad/s, then none; and what its law saw."""
    seen: list[Observation] = []

    def step(observation: Observation) -> Guidance:
        seen.append(observation)
        return turning(rates[len(seen) - 1] if len(seen) <= len(rates) else 0.0)

    return simulate(replace(flight, law=OwnLaw(lambda: step))), seen


@pytest.mark.parametrize("steady", [(0.0, 0.0), (3.0, -2.0)])
def test_the_law_sees_the_steady_wind_plus_the_error_and_its_heading_in_that_wind(steady: tuple[float, float]) -> None:
    errors = Errors(wind=1.5, wind_heading=math.radians(30.0))
    log, seen = observed(replace(FLIGHT, wind=Wind(steady=steady), errors=errors, duration=2.0), [0.1] * 40)
    right, _ = observed(replace(FLIGHT, wind=Wind(steady=steady), duration=2.0), [0.1] * 40)
    assert log.digest == right.digest  # the aircraft flies in the true wind
    for o, v_x, v_y in zip(seen, log["velocity_north"], log["velocity_east"], strict=True):
        error = o.wind_north - steady[0], o.wind_east - steady[1]
        assert error == pytest.approx((1.5 * math.cos(math.pi / 6.0), 0.75), abs=1e-12)
        assert (o.velocity_north, o.velocity_east) == (v_x, v_y)
        assert o.heading == math.atan2(v_y - o.wind_east, v_x - o.wind_north)


def test_course_noise_turns_the_ground_velocity_and_the_heading_alike_and_keeps_the_speed() -> None:
    errors = Errors(course_noise=math.radians(2.0))
    flight = replace(FLIGHT, wind=Wind(steady=(3.0, -2.0)), errors=errors, duration=50.0)
    log, seen = observed(flight)
    course = np.arctan2(log["velocity_east"], log["velocity_north"])
    turned = np.array([math.atan2(o.velocity_east, o.velocity_north) for o in seen]) - course
    assert np.std(turned) == pytest.approx(math.radians(2.0), rel=0.05)
    assert abs(np.mean(turned)) < math.radians(0.2)
    assert abs(np.corrcoef(turned[1:], turned[:-1])[0, 1]) < 0.1  # white
    speeds = [math.hypot(o.velocity_north, o.velocity_east) for o in seen]
    assert speeds == pytest.approx(np.hypot(log["velocity_north"], log["velocity_east"]))
    assert all(o.heading == math.atan2(o.velocity_east + 2.0, o.velocity_north - 3.0) for o in seen)


def test_the_noise_of_the_course_depends_on_the_seed_and_the_guidance_step_alone() -> None:
    noisy = replace(FLIGHT, errors=Errors(course_noise=0.01), duration=2.0, seed=4)
    turned = {}
    for name, flight in {
        "kinematic": noisy,
        "again": replace(noisy, errors=replace(noisy.errors, wind=1.0, command_delay=0.1)),
        "sixdof": replace(noisy, plant="sixdof"),
        "another seed": replace(noisy, seed=5),
    }.items():
        log, seen = observed(flight)
        course = np.arctan2(log["velocity_east"], log["velocity_north"])
        turned[name] = np.array([math.atan2(o.velocity_east, o.velocity_north) for o in seen]) - course
    for name in ("again", "sixdof"):
        assert turned[name] == pytest.approx(turned["kinematic"], abs=1e-12)
    assert np.abs(turned["another seed"] - turned["kinematic"]).max() > 0.01


def test_the_measured_airspeed_is_the_true_one_times_its_scale() -> None:
    flight = replace(FLIGHT, plant="coordinated", errors=Errors(airspeed_scale=1.1), duration=2.0)
    log, seen = observed(flight, [0.2] * 40)
    assert [o.airspeed for o in seen] == (1.1 * log["airspeed"]).tolist()
    assert {o.nominal_airspeed for o in seen} == {13.0}


@pytest.mark.parametrize("plant", PLANTS)
def test_a_delay_of_two_periods_moves_the_flight_by_two_periods(plant: str) -> None:
    rates = [0.05, -0.1, 0.15, 0.2]
    flight = replace(FLIGHT, plant=plant, duration=2.0, errors=Errors(command_delay=2 * PERIOD))
    late, _ = observed(flight, rates)
    early, _ = observed(replace(flight, errors=Errors()), [0.0, 0.0, *rates])
    for column in ("north", "east", "heading", "heading_rate"):
        assert np.array_equal(late[column], early[column]), column
    assert late["heading_rate_command"][:4].tolist() == rates  # the log has what the law commands, when it does


def test_a_delay_may_be_finer_than_a_period() -> None:
    """A third of each command's effect falls into the next period."""
    flight = replace(FLIGHT, duration=1.0, errors=Errors(command_delay=PERIOD + 0.02))
    log, _ = observed(flight, [0.3])
    turned = np.diff(log["heading"])[:4] / PERIOD
    assert turned == pytest.approx([0.0, 0.3 * 0.6, 0.3 * 0.4, 0.0], abs=1e-12)


@dataclass(frozen=True)
class Knowing(OwnLaw):
    """A law that computes with the identified response."""

    uses_response: bool = True
    told: list[Context] = field(default_factory=list, hash=False)

    def start(self, context: Context) -> LawStep:
        self.told.append(context)
        return super().start(context)


def test_a_law_is_told_a_response_quicker_than_the_identified_one() -> None:
    knowing = Knowing(lambda: lambda o: turning(0.0))
    simulate(replace(FLIGHT, law=knowing, duration=0.1, errors=Errors(response_speed=2.0)))
    response = knowing.told[0].response
    assert response == identified(STICK, 13.0).heading_rate.quicker(2.0)


@pytest.mark.parametrize(
    ("errors", "message"),
    [
        ({"wind_mps": -1.0}, "flight.errors.wind_mps"),
        ({"course_noise_deg": 181.0}, "flight.errors.course_noise_deg"),
        ({"airspeed_scale": 0.0}, "flight.errors.airspeed_scale"),
        ({"response_speed": 0.0}, "flight.errors.response_speed"),
        ({"command_delay_s": 0.007}, "0.007 s is not a whole multiple of step_s, 0.005 s"),
        ({"command_delay_s": 11.0}, "flight.errors.command_delay_s"),
    ],
)
def test_an_error_out_of_bounds_is_refused(errors: dict[str, float], message: str) -> None:
    with pytest.raises(SettingsError, match=message):
        flight_from_document({"plant": "kinematic", "law": {"name": "smc"}, "errors": errors})


def test_with_the_airspeed_from_the_ground_an_error_of_the_wind_estimate_matters_a_tenth_as_much() -> None:
    """Whatever the estimate, estimated airspeed and heading in it give the true velocity over the ground."""
    settled = {}
    for airspeed in ("nominal", "ground"):
        flight = replace(
            FLIGHT, law=law("nftsm", airspeed=airspeed, max_heading_rate=math.radians(8.0)), duration=150.0,
            wind=Wind(steady=(3.0, 0.0)), errors=Errors(wind=1.0, wind_heading=math.radians(90.0)),
        )  # fmt: skip
        settled[airspeed] = float(np.sqrt(np.mean(simulate(flight)["range_error"][-800:] ** 2)))
    assert settled["ground"] < 0.1 * settled["nominal"]
