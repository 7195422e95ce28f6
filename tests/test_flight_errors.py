"""The errors of a flight: each does what it says, and nothing else."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import jsbsim
import numpy as np
import pytest
from scipy.signal import lfilter

import aircraft
from autopilot.guidance import Context, Guidance, LawStep, Observation
from autopilot.laws import law
from harness.feasibility import warnings
from harness.flight import Flight
from harness.flight_errors import Errors
from harness.limit_cycle.predicted import predicted_margin, why_unknown
from harness.log import FlightLog
from harness.loop import simulate
from harness.plants.identified import identified
from harness.plants.ladder import PLANTS
from harness.plants.lagged import Lagged
from harness.plants.model import load, si, write
from harness.plants.plant import Outcome, PlantError, Start
from harness.plants.sixdof import Trim, engage, trim
from harness.settings import SettingsError, flight_from_document
from harness.world.air import Air
from harness.world.wind import Wind
from tests.builders import EXPERIMENTS, FLIGHT, SIXDOF, OwnLaw, invoke, turning
from tests.builders import write as file_of

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


def test_behind_a_lag_a_delay_of_the_command_is_a_delay_of_the_response() -> None:
    """Whole periods and a part of one: the flight of `lagged` whose response is later by as much."""
    rates = [0.05, -0.1, 0.15, 0.2, -0.2, 0.1]
    for delay in (0.05, 0.135):
        flight = replace(FLIGHT, plant="lagged", duration=3.0, errors=Errors(command_delay=delay))
        late, _ = observed(flight, rates)
        response = identified(STICK, 13.0).heading_rate
        later = Lagged(replace(response, delay=response.delay + delay)).start(flight.start, Air())
        for k, rate in enumerate([*rates, *[0.0] * 54]):
            later.advance(rate, PERIOD)
            there = (late["north"][k + 1], late["east"][k + 1], late["heading"][k + 1], late["heading_rate"][k + 1])
            s = later.state
            assert (s.north, s.east, s.heading, s.heading_rate) == pytest.approx(there, abs=1e-6)


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
        ({"mass_scale": 0.0}, "flight.errors.mass_scale"),
        ({"cg_aft": -1.5}, "flight.errors.cg_aft"),
        ({"actuator_lag_s": 0.001}, "flight.errors.actuator_lag_s: 0.001 s is too short for steps of 0.005 s"),
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


def steady(errors: Errors) -> tuple[jsbsim.FGFDMExec, Trim]:
    """The Ultra Stick in trim at 13 m/s in still air, with these errors."""
    fdm = load(STICK, 0.005, errors)
    return fdm, trim(fdm, Start(), Air())


@pytest.mark.parametrize("errors", [Errors(), Errors(mass_scale=0.9), Errors(mass_scale=1.1), Errors(cg_aft=0.1)])
def test_the_trim_carries_the_weight_and_balances_the_moment_about_the_centre_of_gravity(errors: Errors) -> None:
    """By the textbook's formulas and the published numbers of the Ultra Stick, in steady level flight."""
    fdm, x = steady(errors)
    data = aircraft.data(STICK)
    aero, S, c, m = data["aero"], data["ref"]["S"]["v"], data["ref"]["c"]["v"], data["mass"]["m"]["v"]
    ahead, below = data["ref"]["aero_offset"]["v"][0], data["propulsion"]["thrust_offset"]["v"][2]
    coefficient = {
        name: aero[name]["v"] for name in ("CL0", "CLa", "CLde", "CD0", "kD", "CLminD", "Cm0", "Cma", "Cmde")
    }
    alpha, elevator = x.pitch, x.elevator
    qS = 0.5 * fdm["atmosphere/rho-slugs_ft3"] * 515.3788183931961 * 13.0**2 * S
    CL = coefficient["CL0"] + coefficient["CLa"] * alpha + coefficient["CLde"] * elevator
    lift, drag = qS * CL, qS * (coefficient["CD0"] + coefficient["kD"] * (CL - coefficient["CLminD"]) ** 2)
    drag += qS * aero["CDde_abs"]["v"] * abs(elevator)
    thrust = drag / math.cos(alpha)
    assert lift + thrust * math.sin(alpha) == pytest.approx(errors.mass_scale * m * 9.80665, rel=3e-3)
    normal = lift * math.cos(alpha) + drag * math.sin(alpha)
    Cm = coefficient["Cm0"] + coefficient["Cma"] * alpha + coefficient["Cmde"] * elevator
    moments = (qS * c * Cm, normal * (ahead + errors.cg_aft * c), thrust * below)
    assert sum(moments) == pytest.approx(0.0, abs=0.01 * max(map(abs, moments)))


def test_more_mass_leaves_the_moments_of_inertia_as_they_are() -> None:
    (heavy, _), (right, _) = steady(Errors(mass_scale=1.1)), steady(Errors())
    assert si(heavy, "inertia/mass-slugs") == pytest.approx(1.1 * si(right, "inertia/mass-slugs"))
    for axis in ("xx", "yy", "zz", "xz"):
        assert heavy[f"inertia/i{axis}-slugs_ft2"] == pytest.approx(right[f"inertia/i{axis}-slugs_ft2"])


@pytest.mark.parametrize("name", aircraft.names())
def test_a_surface_lags_its_servo_by_one_first_order_more(name: str) -> None:
    """A small step of the aileron's command: the late one is the right one through 1 / (1 + 0.1 s)."""
    step, size, lag = 0.001, 0.01, 0.1
    deflections = {}
    for errors in (Errors(), Errors(actuator_lag=lag)):
        fdm = load(aircraft.folder(name), step, errors)
        start = Start(airspeed=aircraft.limits(aircraft.folder(name)).design_airspeed)
        engage(fdm, trim(fdm, start, Air()), start, True)
        write(fdm, "inner-loop/engaged", 0.0)
        write(fdm, "inner-loop/aileron-rad", size)
        flown = []
        for _ in range(500):
            fdm.run()
            flown.append(fdm["fcs/left-aileron-pos-rad"])
        deflections[errors.actuator_lag] = np.array(flown)
    right, late = deflections[0.0], deflections[lag]
    followed = lfilter([step / (2 * lag + step)] * 2, [1.0, -(2 * lag - step) / (2 * lag + step)], right)
    assert right[-1] == pytest.approx(size, rel=1e-3)
    assert late == pytest.approx(followed, abs=0.01 * size)


def test_the_errors_of_the_aircraft_leave_the_start_in_trim_and_change_the_flight() -> None:
    flights = {"right": SIXDOF, "late": replace(SIXDOF, errors=Errors(actuator_lag=0.05))}
    flights |= {"heavy": replace(SIXDOF, errors=Errors(mass_scale=1.1, cg_aft=-0.1))}
    logs = {name: simulate(flight) for name, flight in flights.items()}
    assert len({log.digest for log in logs.values()}) == 3
    assert logs["late"]["elevator"][0] == pytest.approx(logs["right"]["elevator"][0], abs=1e-9)
    assert logs["heavy"]["throttle"][0] > logs["right"]["throttle"][0]
    for log in logs.values():
        assert log.outcome is Outcome.COMPLETED
        assert np.abs(log["altitude"][:60] - 150.0).max() < 0.5


@pytest.mark.parametrize("plant", PLANTS)
def test_a_plant_without_mass_or_actuators_warns_and_flies_as_it_would(plant: str) -> None:
    flight = replace(FLIGHT, plant=plant, errors=Errors(mass_scale=1.1, actuator_lag=0.02), duration=1.0)
    told = [warning for warning in warnings(flight) if warning.startswith("errors.")]
    if PLANTS[plant].has_body:
        assert told == []
    else:
        only = "changes the plant sixdof only"
        assert told == [f"errors.mass_scale {only}", f"errors.actuator_lag {only}"]
        assert simulate(flight).digest == simulate(replace(flight, errors=Errors())).digest


def test_an_aircraft_too_heavy_to_fly_is_refused() -> None:
    with pytest.raises(PlantError, match="no level trim at 13 m/s"):
        simulate(replace(SIXDOF, errors=Errors(mass_scale=2.0)))


def test_gains_by_rule_follow_from_the_response_that_is_told() -> None:
    """Half of the border of a loop taken to be twice as quick is about the true border."""
    law = {"name": "nftsm", "gains": "behind_inner_loop"}
    k2, margin = [], []
    for speed in (1.0, 2.0):
        flight = flight_from_document({"plant": "sixdof", "law": law, "errors": {"response_speed": speed}})
        k2.append(getattr(flight.law, "k2"))  # noqa: B009 - of this law alone
        margin.append(predicted_margin(flight) or 0.0)
    assert k2[1] > 1.8 * k2[0]
    assert margin[0] > 1.5
    assert margin[1] < 1.1


def test_seeds_differ_by_the_noise_of_the_course(tmp_path: Path) -> None:
    text = '[flight]\nplant = "kinematic"\nduration_s = 1.0\nlaw.name = "smc"\n[matrix]\nseed = [0, 1]\n'
    assert "the 2 seeds repeat the same flight" in invoke("run", file_of(tmp_path / "a.toml", text), "--dry-run").stderr
    noisy = text.replace("[matrix]", "errors.course_noise_deg = 1.0\n[matrix]")
    assert "repeat" not in invoke("run", file_of(tmp_path / "b.toml", noisy), "--dry-run").stderr


def test_each_aircraft_of_a_matrix_is_tried_before_it_flies(tmp_path: Path) -> None:
    text = (
        '[flight]\nplant = "sixdof"\nduration_s = 1.0\nlaw.name = "smc"\n[matrix]\n"errors.mass_scale" = [1.0, 2.0]\n'
    )
    told = invoke("run", file_of(tmp_path / "a.toml", text), "--dry-run")
    assert told.exit_code == 2
    assert "no level trim at 13 m/s" in told.stderr


@pytest.mark.parametrize("errors", [Errors(command_delay=0.1), Errors(mass_scale=1.1), Errors(actuator_lag=0.1)])
def test_of_a_loop_that_an_error_changes_nothing_is_predicted(errors: Errors) -> None:
    assert why_unknown(replace(SIXDOF, errors=errors)).startswith("the prediction leaves out errors.")
    assert why_unknown(replace(SIXDOF, errors=Errors(wind=1.0))) == ""


def test_the_command_predict_warns_of_an_error_that_it_leaves_out() -> None:
    stationary = EXPERIMENTS / "stationary.toml"
    told = invoke("predict", stationary, "--set", "errors.command_delay_s=0.1")
    assert told.stderr == "warning: the prediction leaves out errors.command_delay\n"
    assert invoke("predict", stationary, "--set", "errors.wind_mps=1.0").stderr == ""
