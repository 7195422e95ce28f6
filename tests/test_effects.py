"""What rungs and disturbances add: made-up flights whose parts are known."""

import itertools

import pandas as pd
import pytest

from harness.verdict.effects import disturbances, ladders
from harness.verdict.pairs import entered
from tests.builders import QUIET, SEEDS, result, results

RUNGS = ("kinematic", "lagged", "coordinated", "sixdof")
ERROR = {"kinematic": 1.0, "lagged": 1.5, "coordinated": 1.4, "sixdof": 2.0}


def flown() -> pd.DataFrame:
    """Each rung adds to the settled error, turbulence adds twice as much on the last, each seed a little of its own."""
    rows = []
    for plant, seed, air in itertools.product(RUNGS, range(SEEDS), ("none", "moderate")):
        added = 0.0 if air == "none" else 2.0 if plant == "sixdof" else 1.0
        error = {**QUIET, "range_error_rms_m": ERROR[plant] + added + 0.01 * seed * RUNGS.index(plant)}
        rows.append(result(plant, seed, error, {"wind.turbulence": air}))
    return entered(results(rows), 0.25)


def test_the_steps_of_a_ladder_add_up_to_the_whole_in_still_air_alone() -> None:
    (ladder,) = [ladder for ladder in ladders(flown()) if ladder.metric == "range_error_rms_m"]
    assert ladder.at == {}
    assert [step.plant for step in ladder.steps] == list(RUNGS[1:])
    assert ladder.start + sum(step.of.mean for step in ladder.steps) == pytest.approx(ladder.end, abs=1e-12)
    assert ladder.start == pytest.approx(1.0)
    assert ladder.seeds == SEEDS


def test_a_scenario_that_one_rung_lacks_counts_on_none() -> None:
    flights = flown()
    (ladder,) = [
        ladder
        for ladder in ladders(flights[~((flights["plant"] == "lagged") & (flights["seed"] == 2))])
        if ladder.metric == "range_error_rms_m"
    ]
    assert ladder.seeds == SEEDS - 1


def test_a_disturbance_is_the_same_flight_with_and_without_it() -> None:
    (disturbed,) = disturbances(flown(), ("kinematic", "sixdof"))
    adds = {e.plant: (e.of.mean, e.word) for e in disturbed.effects if e.metric == "range_error_rms_m"}
    assert disturbed.what == "turbulence moderate"
    assert adds["kinematic"][0] == pytest.approx(1.0)
    assert adds["sixdof"][0] == pytest.approx(2.0)
    assert adds["sixdof - kinematic"][0] == pytest.approx(1.0)
    assert adds["sixdof - kinematic"][1] == "undecided"  # twelve seeds that agree are too few
