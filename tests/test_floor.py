"""The floor: its closed form against simulation, what it is fitted to, and its law in flight."""

import math
from dataclasses import replace

import numpy as np
import pytest

import aircraft
from harness.loop import simulate
from harness.plants.identified import identified
from harness.plants.lagged import Lagged
from harness.studies.floor import Planted, checked, flight_of, held, read_floor, under_law
from harness.studies.floor_model import Autoregression, Circle, between, error_at, fitted, front, model, optimal
from harness.world.wind import Wind
from tests.builders import ROOT

ULTRA = identified(aircraft.folder("ultra_stick_25e"), 13.0).heading_rate
CIRCLE = Circle(ULTRA, 13.0, 200.0)
AIR = Autoregression(np.array([1.2, -0.25]), 0.008, np.zeros(0))


def test_the_closed_form_is_what_the_linear_loop_comes_to() -> None:
    of = model(CIRCLE, AIR)
    point = optimal(of, 100.0)
    closed = of.F - np.outer(of.g, point.gains)
    noise = np.random.default_rng(1).standard_normal(400_000)
    z, errors, changes = np.zeros(len(of.F)), [], []
    for w in noise.tolist():
        errors.append(z[0])
        changes.append(point.gains @ z)
        z = closed @ z + of.h * w
    assert np.std(errors) == pytest.approx(point.error, rel=0.05)
    assert math.degrees(np.abs(changes).mean()) / CIRCLE.period == pytest.approx(point.activity, rel=0.05)


def test_no_other_gains_cost_less() -> None:
    from scipy.linalg import solve_discrete_lyapunov

    of = model(CIRCLE, AIR)
    point = optimal(of, 100.0)

    def cost(gains: np.ndarray) -> float:
        S = solve_discrete_lyapunov(of.F - np.outer(of.g, gains), np.outer(of.h, of.h))
        return float(S[0, 0] + point.weight * gains @ S @ gains)

    random = np.random.default_rng(2)
    best = cost(point.gains)
    for _ in range(20):
        assert cost(point.gains * (1.0 + 0.02 * random.standard_normal(len(point.gains)))) > best


def test_less_activity_costs_error_and_a_quicker_inner_loop_saves_it() -> None:
    slow, quick = front(CIRCLE, AIR), front(CIRCLE._replace(response=ULTRA.quicker(3.0)), AIR)
    assert np.all(np.diff([point.error for point in slow]) > 0.0)
    assert np.all(np.diff([point.activity for point in slow]) < 0.0)
    assert error_at(quick, 5.0) < error_at(slow, 5.0)


def test_a_planted_autoregression_is_found_again() -> None:
    found = fitted([3.0 + AIR.drawn(20_000, seed) for seed in range(4)], order=2)
    assert found.coefficients == pytest.approx(AIR.coefficients, abs=0.02)
    assert found.deviation == pytest.approx(AIR.deviation, rel=0.02)


def test_what_a_law_flies_through_is_told_from_what_it_commands() -> None:
    flight = replace(flight_of("ultra_stick_25e", 0, "lagged", duration=60.0), wind=Wind())
    rates = AIR.drawn(flight.periods, 1)
    log = simulate(flight, plant=Planted(Lagged(ULTRA), tuple(rates.tolist())))
    left = under_law(log, ULTRA)
    assert np.std(rates) > 0.02
    assert left == pytest.approx(rates[-len(left) :], abs=4e-4)


def test_the_optimal_law_on_lagged_comes_to_its_prediction() -> None:
    check = checked("ultra_stick_25e", AIR, 1.0, seeds=4)
    assert check.error[0] == pytest.approx(check.predicted.error, abs=check.error[1] + 0.05 * check.predicted.error)
    assert check.activity[0] == pytest.approx(check.predicted.activity, rel=0.05)


def test_the_published_floor_is_what_a_flight_of_today_gives() -> None:
    flown = held(flight_of("ultra_stick_25e", 0))
    points = front(CIRCLE._replace(speed=flown.speed), fitted([flown.disturbance]))
    levels = read_floor(ROOT / "docs" / "answers" / "floor.csv")
    assert sorted(levels) == sorted(aircraft.names())
    published = between(5.0, [(level.activity, level.error) for level in levels["ultra_stick_25e"]])
    assert error_at(points, 5.0) == pytest.approx(published, rel=0.3)  # one seed of eight
