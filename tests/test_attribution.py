"""What each rung and each disturbance adds: made-up flights whose answer is known."""

import itertools

import pandas as pd
import pytest

from harness.verdict.attribution import attributions
from harness.verdict.pairs import entered
from tests.builders import QUIET, result, results


def ladder() -> pd.DataFrame:
    """Rungs that add 1, 2 and 3 to a metric, wind that adds 10, turbulence 4 and 9."""
    rungs = ("kinematic", "lagged", "coordinated", "sixdof")
    rows = []
    for i, seed, wind, turbulence in itertools.product(range(4), range(6), (0.0, 5.0), ("none", "light", "moderate")):
        value = (i * (i + 1)) / 2 + 0.1 * seed + 2.0 * wind + {"none": 0.0, "light": 4.0, "moderate": 9.0}[turbulence]
        metrics = {**QUIET, "range_error_rms_m": value}
        rows.append(result(rungs[i], seed, metrics, {"wind.steady_mps": (wind, 0.0), "wind.turbulence": turbulence}))
    return results(rows)


def test_the_rungs_add_up_from_the_first_plant_to_the_last() -> None:
    (one,) = attributions(entered(ladder(), 0.25))
    assert one.rungs == ("kinematic", "lagged", "coordinated", "sixdof")
    assert one.scenarios == 6 * 2 * 3
    error = next(ladder for ladder in one.ladders if ladder.metric == "range_error_rms_m")
    assert [step.effect.mean for step in error.steps] == pytest.approx([1.0, 2.0, 3.0])
    for whole in one.ladders:
        assert whole.start + sum(step.effect.mean for step in whole.steps) == pytest.approx(whole.end)


def test_a_scenario_missing_on_one_rung_is_left_out_on_all() -> None:
    flights = ladder()
    gone = (flights["plant"] == "lagged") & (flights["seed"] == 2)
    (one,) = attributions(entered(flights[~gone], 0.25))
    assert one.scenarios == 5 * 2 * 3
    error = next(ladder for ladder in one.ladders if ladder.metric == "range_error_rms_m")
    assert error.start + sum(step.effect.mean for step in error.steps) == pytest.approx(error.end)


def test_a_rung_that_was_not_flown_is_part_of_the_step_above() -> None:
    flights = ladder()
    (one,) = attributions(entered(flights[flights["plant"].isin(["kinematic", "coordinated"])], 0.25))
    (step,) = one.ladders[0].steps
    assert step.what == "lag of the heading rate, bank and airspeed dynamics"


def test_each_disturbance_adds_what_it_adds_to_the_same_flight_without_it() -> None:
    (one,) = attributions(entered(ladder(), 0.25))
    added = {
        (step.what, step.plant): step.effect.mean for step in one.disturbances if step.metric == "range_error_rms_m"
    }
    for plant in ("kinematic", "sixdof"):
        assert added["wind 5 m/s", plant] == pytest.approx(10.0)
        assert added["turbulence light", plant] == pytest.approx(4.0)
        assert added["turbulence moderate", plant] == pytest.approx(9.0)
