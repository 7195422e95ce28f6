"""The predictor and the laws that fly by it: against the plant that it models, their linearisation, and Riccati."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import solve_discrete_lyapunov

import aircraft
import harness
from autopilot import lq_orbit, nftsm_lead
from autopilot.guidance import Context, Guidance, Law, LawStep, Observation
from autopilot.laws import law
from autopilot.nftsm_lead import NftsmLead
from autopilot.predictor import model, predictor, states
from autopilot.response import Response, plain
from harness.limit_cycle.linear import NO_LINEARISATION, crossing_and_margin, linearised
from harness.limit_cycle.margin import following
from harness.limit_cycle.prediction import Loop
from harness.loop import simulate
from harness.plants.identified import identified
from harness.plants.lagged import Lagged
from harness.plants.plant import Flying, Start
from harness.plants.state import State
from harness.studies.observed_cycle import fly
from harness.world.air import Air
from tests.builders import FLIGHT, OwnLaw, turning
from tests.test_guidance import OBSERVATIONS, mirrored

PERIOD, R_D, V_A = 0.05, 200.0, 13.0
STICK = identified(aircraft.folder("ultra_stick_25e"), 13.0).heading_rate
AEROSONDE = identified(aircraft.folder("aerosonde"), 25.0).heading_rate
RESPONSES = [STICK, AEROSONDE, AEROSONDE.quicker(0.3), plain(0.1, 5.0, 0.7)]
CONTEXT = Context(PERIOD, V_A, response=STICK)
LEAD, LQ = law("nftsm_lead", airspeed="ground"), law("lq_orbit", airspeed="ground")
BOTH = pytest.mark.parametrize("own", [LEAD, LQ], ids=["nftsm_lead", "lq_orbit"])


@pytest.mark.parametrize("response", RESPONSES)
@pytest.mark.parametrize("period", [0.02, 0.05, 0.13])
def test_what_is_due_is_what_was_commanded_and_lagged_has_not_turned(response: Response, period: float) -> None:
    now, seen, commanded = predictor(response, period, 0.5)
    plant = Lagged(response).start(Start(heading=0.0), Air())
    rng, asked, turned = np.random.default_rng(1), 0.0, 0.0
    for u in rng.uniform(-0.2, 0.2, 100):
        before = plant.state.heading
        plant.advance(u, period)
        now = commanded(seen(now, turned), u)
        asked += period * u
        turned += math.remainder(plant.state.heading - before, math.tau)
        _, _, due, disturbance, _ = now
        assert due == pytest.approx(asked - turned, abs=1e-9)
        assert disturbance == pytest.approx(0.0, abs=1e-7)


@pytest.mark.parametrize("response", [*RESPONSES, None])
def test_the_model_is_the_predictor_as_matrices(response: Response | None) -> None:
    (now, _, commanded), matrices = predictor(response, PERIOD, 0.5), model(response, PERIOD)
    x = np.zeros(len(matrices.A))
    for u in np.random.default_rng(2).uniform(-1.0, 1.0, 30):
        x = matrices.A @ x + matrices.B[:, 0] * u
        now = commanded(now, u)
        assert states(now) == pytest.approx(x.tolist(), abs=1e-12)
        assert now[2] == pytest.approx((matrices.C @ x)[1], abs=1e-12)


def test_a_steady_disturbance_is_observed() -> None:
    now, seen, commanded = predictor(STICK, PERIOD, 0.5)
    for k in range(200):
        now = seen(now, math.remainder(3.0 + 0.02 * k * PERIOD, math.tau))  # beyond pi on the way
        now = commanded(now, 0.0)
    assert now[3] == pytest.approx(0.02, rel=1e-6)


@pytest.mark.parametrize("response", RESPONSES)
def test_the_lag_is_what_a_steady_command_is_late_by(response: Response) -> None:
    now, _, commanded = predictor(response, PERIOD, 0.5)
    for _ in range(4000):
        now = commanded(now, 0.1)
    assert now[2] == pytest.approx(0.1 * response.lag, rel=1e-6)


@pytest.mark.parametrize("direction", ["paper", "mirrored"])
def test_where_the_plant_answers_at_once_the_lead_law_is_nftsm_bit_for_bit(direction: str) -> None:
    gains = {name: getattr(LEAD, name) for name in nftsm_lead.GAIN_SETS["calm"]}
    wind = harness.Wind(steady=(3.0, 2.0), turbulence="light")
    flight = replace(FLIGHT, wind=wind, law=law("nftsm_lead", airspeed="ground", direction=direction), duration=40.0)
    nftsm = law("nftsm", airspeed="ground", direction=direction, **gains)
    lead, paper = simulate(flight), simulate(replace(flight, law=nftsm))
    assert np.array_equal(lead.table, paper.table, equal_nan=True)
    unknown = Context(PERIOD, V_A, response=None)
    o = on_circle(0.01, 0.1)
    assert answers(flight.law, [o, o], unknown) == answers(nftsm, [o, o], unknown)


def answers(own: Law, observations: list[Observation], context: Context = CONTEXT) -> list[Guidance]:
    step = own.start(context)
    return [step(o) for o in observations]


SEQUENCES = st.lists(OBSERVATIONS.map(lambda o: o._replace(nominal_airspeed=13.0)), min_size=1, max_size=6)


@BOTH
@settings(max_examples=100)
@given(observations=SEQUENCES)
def test_every_answer_of_a_flight_is_finite_limited_mirrored_and_the_same_again(
    own: Law, observations: list[Observation]
) -> None:
    flown = answers(own, observations)
    assert all(math.isfinite(number) for guidance in flown for number in guidance)
    assert all(abs(guidance.heading_rate) <= own.max_heading_rate for guidance in flown)
    assert answers(own, observations) == flown
    other = answers(replace(own, direction="mirrored"), [mirrored(o) for o in observations])  # type: ignore[type-var]
    assert [guidance.heading_rate for guidance in other] == [-guidance.heading_rate for guidance in flown]


def on_circle(e: float, r: float) -> Observation:
    """Due north of the target, where the paper's circle goes west, in still air."""
    psi = e - 0.5 * math.pi
    velocity = V_A * math.cos(psi), V_A * math.sin(psi)
    return Observation(R_D + r, 0.0, *velocity, V_A, psi, 0.0, 0.0, 0.0, V_A, *(0.0,) * 8)


@pytest.mark.parametrize("own", [replace(LEAD, k3=0.0), LQ], ids=["nftsm_lead", "lq_orbit"])  # type: ignore[type-var]
@pytest.mark.parametrize("response", [*RESPONSES, None])
@pytest.mark.parametrize("axis", [0, 1])
def test_the_linearisation_is_the_step_for_small_errors(own: Any, response: Response | None, axis: int) -> None:
    context, count, size = Context(PERIOD, V_A, response=response), 60, 1e-8
    impulse = [[0.0, 0.0] for _ in range(count)]
    impulse[1][axis] = size  # after the first, before which nothing was expected

    def commands(sign: float) -> np.ndarray[Any, Any]:
        flown = answers(own, [on_circle(sign * e, sign * r) for e, r in impulse], context)
        return np.array([guidance.heading_rate for guidance in flown])

    difference = (commands(1.0) - commands(-1.0)) / (2.0 * size)
    linear, expected = own.linearised(context, 0.01), []
    x = np.zeros(len(linear.A))
    for i in np.array(impulse) / size:
        expected.append(float((linear.C @ x + linear.D @ i)[0]))
        x = linear.A @ x + linear.B @ i
    assert difference == pytest.approx(np.array(expected), abs=1e-5 * np.abs(expected).max())


def test_the_reaching_law_is_linearised_by_its_first_harmonic() -> None:
    own = law("nftsm_lead")
    assert isinstance(own, NftsmLead)
    unknown, swing = Context(PERIOD, V_A), 0.01
    (of_e, of_r), *_ = own.linearised(unknown, swing).D
    without = replace(own, k3=0.0).linearised(unknown, swing).D[0, 0]
    a = 0.5 * swing / abs(of_e)
    sine = np.sin(math.tau * np.arange(4096) / 4096)
    harmonic = 2.0 * np.mean(own.k3 * np.abs(a * sine) ** own.gamma1 * np.sign(sine) * sine) / a
    assert without - of_e == pytest.approx(harmonic, rel=1e-4)
    assert of_r < 0.0


@pytest.mark.parametrize(("response", "v_a"), [(STICK, 13.0), (AEROSONDE, 25.0), (None, 13.0)])
def test_the_gains_solve_their_riccati_equation(response: Response | None, v_a: float) -> None:
    weight = 50.0
    A, B = lq_orbit.plant(response, PERIOD, v_a, 2.0)
    K = np.array([lq_orbit.optimal(response, PERIOD, v_a, 2.0, weight)])
    Q = np.zeros_like(A)
    Q[0, 0] = 1.0
    cost = solve_discrete_lyapunov((A - B @ K).T, Q + weight * K.T @ K)  # of flying by K
    assert np.linalg.solve(weight + B.T @ cost @ B, B.T @ cost @ A) == pytest.approx(K, rel=1e-6, abs=1e-9)


def test_the_lq_model_is_the_sampled_aircraft() -> None:
    A, B = lq_orbit.plant(STICK, PERIOD, V_A, 2.0)
    z = np.exp(1j * np.array([0.2, 1.0, 4.0]) * PERIOD)
    both = [np.linalg.solve(w * np.eye(len(A)) - A, B)[[1, 0], 0] for w in z]
    assert np.array(both) == pytest.approx(STICK.sampled(PERIOD, z) * [1.0, V_A], rel=0.01)


@dataclass(frozen=True)
class Louder:
    """`lagged` with what is commanded beyond the turn of the circle so many times as large."""

    loop: Loop
    times: float

    def start(self, start: Start, air: Air) -> Flying:
        return _Louder(Lagged(self.loop.response).start(start, air), self)


class _Louder:
    def __init__(self, flying: Flying, plant: Louder) -> None:
        self._flying, self._plant = flying, plant

    @property
    def state(self) -> State:
        return self._flying.state

    def advance(self, heading_rate: float, period: float) -> None:
        turn = self._plant.loop.turn
        self._flying.advance(turn + self._plant.times * (heading_rate - turn), period)


@BOTH
@pytest.mark.parametrize(("response", "v_a"), [(STICK, 13.0), (AEROSONDE, 25.0)])
def test_the_margin_of_a_law_with_memory_is_where_lagged_begins_to_cycle(
    own: Any, response: Response, v_a: float
) -> None:
    loop = Loop(replace(own, standoff=15.4 * v_a, max_heading_rate=math.radians(8.0)), response, v_a, PERIOD)
    linear = linearised(loop)
    assert linear is not None
    crossing, margin = crossing_and_margin(loop, linear)
    assert crossing is not None
    assert margin > 2.0
    assert math.radians(25.0) < crossing.phase_margin < math.radians(60.0)
    assert fly(loop, Louder(loop, 0.85 * margin), 90.0).command < math.radians(0.1)
    assert fly(loop, Louder(loop, 1.1 * margin), 90.0).command > math.radians(2.0)
    _, below = crossing_and_margin(replace(loop, gain=1.2 * margin), linear)
    assert below == pytest.approx(1.0 / 1.2, rel=1e-3)


def test_a_law_with_memory_that_gives_no_linearisation_has_no_margin() -> None:
    def start() -> LawStep:
        seen: list[float] = []

        def step(o: Observation) -> Guidance:
            seen.append(o.heading)
            return turning(-0.065 - 3.0 * (sum(seen) / len(seen) + 0.5 * math.pi))

        return step

    found = following(replace(FLIGHT, plant="sixdof", law=OwnLaw(start)))
    assert (found.reason, found.margin, found.chatters) == (NO_LINEARISATION, None, None)


def test_the_gains_by_rule_follow_from_lag_and_airspeed() -> None:
    flight = replace(FLIGHT, aircraft="aerosonde", start=Start(airspeed=25.0))
    lead: Any = harness.law("nftsm_lead", "by_lag", flight=flight)
    lq: Any = harness.law("lq_orbit", "by_airspeed", flight=flight)
    assert (lead.k2, lead.k3) == pytest.approx((1.4 / (AEROSONDE.lag + 0.05), 0.7 / (AEROSONDE.lag + 0.05)), rel=2e-3)
    assert lq.weight == pytest.approx(20.0 * (25.0 / 13.0) ** 2, rel=2e-3)


@BOTH
@pytest.mark.parametrize("plant", ["lagged", "sixdof"])
def test_in_wind_the_circle_is_held_to_millimetres_without_a_limit_cycle(own: Any, plant: str) -> None:
    flight = replace(
        FLIGHT,
        plant=plant,
        duration=200.0,
        law=replace(own, max_heading_rate=math.radians(15.0)),
        wind=harness.Wind(steady=(0.6 * V_A, 0.0)),
    )
    metrics: Any = simulate(flight).metrics
    assert metrics["range_error_rms_m"] < 0.005
    assert metrics["saturation_fraction"] == 0.0
    assert metrics["convergence_time_s"] < 20.0
    assert metrics["command_activity_deg_s2"] < 0.15
