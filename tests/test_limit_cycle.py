"""What a prediction answers: a limit cycle, none, or unknown with the reason; never none because a search failed."""

import json
import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

import aircraft
from autopilot.laws import law
from autopilot.linear import Linear
from autopilot.response import plain
from harness.chatter import VISIBLE
from harness.flight import Flight
from harness.limit_cycle.cycle import limit_cycle
from harness.limit_cycle.linear import crossing_and_margin
from harness.limit_cycle.march import UnsettledError, marched_margin, settled
from harness.limit_cycle.margin import following, following_of, gain_margin
from harness.limit_cycle.predicted import predicted, why_unknown
from harness.limit_cycle.prediction import Loop
from harness.limit_cycle.report import report
from harness.plants.identified import identified
from harness.plants.plant import Start
from harness.studies.observed_cycle import fly
from tests.builders import EXPERIMENTS, invoke
from tests.test_prediction import proportional

STATIONARY = EXPERIMENTS / "stationary.toml"
STICK = aircraft.folder("ultra_stick_25e")
DEFAULT = Loop(law("nftsm"), identified(STICK, 13.0).heading_rate, 13.0, 0.05)
# The paper's gains held for 0.25 s, a strong power of s on a fast airframe, and a tight circle: no balance is found for
# these from a guess.
HARD: tuple[tuple[str, float, dict[str, float]], ...] = (
    ("ultra_stick_25e", 0.25, {}),
    ("ultra_stick_25e", 0.1, {"k2": 2.92, "k3": 0.874, "gamma1": 0.32, "max_heading_rate": 0.36, "standoff": 100.0}),
    ("aerosonde", 0.1, {"k1": 0.0151, "k2": 5.46, "k3": 1.66, "gamma1": 0.378, "max_heading_rate": 0.35}),
)


def random_loops(count: int) -> Iterator[Loop]:
    """NFTSM with random gains on random circles, behind the inner loop of each airframe."""
    rng = np.random.default_rng(1)
    for name in rng.choice(aircraft.names(), count):
        airframe = aircraft.folder(str(name))
        speed = aircraft.limits(airframe).design_airspeed
        standoff = rng.uniform(4.0, 30.0) * speed
        k2 = math.exp(rng.uniform(-1.2, 3.0))
        nftsm = law(
            "nftsm", "fitted", standoff=standoff, max_heading_rate=speed / standoff * rng.uniform(1.1, 3.0), k2=k2,
            k3=k2 * rng.uniform(), k1=math.exp(rng.uniform(-4.6, -2.3)), gamma1=rng.uniform(0.3, 0.95),
        )  # fmt: skip
        yield Loop(nftsm, identified(airframe, speed).heading_rate, speed, float(rng.choice([0.02, 0.05, 0.1])))


def test_with_a_margin_below_one_a_limit_cycle_is_found_and_above_one_the_loop_comes_to_rest() -> None:
    for loop in random_loops(16):
        margin = gain_margin(loop)
        if margin < 0.95:
            cycle = limit_cycle(loop)
            assert cycle is not None, loop
            assert cycle.is_known, loop
            assert cycle.command > VISIBLE
        elif margin > 1.05:
            assert settled(loop).rests, loop


@pytest.mark.parametrize(("name", "period", "settings"), HARD)
def test_a_cycle_that_no_balance_finds_is_predicted_as_lagged_flies_it(
    name: str, period: float, settings: dict[str, float]
) -> None:
    airframe = aircraft.folder(name)
    speed = aircraft.limits(airframe).design_airspeed
    one = identified(airframe, speed)
    loop = Loop(law("nftsm", "fitted", **settings), one.heading_rate, speed, period)
    found = following_of(loop.law, airframe, speed, period)
    assert found.chatters
    assert found.margin is not None
    assert found.margin < 0.2
    assert found.cycle is not None
    flown = fly(loop, one.lagged)
    assert flown.command > VISIBLE
    assert found.cycle.frequency == pytest.approx(flown.frequency, rel=0.1)
    assert found.cycle.heading_rate == pytest.approx(flown.heading_rate, rel=0.1)
    assert found.cycle.command == pytest.approx(flown.command, rel=0.1)


@pytest.mark.parametrize("k2", [1.0, 12.0])
def test_the_margin_calculated_in_time_is_the_one_that_balances(k2: float) -> None:
    loop = replace(DEFAULT, law=law("nftsm", k2=k2, k3=0.5 * k2))
    assert marched_margin(loop) == pytest.approx(gain_margin(loop), rel=0.03)


def test_of_a_proportional_law_the_margin_calculated_in_time_is_that_of_routh_and_hurwitz() -> None:
    """S (s^2 + 2 d w s + w^2) + K w^2: K = 2 d w."""
    assert marched_margin(Loop(proportional(1.0), plain(0.0, 5.0, 0.6), 13.0, 2e-2)) == pytest.approx(6.0, rel=0.06)


def test_a_law_that_is_singular_on_its_circle_has_no_margin_at_all() -> None:
    """The paper's own gains: beta2 < 1, so that a thousandth of the gain swings, too."""
    settings = Flight(plant="sixdof", law=law("nftsm", "paper"), start=Start(airspeed=13.0))
    assert predicted(settings)["limit_cycle_margin"] == 0.0
    assert following(settings).chatters
    assert why_unknown(settings) == ""
    assert report(settings).most_gains is None


def test_a_loop_that_diverges_without_an_oscillation_is_in_no_limit_cycle() -> None:
    """Feedback of the wrong sign; and a weight so large that range errors are left alone."""
    row = np.zeros((1, 0))
    wrong = Linear(np.zeros((0, 0)), np.zeros((0, 2)), row, np.array([[1.0, 0.01]]))
    assert math.isnan(crossing_and_margin(DEFAULT, wrong)[1])
    lazy = Flight(plant="sixdof", law=law("lq_orbit", weight=1e8), start=Start(airspeed=13.0))
    assert following(lazy).chatters is None
    assert following(lazy).reason == "linearised, the loop diverges without an oscillation"


def test_where_the_search_fails_the_answer_is_unknown_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> float:
        raise UnsettledError("the loop leaves its circle")

    monkeypatch.setattr("harness.limit_cycle.margin.boundary", lambda *_: math.nan)
    monkeypatch.setattr("harness.limit_cycle.margin.marched_margin", fails)
    loop = Flight(plant="sixdof", law=law("nftsm", k2=3.21, k3=1.23), start=Start(airspeed=13.0))
    found = following(loop)
    assert (found.chatters, found.margin, found.cycle) == (None, None, None)
    reason = "the loop leaves its circle, so that the gain at which the limit cycle begins was not found"
    assert found.reason == why_unknown(loop) == reason
    told = invoke("predict", STATIONARY, "--set", "law.gains=fitted", "--set", "law.k2=3.21", "--set", "law.k3=1.23")
    assert f"unknown: {reason}" in told.stdout


def test_a_heading_error_without_return_leaves_the_circle() -> None:
    with pytest.raises(UnsettledError, match="leaves its circle"):
        settled(Loop(proportional(-2.0), plain(0.0, 5.0, 0.6), 13.0, 0.05))


def test_the_command_tells_the_cycle_the_margins_and_what_would_end_it() -> None:
    done = invoke("predict", STATIONARY)
    assert done.exit_code == 0, done.output
    rows = dict(line.rsplit("  ", 1) for line in done.stdout.splitlines() if "  " in line)
    told = {name.strip(): value for name, value in rows.items()}
    assert told["limit cycle"] == "predicted"
    assert told["frequency"] == "0.682 Hz"
    assert told["gain margin"].startswith("0.241 (")
    assert told["phase margin"] == "-60 deg"
    assert "to avoid it at these gains the inner-loop bandwidth must be at least 33.7 rad/s (5.5 times)" in done.stdout
    assert "no limit cycle up to k2 = 2.59, k3 = 1.3 1/s" in done.stdout
    calm = invoke("predict", STATIONARY, "--set", "law.k2=1", "--set", "law.k3=0.5").stdout
    assert "a limit cycle begins if the bandwidth falls below" in calm


def test_the_command_as_json_has_the_numbers_of_the_report() -> None:
    told = json.loads(invoke("predict", STATIONARY, "--json").stdout)
    assert told["limit_cycle"] == "predicted"
    assert told["cycle"]["frequency"] == pytest.approx(0.682, abs=1e-3)
    smc = ("--set", "law.name=smc", "--set", "law.gains=paper")
    calm = json.loads(invoke("predict", STATIONARY, "--json", *smc).stdout)
    assert (calm["limit_cycle"], calm["cycle"]) == ("none", None)
