"""The estimator against closed forms, and in flight."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Literal, get_args

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from autopilot.estimator import (
    Estimator,
    Measurement,
    Tracker,
    ekf,
    initial,
    linearised,
    measurement,
    residual,
)
from autopilot.guidance import UNKNOWN, Guidance, Observation
from autopilot.laws import law
from harness.checks import problems
from harness.feasibility import warnings
from harness.flight import MetricSettings, air_of, plant_of
from harness.knowledge import Estimation, sensor, sighting
from harness.log import COLUMNS, FlightLog
from harness.loop import command, observe, simulate
from harness.plants.plant import Outcome
from harness.studies.estimator import MEASURED, STATES, assessed, band, cases, examine, fitting_case, moving, table_row
from harness.world.randomness import stream
from harness.world.target import Segment, Target, TargetState
from tests.builders import DOCS, FLIGHT, OwnLaw, python, turning

Knowledge = Literal["known", "unknown"]
PAPER = Estimator(kind="ekf")
MOVING = Target(speed=2.0, heading=-0.8, segments=(Segment(from_=2.0, to=20.0, acceleration=0.1, turn_rate=0.05),))
EKF = replace(FLIGHT, target=MOVING, estimator=PAPER)


def column(x: float, x_dot: float, y: float, y_dot: float) -> np.ndarray:
    return np.array([[x], [x_dot], [y], [y_dot]])


COORDINATE = st.floats(-5000.0, 5000.0)


@given(COORDINATE, COORDINATE, COORDINATE, COORDINATE)
def test_the_linearisation_is_the_derivative_of_the_measurement(x: float, y: float, x_s: float, y_s: float) -> None:
    d = 1e-3 * math.hypot(x - x_s, y - y_s)
    assume(d > 1e-3)
    H = linearised(column(x, 1.0, y, -2.0), x_s, y_s)
    for i, (dx, dy) in ((0, (d, 0.0)), (2, (0.0, d))):
        after, before = (measurement(x + sign * dx, y + sign * dy, x_s, y_s) for sign in (1.0, -1.0))
        slope = residual(np.array([after]).T, np.array([before]).T)[:, 0] / (2.0 * d)
        assert H[:, i] * (1.0, d) == pytest.approx(slope * (1.0, d), abs=2e-6)
    assert not H[:, [1, 3]].any()


def test_a_target_at_the_sensor_leaves_the_filter_finite() -> None:
    assert not linearised(column(3.0, 0.0, -4.0, 0.0), 3.0, -4.0).any()
    tracker = ekf(replace(PAPER, initial_position=(0.0, 0.0)))
    tracker.update(Measurement(0.3, 1.0))
    assert all(map(math.isfinite, tracker.ahead(tracker.known, 0.5)))


@given(st.floats(-math.pi, math.pi), st.floats(-3.1, 3.1), st.integers(-3, 3))
def test_the_azimuth_residual_is_the_short_way_round(expected: float, difference: float, turns: int) -> None:
    z = np.array([[5.0], [expected + difference + turns * math.tau]])
    assert residual(z, np.array([[3.0], [expected]]))[:, 0] == pytest.approx([2.0, difference], abs=1e-12)


@pytest.mark.parametrize(
    ("start", "velocity"),
    [((300.0, 200.0), (-1.0, 2.0)), ((-400.0, 60.0), (0.0, -2.0)), ((-50.0, -80.0), (2.0, 1.0))],
    ids=["ahead", "from east to west, south of the sensor", "past the sensor"],
)
def test_exact_measurements_of_a_constant_velocity_bring_the_truth(
    start: tuple[float, float], velocity: tuple[float, float]
) -> None:
    tracker = ekf(PAPER)
    for k in range(600):
        x, y = (p + v * 0.5 * k for p, v in zip(start, velocity, strict=True))
        tracker.update(measurement(x, y, 0.0, 0.0))
    assert tracker.ahead(tracker.known, 0.0)[:4] == pytest.approx((x, y, *velocity), abs=1e-3)


def test_the_start_from_a_measurement_has_its_noise_along_and_across() -> None:
    s = replace(PAPER, sensor_position=(30.0, -20.0), initial_velocity=(1.0, -1.0))
    X, P = initial(s, Measurement(100.0, 0.7))
    assert measurement(X[0, 0], X[2, 0], 30.0, -20.0) == pytest.approx((100.0, 0.7))
    along = np.array([math.cos(0.7), 0.0, math.sin(0.7), 0.0])
    across = np.array([-math.sin(0.7), 0.0, math.cos(0.7), 0.0])
    assert (along @ P @ along, across @ P @ across) == pytest.approx((0.5, 100.0**2 * 0.015))
    assert along @ P @ across == pytest.approx(0.0, abs=1e-12)
    assert (X[1, 0], X[3, 0], P[1, 1], P[3, 3]) == (1.0, -1.0, 4.0, 4.0)


def started(settings: Estimator, updates: int) -> Tracker:
    tracker, draw = ekf(settings), stream(7, "test")
    for k in range(updates):
        tracker.update(Measurement(200.0 + k + draw.standard_normal(), 0.3 + 0.1 * draw.standard_normal()))
    return tracker


def test_a_period_after_the_measurement_the_estimate_is_the_filters_own_prediction() -> None:
    tracker = started(PAPER, 10)
    after = tracker.ahead(tracker.known, PAPER.period)
    tracker.kalman.predict()
    assert after[:4] == pytest.approx(tracker.kalman.x[[0, 2, 1, 3], 0])
    assert after[4:] == pytest.approx(tracker.kalman.P.diagonal()[[0, 2, 1, 3]])


def test_between_measurements_the_estimate_moves_at_constant_velocity() -> None:
    tracker = started(PAPER, 5)
    now, later = tracker.ahead(tracker.known, 0.0), tracker.ahead(tracker.known, 0.35)
    assert later[2:4] == now[2:4]
    assert later[0] - now[0] == pytest.approx(0.35 * now[2])
    assert later[1] - now[1] == pytest.approx(0.35 * now[3])
    assert later[6:] == pytest.approx((now[6] + 0.7 * 0.01, now[7] + 0.7 * 0.01))  # 0.7 of a period: as much of Q


def test_the_matrices_are_the_papers() -> None:
    kalman = ekf(PAPER).kalman
    assert kalman.F.tolist() == [[1, 0.5, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0.5], [0, 0, 0, 1]]
    assert kalman.Q.tolist() == np.diag([0.2, 0.01, 0.2, 0.01]).tolist()
    assert kalman.R.tolist() == np.diag([0.5, 0.015]).tolist()


@pytest.mark.parametrize("distance", [100.0, 4000.0])
def test_for_a_target_that_fits_the_model_nees_and_nis_lie_in_their_bands(distance: float) -> None:
    found = examine(fitting_case(distance, known=True), 200)
    for values, numbers in ((found.nees, STATES), (found.nis, MEASURED)):
        low, high = band(numbers, 200)
        at_once = values.mean(axis=0)  # over 200 seeds; neighbours in time are correlated
        assert low < at_once.mean() < high
        assert np.mean((low < at_once) & (at_once < high)) > 0.85


def test_far_from_the_sensor_a_start_from_the_first_measurement_is_overconfident() -> None:
    """The noise in azimuth, 7 deg, bends away from its tangent by 7 m at 1 km, ten times the noise in range."""
    assert examine(fitting_case(1000.0, known=False), 50).nees.mean() > 50.0


def test_a_turn_that_the_model_does_not_know_is_an_error_that_the_filter_does_not_know() -> None:
    turn = Segment(from_=40.0, to=50.0, turn_rate=math.radians(-10.0))  # the sharpest of Section 4.3
    case = cases()[0]._replace(
        estimator=PAPER, motion=moving(Target(position=(500.0, 0.0), speed=7.0, segments=(turn,)), PAPER, 60.0)
    )
    nees = examine(case, 50).nees.mean(axis=0)
    assert nees[75] < 4.0 * 4.0 < 10.0 * 4.0 < nees[100]


def test_the_documents_table_is_what_the_command_prints() -> None:
    lines = (DOCS / "answers" / "estimator.md").read_text(encoding="utf-8").splitlines()
    for case in (cases()[0], cases()[4]):
        assert table_row(assessed(case)) in lines


def test_the_noise_has_its_variances_and_is_white() -> None:
    at_rest = TargetState(300.0, 400.0, 0.0, 0.0)
    measure = sensor(PAPER, 3)
    noise = np.array([measure(at_rest) for _ in range(20000)]) - (500.0, math.atan2(400.0, 300.0))
    assert noise.mean(axis=0) == pytest.approx([0.0, 0.0], abs=0.02)
    assert noise.var(axis=0) == pytest.approx([0.5, 0.015], rel=0.04)
    assert np.mean(noise[1:] * noise[:-1], axis=0) == pytest.approx([0.0, 0.0], abs=0.02)


def test_a_stream_is_named_by_seed_and_purpose() -> None:
    draws = {tuple(stream(seed, purpose).random(3)) for seed in (0, 1, 2**40) for purpose in ("sensor", "gust", "")}
    assert len(draws) == 9
    assert stream(5, "sensor").random() == stream(5, "sensor").random()


def knowledge(log: FlightLog) -> bytes:
    return log.table[:, COLUMNS.index("target_north_seen") :].tobytes()


def test_every_plant_and_law_meets_the_same_noise_and_every_seed_another() -> None:
    kinematic = simulate(EKF)
    assert knowledge(simulate(replace(EKF, plant="sixdof"))) == knowledge(kinematic)
    assert knowledge(simulate(replace(EKF, law=law("smc", direction="mirrored")))) == knowledge(kinematic)
    assert simulate(EKF).digest == kinematic.digest
    other = simulate(replace(EKF, seed=1))
    assert not np.isclose(other["innovation_range"][10::10], kinematic["innovation_range"][10::10]).any()


def listening(heard: list[Observation]) -> OwnLaw:
    """A law that commands nothing and keeps what it hears."""

    def step(observation: Observation) -> Guidance:
        heard.append(observation)
        return turning(0.0)

    return OwnLaw(lambda: step)


def test_the_law_sees_the_estimate_and_nothing_else_of_the_target() -> None:
    heard: list[Observation] = []
    log = simulate(replace(EKF, law=listening(heard)))
    seen = np.array([o[-7:-1] for o in heard])
    names = ("target_north", "target_east", "target_velocity_north", "target_velocity_east")
    assert np.array_equal(seen[:, :4].T, [log[f"{name}_seen"] for name in names])
    assert not seen[:, 4:].any()
    assert log["target_turn_rate"].any()
    assert (np.abs(log["target_north"] - seen[:, 0]) > 1e-3).mean() > 0.9


@pytest.mark.parametrize("acceleration", get_args(Knowledge))
@pytest.mark.parametrize("turn_rate", get_args(Knowledge))
def test_a_law_told_the_truth_may_be_left_without_acceleration_or_turn_rate(
    acceleration: Knowledge, turn_rate: Knowledge
) -> None:
    heard: list[Observation] = []
    log = simulate(
        replace(EKF, law=listening(heard), estimator=Estimator(acceleration=acceleration, turn_rate=turn_rate))
    )
    for name, known in (("target_acceleration", acceleration), ("target_turn_rate", turn_rate)):
        seen = np.array([getattr(o, name) for o in heard])
        assert np.array_equal(seen, log[name] if known == "known" else np.zeros(len(log)))
        assert log[name].any()
    assert [o.target_velocity_north for o in heard] == log["target_velocity_north"].tolist()


def test_the_range_error_is_the_true_one_beside_what_the_law_saw() -> None:
    log = simulate(EKF)
    for suffix, name in (("", "range_error"), ("_seen", "range_error_seen")):
        away = np.hypot(log["north"] - log[f"target_north{suffix}"], log["east"] - log[f"target_east{suffix}"])
        assert log[name] == pytest.approx(away - 200.0, abs=1e-9)
    assert np.abs(log["range_error"] - log["range_error_seen"]).max() > 0.5


@pytest.mark.parametrize("plant", ["kinematic", "sixdof"])
def test_with_the_truth_the_law_sees_the_target_as_it_is(plant: str) -> None:
    log = simulate(replace(EKF, plant=plant, estimator=Estimator()))
    assert log["range_error_seen"].tobytes() == log["range_error"].tobytes()
    for name in ("target_north", "target_east", "target_velocity_north", "target_velocity_east"):
        assert log[f"{name}_seen"].tobytes() == log[name].tobytes()
        assert np.isnan(log[f"{name}_variance"]).all()
    assert np.isnan(log["innovation_range"]).all()
    assert np.isnan(log["innovation_azimuth"]).all()


@pytest.mark.parametrize("plant", ["kinematic", "sixdof"])
def test_a_flight_with_the_truth_is_law_and_plant_alone_to_the_last_bit(plant: str) -> None:
    one = replace(EKF, plant=plant, estimator=Estimator())
    log, step, target = simulate(one), one.law.start(UNKNOWN), MOVING.start()
    flying = plant_of(one).start(one.start, air_of(one))
    for k in range(one.periods):
        guidance = command(step, observe(flying.state, one.start.airspeed, one.wind.steady, target(k * 0.05)))
        assert guidance.heading_rate == log["heading_rate_command"][k]
        flying.advance(guidance.heading_rate, 0.05)
    assert (flying.state.north, flying.state.east) == (log["north"][-1], log["east"][-1])


def test_innovations_stand_in_the_rows_of_their_measurements() -> None:
    log = simulate(EKF)
    measured = np.isfinite(log["innovation_azimuth"])
    assert np.flatnonzero(measured).tolist() == list(range(10, 401, 10))  # the first one started the filter
    given_a_start = simulate(replace(EKF, estimator=replace(PAPER, initial_position=(10.0, 10.0))))
    assert np.isfinite(given_a_start["innovation_range"][0])


def test_of_several_measurements_in_a_guidance_period_all_count() -> None:
    often = replace(PAPER, period=0.1)
    log = simulate(replace(EKF, estimator=often, guidance_period=0.5))
    tracker, measure, at = ekf(often), sensor(often, 0), MOVING.start()
    for j in range(200 + 1):
        last = tracker.update(measure(at(j * 0.1)))
    assert log.table[-1, COLUMNS.index("target_north_seen") :].tolist() == [*tracker.ahead(tracker.known, 0.0), *last]


def test_a_measurement_period_must_fit_the_guidance_period_and_the_step() -> None:
    def told(period: float, guidance_period: float, kind: Literal["truth", "ekf"] = "ekf") -> list[str]:
        estimator = replace(PAPER, period=period, kind=kind)
        return [
            f"{p.name}: {p.message}"
            for p in problems(replace(EKF, estimator=estimator, guidance_period=guidance_period))
        ]

    assert told(0.5, 0.05) == told(0.1, 0.5) == told(0.5, 0.5) == told(0.5, 0.2, "truth") == []
    assert told(0.5, 0.2) == [
        "estimator.period: 0.5 s is neither a whole multiple nor a whole fraction of guidance_period_s, 0.2 s"
    ]
    assert told(0.501, 0.05) == ["estimator.period: 0.501 s is not a whole multiple of step_s, 0.005 s"]


@pytest.mark.parametrize(
    ("estimator", "reason"),
    [
        (
            replace(PAPER, initial_position=(1.7e308, 1.7e308)),
            "the estimator diverged: a number of its estimate is not finite",
        ),
        (replace(PAPER, range_variance=1e308), "the estimator raised"),
    ],
)
def test_a_filter_that_diverges_ends_the_flight_as_invalid(estimator: Estimator, reason: str) -> None:
    with np.errstate(all="ignore"):
        log = simulate(replace(EKF, estimator=estimator))
    assert log.outcome is Outcome.INVALID
    assert log.reason.startswith(reason)
    assert len(log) < 401
    assert np.isfinite(log["range_error"]).all()


def test_a_filter_that_would_fail_after_the_flight_has_ended_is_no_reason() -> None:
    failing = replace(EKF, estimator=replace(PAPER, range_variance=1e308))
    with np.errstate(all="ignore"):
        log = simulate(replace(failing, metrics=MetricSettings(monitoring_range=1.0)))
        assert simulate(failing).outcome is Outcome.INVALID
    assert log.outcome is Outcome.TARGET_LOST
    assert len(log) == 1


@pytest.mark.parametrize(("north", "outcome"), [(2000.0, Outcome.COMPLETED), (-100.0, Outcome.TARGET_LOST)])
def test_the_target_is_lost_beyond_the_monitoring_range_of_the_truth(north: float, outcome: Outcome) -> None:
    believed = replace(PAPER, initial_position=(north, 0.0), initial_position_variance=1e-6)
    near = Target(position=(2.0 if outcome is Outcome.COMPLETED else 2000.0, 0.0))
    log = simulate(
        replace(EKF, estimator=believed, target=near, duration=1.0, metrics=MetricSettings(monitoring_range=1000.0))
    )
    assert log.outcome is outcome


def test_what_falls_due_between_two_looks_is_measured_at_its_own_time() -> None:
    at: Callable[[float], TargetState] = EKF.target.start()
    each, only_last = Estimation(sighting(EKF)), Estimation(sighting(EKF))
    assert [each.at(k, at(0.05 * k)) for k in range(38)][-1] == only_last.at(37, at(1.85))


VARIANCES = [COLUMNS.index(f"target_{name}_variance") for name in ("north", "east", "velocity_north", "velocity_east")]


def test_in_a_gap_of_the_measurements_the_filter_reckons_on_at_constant_velocity_and_ever_less_sure() -> None:
    whole = simulate(EKF)
    log = simulate(replace(EKF, estimator=replace(PAPER, lost_from=10.0, lost_for=5.0)))
    assert np.flatnonzero(np.isnan(log["innovation_range"][::10])).tolist() == [0, *range(20, 30)]
    before, gap = slice(0, 200), slice(199, 300)
    assert np.array_equal(log.table[before], whole.table[before], equal_nan=True)
    for way, speed in (("north", "velocity_north"), ("east", "velocity_east")):
        assert len(set(log[f"target_{speed}_seen"][gap])) == 1
        moved = np.diff(log[f"target_{way}_seen"][gap])
        assert moved == pytest.approx(0.05 * log[f"target_{speed}_seen"][200], abs=1e-9)
    assert (np.diff(log.table[gap, :][:, VARIANCES], axis=0) > 0.0).all()
    assert log["target_north_variance"][300] < log["target_north_variance"][299]  # measured again


@pytest.mark.parametrize("plant", ["kinematic", "sixdof"])
def test_of_the_measurements_a_share_is_lost_the_same_for_every_law_and_plant(plant: str) -> None:
    estimator = replace(PAPER, lost_share=0.3, period=0.05)
    log = simulate(replace(EKF, plant=plant, estimator=estimator, law=law("smc")))
    lost = np.isnan(log["innovation_range"][1:])
    assert 0.25 < lost.mean() < 0.35
    drawn = stream(EKF.seed, "lost measurements").random(len(log))
    assert np.array_equal(lost, drawn[1:] < 0.3)
    another = simulate(replace(EKF, plant=plant, estimator=estimator, seed=1))
    assert not np.array_equal(lost, np.isnan(another["innovation_range"][1:]))


def test_all_measurements_but_the_first_may_be_lost() -> None:
    log = simulate(replace(EKF, estimator=replace(PAPER, lost_share=1.0)))
    assert log.outcome is Outcome.COMPLETED
    assert np.isnan(log["innovation_range"]).all()
    assert len(set(log["target_north_seen"])) == 1  # where it was first seen, at rest


def test_with_the_truth_nothing_is_lost_and_a_warning_says_so() -> None:
    one = replace(EKF, estimator=Estimator(lost_share=0.5))
    assert simulate(one).digest == simulate(replace(one, estimator=Estimator())).digest
    assert 'no measurement is lost: estimator.kind = "truth" needs none' in warnings(one)


def test_who_knows_the_truth_loads_no_filter() -> None:
    code = (
        "import sys\n"
        "from autopilot.laws import law\n"
        "from harness.flight import Flight\n"
        "from harness.loop import simulate\n"
        "simulate(Flight(plant='kinematic', law=law('smc'), duration=1.0))\n"
        "heavy = {'filterpy', 'scipy', 'jsbsim', 'matplotlib'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    done = python(code)
    assert done.returncode == 0, done.stderr
