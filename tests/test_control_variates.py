"""A cheaper plant as a control variate: means and shares whose truth is planted, and the flights that serve."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from harness.studies.statistics import SCATTERS
from harness.studies.variance_reduction import StudyError, found, page
from harness.verdict.control_variates import LEAST_SAVED, Controlled, Reduced, mean_with, reductions, share_with
from harness.verdict.pairs import CompareError, entered
from tests.builders import fly_matrix, invoke, result, results, write

Array = NDArray[np.float64]
METRIC = "range_error_rms_m"


def drawn(scatter: str, correlation: float, seeds: int, further: int, draws: np.random.Generator) -> Controlled:
    """A mean of zero, and a control of mean zero that goes together with it."""
    x, own = SCATTERS[scatter](draws, (seeds + further,)), SCATTERS[scatter](draws, (seeds,))
    found = mean_with(correlation * x[:seeds] + math.sqrt(1.0 - correlation**2) * own, x[:seeds], x[seeds:])
    assert isinstance(found, Controlled)
    return found


@pytest.mark.parametrize("scatter", ["normal", "skewed to the right", "log-normal"])
@pytest.mark.parametrize("correlation", [0.5, 0.8, 0.95])
def test_the_interval_of_a_mean_holds_the_truth_also_where_only_the_narrower_one_is_told(
    scatter: str, correlation: float
) -> None:
    draws = np.random.default_rng(5)
    found = [drawn(scatter, correlation, 20, 200, draws) for _ in range(400)]
    told = [of.reduced if of.plain.width**2 >= LEAST_SAVED * of.reduced.width**2 else of.plain for of in found]
    for intervals in ([of.reduced for of in found], told):
        assert np.mean([of.low <= 0.0 <= of.high for of in intervals]) >= 0.93
    means = np.array([of.reduced.mean for of in found])
    assert abs(means.mean()) < 3.5 * means.std() / math.sqrt(len(means))  # unbiased


@pytest.mark.parametrize("scatter", ["normal", "skewed to the right", "log-normal"])
def test_where_the_plants_go_together_poorly_it_is_told_seldom_and_is_a_little_too_narrow(scatter: str) -> None:
    draws = np.random.default_rng(5)
    found = [drawn(scatter, 0.5, 20, 200, draws) for _ in range(1000)]
    told = [of.reduced for of in found if of.plain.width**2 >= LEAST_SAVED * of.reduced.width**2]
    assert 0.04 <= len(told) / len(found) <= 0.13
    assert 0.88 <= np.mean([of.low <= 0.0 <= of.high for of in told]) <= 0.93


def test_it_saves_what_theory_says_of_the_correlation() -> None:
    draws = np.random.default_rng(6)
    saved = [
        (of.plain.width / of.reduced.width) ** 2 for of in (drawn("normal", 0.9, 40, 400, draws) for _ in range(99))
    ]
    theory = 1.0 / (1.0 - 0.9**2 + 0.9**2 * 40 / 440)
    assert np.median(saved) == pytest.approx(theory, rel=0.2)


@pytest.mark.parametrize("true", [0.5, 0.9, 0.98])
@pytest.mark.parametrize("alike", [0.5, 0.9, 1.0])
def test_the_interval_of_a_share_holds_the_truth_also_where_every_flight_agrees(true: float, alike: float) -> None:
    draws, holds = np.random.default_rng(7), []
    for _ in range(300):
        x = draws.random(30 + 300) < true
        y = np.where(draws.random(30) < alike, x[:30], draws.random(30) < true)
        found = share_with(y.astype(float), x[:30].astype(float), x[30:].astype(float)).reduced
        holds.append(found.low <= true <= found.high)
    assert np.mean(holds) >= 0.95


@pytest.mark.parametrize(("apart", "seeds"), [(0.4, 20), (0.3, 20), (0.25, 40)])
def test_the_interval_of_a_share_holds_the_truth_where_the_plants_often_disagree(apart: float, seeds: int) -> None:
    """As often the one way as the other: the two shares exclude each other, and are known from the same seeds."""
    draws, holds, further = np.random.default_rng(9), [], 4000
    for _ in range(2000):
        u = draws.random(seeds)
        y, x = u < 0.5, (u < 0.5 - apart) | (u >= 1.0 - apart)
        found = share_with(y.astype(float), x.astype(float), (np.arange(further) % 2).astype(float)).reduced
        holds.append(found.low <= 0.5 <= found.high)
    assert np.mean(holds) >= 0.95 - 3.0 * math.sqrt(0.05 * 0.95 / 2000)


def flights(further: int = 60, agree: float = 0.98, common: int = 20) -> pd.DataFrame:
    """Some seeds on both plants and further ones on the kinematic one; one metric goes together on them."""
    draws = np.random.default_rng(8)
    errors = draws.normal(2.0, 0.5, common + further)
    rows = [result("kinematic", seed, settings={"law.k2": 3.0}) | {METRIC: x} for seed, x in enumerate(errors.tolist())]
    own = agree * errors[:common] + math.sqrt(1.0 - agree**2) * draws.normal(size=common)
    rows += [result("sixdof", seed, settings={"law.k2": 3.0}) | {METRIC: x} for seed, x in enumerate(own.tolist())]
    return results(rows)


def reduced(table: pd.DataFrame, metric: str = METRIC) -> Reduced:
    (found,) = [each for each in reductions(entered(table, 0.25)) if each.metric == metric]
    return found


def test_common_seeds_and_further_ones_are_told_apart_and_what_is_set_otherwise_is_no_control() -> None:
    table = flights()
    found = reduced(table)
    assert (found.plant, found.control, found.seeds, found.further) == ("sixdof", "kinematic", 20, 60)
    assert found.saves
    assert found.cost == pytest.approx(1.0 + 80 / 20)  # each flight of the table takes as long
    assert found.factor_of_time == pytest.approx(found.factor / found.cost)
    table.loc[table["seed"] >= 50, "law.k2"] = 4.0
    assert reduced(table).further == 30
    table.loc[table["seed"] >= 20, "law.k2"] = 4.0
    assert reduced(table).why == "0 further seeds on the cheap plant; 12 are needed"


def test_where_nothing_goes_together_nothing_is_saved() -> None:
    assert not reduced(flights(agree=0.1)).saves


def test_a_number_that_some_flights_lack_is_not_corrected() -> None:
    table = flights()
    table.loc[3, METRIC] = math.nan
    assert reduced(table).seeds == 19  # where the cheap flight does not circle, neither is asked
    table = flights()
    table.loc[(table["plant"] == "sixdof") & (table["seed"] == 3), METRIC] = math.nan
    assert reduced(table).why == "some flights on sixdof have no such number"
    assert "no such number" in reduced(table.assign(convergence_time_s=math.nan), "convergence_time_s").why


def test_without_a_cheaper_plant_it_says_what_is_missing() -> None:
    table = flights()
    with pytest.raises(CompareError, match="fly a cheaper plant"):
        reductions(entered(table[table["plant"] == "sixdof"], 0.25))


def test_the_command_tells_both_intervals_of_real_flights(tmp_path: Path) -> None:
    file = write(
        tmp_path / "m.toml",
        """\
[flight]
plant = "lagged"
duration_s = 30.0
law = { name = "nftsm", gains = "fitted" }
[matrix]
plant = ["kinematic", "lagged"]
"start.heading_deg" = { uniform = [20.0, 90.0] }
seed = { start = 0, count = 12 }
""",
    )
    out = tmp_path / "out"
    fly_matrix(file, out)
    done = invoke("compare", out, "--variance-reduction")
    assert done.exit_code == 0, done.output
    assert "seed={start=FIRST_NEW" in done.stdout
    fly_matrix(file, out, "plant=kinematic", "seed={start=12, count=40}")
    done = invoke("compare", out, "--variance-reduction", "--json")
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)["variance_reduction"]
    known = [each for each in told if each["plain"]]
    assert known
    assert all(each["seeds"] == 12 and each["further_seeds"] == 40 for each in known)
    done = invoke("compare", out, "--variance-reduction", "--csv")
    assert done.exit_code == 2
    summary, *_ = invoke("compare", out, "--variance-reduction").stdout.splitlines()
    saving = [f"{each['factor_of_flights']:.3g}" for each in known if each["factor_of_flights"] >= LEAST_SAVED]
    assert saving
    for option, name in (("--out", "a.html"), ("--markdown", "a.md")):
        done = invoke("report", out, option, tmp_path / name, "--variance-reduction")
        assert done.exit_code == 0, done.output
        _, _, section = (tmp_path / name).read_text().partition("A cheaper plant as a control variate")
        assert summary in section
        assert all(re.search(rf"[>|] ?{re.escape(factor)} ?[<|]", section) for factor in saving)


def test_the_study_tells_by_groups_of_seeds_what_is_saved_and_whether_the_intervals_hold() -> None:
    of = found(flights(common=60))
    assert (of.plant, of.seeds, of.groups, of.further) == ("sixdof", 60, 3, 60)
    (saving,) = [each for each in of.savings if each.metric == METRIC]
    assert saving.factor > LEAST_SAVED
    assert all(each.reduced.low <= saving.truth <= each.reduced.high for each in saving.of)
    (paired,) = [each for each in of.paired if each.metric == METRIC]
    assert paired.factors[0] > LEAST_SAVED
    assert f"| `{METRIC}` |" in page(of, "make variance")
    with pytest.raises(StudyError, match="sixdof has 20 seeds"):
        found(flights())
