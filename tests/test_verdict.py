"""Pairs and scorecard: made-up flights whose answer is known."""

import itertools
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.margins import Assess
from harness.verdict.attribution import attributions
from harness.verdict.comparison import Comparison, compare
from harness.verdict.pairs import CompareError, axes, entered, plant_pairs, spread
from harness.verdict.scorecard import HOLDS, IF, NOT, UNSHOWN, Cell, conclusion
from harness.verdict.words import answer, breaks_first, lines
from tests.builders import QUIET, SEEDS, result, result_matrix, results, shifted

# Pairs


def test_flights_that_differ_in_the_plant_alone_are_pairs_whatever_their_order() -> None:
    flights = result_matrix({"guidance_period_s": [0.05, 0.5]}).sample(frac=1.0, random_state=1)
    paired = plant_pairs(flights, "kinematic")
    assert len(paired) == 2 * SEEDS
    assert not len(paired.unpaired)
    for column in ("seed", "guidance_period_s", "start.heading_deg"):
        assert list(paired.reference[column]) == list(paired.other[column])


def test_a_flight_without_partner_and_a_failed_one_are_listed_with_what_they_are_set_to() -> None:
    flights = result_matrix()
    flights = flights.drop(index=flights.index[(flights["plant"] == "kinematic") & (flights["seed"] == 3)])
    flights.loc[(flights["plant"] == "sixdof") & (flights["seed"] == 5), "outcome"] = "worker_died"
    found = compare(flights, Assess())
    assert len(found.pairs) == SEEDS - 2
    assert {left.settings["seed"] for left in found.unpaired} == {3, 5}
    assert len(found.unpaired) == 2
    (failed,) = found.failed
    assert (failed.outcome, failed.settings["seed"]) == ("worker_died", 5)
    text = "\n".join(lines(found))
    assert "2 flights without a partner:" in text
    assert "1 flight in no pair, since failed:" in text


@pytest.mark.parametrize(
    ("flights", "told"),
    [
        (results([result("sixdof")]), "1 flight in all: a comparison takes at least two"),
        (results([result("sixdof", 0), result("sixdof", 1)]), "no flight has the baseline's plant, 'kinematic'"),
        (results([result("kinematic", 0), result("kinematic", 1)]), "all 2 flights have plant 'kinematic'"),
        (
            results([result("kinematic"), result("sixdof", settings={"aircraft": "skywalker_x8"})]),
            "differs from the nearest of 'kinematic' in aircraft too",
        ),
        (
            results([result("kinematic"), {**result("sixdof"), "outcome": "timeout"}]),
            "no flight of plant 'kinematic', or none of another, ended in a result",
        ),
    ],
)
def test_what_is_missing_for_a_comparison_is_said(flights: pd.DataFrame, told: str) -> None:
    with pytest.raises(CompareError) as raised:
        plant_pairs(flights, "kinematic")
    assert told in str(raised.value)


def test_a_lost_flight_enters_with_the_worst_and_an_unconverged_one_with_its_duration() -> None:
    lost = {**QUIET, "convergence_time_s": 20.0, "range_error_rms_m": 3.0, "turn_ratio": 0.99}
    rows = [
        result("kinematic", 0),
        result("sixdof", 0, {**QUIET, "convergence_time_s": math.nan, "range_error_rms_m": 50.0, "turn_ratio": 0.8}),
        {**result("sixdof", 1, lost), "outcome": "departed"},
    ]
    table_ = entered(results(rows), 0.25)
    assert list(table_["convergence_time_s"]) == [40.0, 100.0, 100.0]
    assert list(table_["converged"]) == [True, False, False]
    gone = table_.loc[2]
    assert gone["range_error_rms_m"] == 50.0
    assert gone["saturation_fraction"] == 1.0
    assert gone["turn_ratio"] == 0.8


def test_a_lost_flight_gets_no_metric_that_its_plant_does_not_have() -> None:
    without = {**QUIET, "sideslip_rms_deg": math.nan}
    rows = [
        {**result("kinematic", 0, without), "outcome": "target_lost"},
        result("sixdof", 0, {**QUIET, "sideslip_rms_deg": 9.0}),
    ]
    assert math.isnan(entered(results(rows), 0.25)["sideslip_rms_deg"][0])


def test_what_is_set_is_an_axis_and_what_is_drawn_or_follows_is_none() -> None:
    flights = result_matrix({"law.max_heading_rate_deg_s": [20.0, 5.0], "law.gains": ["paper", "paper_1"]})
    flights["law.alpha2"] = flights["law.gains"].map({"paper": 0.5, "paper_1": 2.0})
    speed = flights["law.max_heading_rate_deg_s"].map({5.0: 0.0, 20.0: 4.0})
    angle = np.radians(30.0 * flights["seed"])
    flights["wind.steady_mps"] = list(zip(speed * np.cos(angle), speed * np.sin(angle), strict=True))
    assert axes(spread(flights)) == {
        "law": ["smc paper", "smc paper_1"],
        "law.max_heading_rate_deg_s": [5.0, 20.0],
    }  # the wind's speed follows the limit, its direction and the heading are drawn
    severities = result_matrix({"wind.turbulence": ["severe", "none", "moderate"]})
    assert axes(severities) == {"wind.turbulence": ["none", "moderate", "severe"]}


# The scorecard


def cells(passing: Mapping[tuple[Any, ...], bool], names: tuple[str, ...], beyond: bool = True) -> list[Cell]:
    bounds = (None, 1.0)
    return [
        Cell(dict(zip(names, at, strict=True)), 5, 0.5 if ok or not beyond else 2.0, bounds, 0.01, 0, False, ok)
        for at, ok in passing.items()
    ]


LIMITS: dict[str, list[object]] = {"limit": [5.0, 10.0, 20.0]}


@pytest.mark.parametrize(
    ("passing", "verdict", "condition"),
    [
        ([True, True, True], HOLDS, ""),
        ([True, True, False], IF, "limit <= 10"),
        ([True, False, False], IF, "limit <= 5"),
        ([False, True, True], IF, "limit >= 10"),
        ([False, True, False], IF, "limit = 10"),
        ([True, False, True], IF, "limit <= 5"),
        ([False, False, False], NOT, ""),
    ],
)
def test_holds_if_is_the_largest_interval_in_which_every_cell_passes(
    passing: list[bool], verdict: str, condition: str
) -> None:
    at = {(value,): ok for value, ok in zip(LIMITS["limit"], passing, strict=True)}
    assert conclusion(cells(at, ("limit",)), LIMITS) == (verdict, condition)


def test_an_inner_interval_has_two_ends() -> None:
    across: dict[str, list[object]] = {"limit": [1.0, 2.0, 3.0, 4.0, 5.0]}
    at = {(v,): v in (2.0, 3.0, 4.0) for v in across["limit"]}
    assert conclusion(cells(at, ("limit",)), across) == (IF, "2 <= limit <= 4")


def test_one_failing_cell_bars_a_value_and_the_axis_that_saves_most_cells_is_named() -> None:
    across: dict[str, list[object]] = {**LIMITS, "law": ["a", "b"]}
    at = {(limit, law): law == "a" or limit == 5.0 for limit in LIMITS["limit"] for law in ("a", "b")}
    assert conclusion(cells(at, ("limit", "law")), across) == (IF, "law is a")
    at[(10.0, "a")] = False
    assert conclusion(cells(at, ("limit", "law")), across) == (IF, "limit <= 5")
    at[(5.0, "b")] = False
    assert conclusion(cells(at, ("limit", "law")), across) == (NOT, "")


@given(passing=st.lists(st.booleans(), min_size=1, max_size=7))
def test_no_stretch_that_passes_is_longer_than_the_one_named(passing: list[bool]) -> None:
    values: list[object] = [float(i) for i in range(len(passing))]
    at = {(value,): ok for value, ok in zip(values, passing, strict=True)}
    verdict, condition = conclusion(cells(at, ("x",)), {"x": values})
    longest = max((len(list(run)) for ok, run in itertools.groupby(passing) if ok), default=0)
    assert verdict == (HOLDS if all(passing) else IF if longest else NOT)
    if verdict == IF:
        python = condition if {"<", ">"} & set(condition) else condition.replace("=", "==")
        named = [ok for value, ok in zip(values, passing, strict=True) if eval(python, {"x": value})]
        assert named == [True] * longest


def test_severities_have_an_order_and_words_have_none() -> None:
    across: dict[str, list[object]] = {"turbulence": ["none", "light", "moderate"]}
    at = {("none",): True, ("light",): True, ("moderate",): False}
    assert conclusion(cells(at, ("turbulence",)), across) == (IF, "turbulence <= light")
    words: dict[str, list[object]] = {"law": ["a", "b", "c"]}
    assert conclusion(cells({("a",): True, ("b",): False, ("c",): True}, ("law",)), words) == (IF, "law is a or c")


def test_a_condition_says_at_what_else_alone_its_cells_were_flown() -> None:
    """Radii were flown at the highest limit, the long period at the lowest and in still air."""
    names = ("limit", "radius", "period", "wind_speed_mps")
    at = {
        (5.0, 200.0, 0.05, 0.0): False, (5.0, 200.0, 0.2, 0.0): True, (5.0, 200.0, 0.05, 2.0): False,
        (20.0, 200.0, 0.05, 2.0): False, (20.0, 60.0, 0.05, 0.0): False,
    }  # fmt: skip
    across = {name: list[object](sorted({v[i] for v in at})) for i, name in enumerate(names)}
    assert conclusion(cells(at, names), across) == (
        IF,
        "period >= 0.2, flown only at limit = 5, radius = 200, undisturbed",
    )


def test_undecided_cells_alone_do_not_refute() -> None:
    at = {(value,): False for value in LIMITS["limit"]}
    assert conclusion(cells(at, ("limit",), beyond=False), LIMITS) == (UNSHOWN, "")


def found(flights: pd.DataFrame) -> Comparison:
    return compare(flights, Assess())


def test_equal_plants_hold_in_every_part() -> None:
    (card,) = found(result_matrix()).scorecards
    assert {finding.verdict for finding in card.findings} == {HOLDS, "not measured"}  # SMC has no k2
    assert breaks_first(card) is None


def test_a_part_holds_if_the_limit_is_low_enough() -> None:
    flights = result_matrix({"law.max_heading_rate_deg_s": [5.0, 10.0, 20.0]})
    for limit, sideslip in ((5.0, 0.5), (10.0, 1.5), (20.0, 4.0)):
        flights = shifted(flights, "sideslip_rms_deg", sideslip, where={"law.max_heading_rate_deg_s": limit})
    (card,) = found(flights).scorecards
    sideslip_found = card.finding("sideslip")
    assert (sideslip_found.verdict, sideslip_found.condition) == (IF, "law.max_heading_rate_deg_s <= 10")
    assert sideslip_found.effect.mean == pytest.approx(2.0, abs=0.05)
    assert (sideslip_found.passed, sideslip_found.effect.pairs, sideslip_found.effect.seeds) == (2, 3 * SEEDS, SEEDS)
    assert sideslip_found.worst is not None
    assert sideslip_found.worst.at == {"law.max_heading_rate_deg_s": 20.0}
    assert breaks_first(card) is sideslip_found
    said = answer(found(flights))
    assert len(said) == 3
    assert said[1].startswith("What breaks first? Zero sideslip fails on ultra_stick_25e in 1 of 3 cells (at worst +4")
    assert said[1].endswith(
        "not if law.max_heading_rate_deg_s <= 10), where at most 2 is asked, furthest out on ultra_stick_25e at "
        "law.max_heading_rate_deg_s = 20."
    )


def test_a_difference_within_the_margin_that_scatters_too_much_is_not_shown() -> None:
    (card,) = found(shifted(result_matrix(), "range_error_rms_m", 1.0, scatter=5.0)).scorecards
    assert card.finding("settled_error").verdict == UNSHOWN
    assert breaks_first(card) is None  # what is not shown is not broken
    (card,) = found(shifted(result_matrix(), "range_error_rms_m", 1.0, scatter=0.5)).scorecards
    assert card.finding("settled_error").verdict == HOLDS


def test_holm_makes_a_lonely_test_harder_in_company() -> None:
    """Ten cells of one part, and ten of another that are less clear: the same p-value counts twenty times."""
    few = shifted(result_matrix(), "range_error_rms_m", 1.5, scatter=0.5)
    (card,) = found(few).scorecards
    alone = card.finding("settled_error").cells[0].p
    many = result_matrix({"guidance_period_s": [0.05 + 0.05 * i for i in range(10)]})
    many = shifted(shifted(many, "range_error_rms_m", 1.5, scatter=0.5), "sideslip_rms_deg", 1.9, scatter=0.4)
    (card,) = found(many).scorecards
    company = card.finding("settled_error").cells[0].p
    assert alone is not None
    assert company is not None
    assert 0.001 < alone < 0.05
    assert company == pytest.approx(20 * alone)


def test_lost_flights_count_against_every_part_of_their_cell() -> None:
    flights = result_matrix({"wind.turbulence": ["none", "severe"]})
    lost = (flights["plant"] == "sixdof") & (flights["wind.turbulence"] == "severe") & (flights["seed"] < 3)
    flights.loc[lost, "outcome"] = "departed"
    (card,) = found(flights).scorecards
    assert card.lost.number == 3
    assert (card.finding("alive").verdict, card.finding("alive").condition) == (IF, "wind.turbulence is none")
    for finding in card.findings:
        if finding.cells and finding.part.name != "reach":  # that one is about settings
            assert (finding.verdict, finding.condition) == (IF, "wind.turbulence is none"), finding.part.name
    assert card.finding("convergence_time").effect.pairs == 2 * SEEDS


def test_convergence_is_compared_by_who_converges_alone() -> None:
    flights = result_matrix()
    never = (flights["plant"] == "sixdof") & (flights["seed"] < 6)
    flights.loc[never, "convergence_time_s"] = np.nan
    (card,) = found(flights).scorecards
    assert card.alone == (6, 0)
    assert card.convergence_p == pytest.approx(2 * 0.5**6)
    assert card.finding("convergence").verdict == NOT
    assert card.finding("convergence_time").effect.mean == pytest.approx(0.5 * 60.0)  # censored at 100 s


def test_where_neither_converges_the_time_says_nothing() -> None:
    flights = result_matrix()
    flights.loc[flights["seed"] < 6, "convergence_time_s"] = np.nan
    (card,) = found(flights).scorecards
    assert card.finding("convergence_time").effect.pairs == SEEDS - 6
    assert card.finding("convergence").verdict == HOLDS


def test_where_the_law_does_not_circle_on_the_baseline_the_cost_says_nothing() -> None:
    """Half of the seeds fly away on every plant, each to somewhere else; the assumption's own parts count there too."""
    flights = shifted(result_matrix(), "range_error_rms_m", 1.0)
    away = flights["seed"] < 6
    flights.loc[away, "range_error_rms_m"] = 51.0 + 100.0 * (flights["plant"] == "sixdof")
    flights.loc[away, "convergence_time_s"] = np.nan
    (card,) = found(flights).scorecards
    assert card.finding("settled_error").effect.pairs == SEEDS - 6
    assert card.finding("settled_error").effect.mean == pytest.approx(1.0, abs=0.02)
    assert card.finding("sideslip").effect.pairs == SEEDS
    assert card.converged[0].of == SEEDS
    (one,) = attributions(entered(flights, 0.25))
    assert one.scenarios == SEEDS - 6
    assert "6 of the pairs say nothing of the cost: the law does not circle" in "\n".join(lines(found(flights)))
    flights.loc[away & (flights["plant"] == "kinematic"), "range_error_rms_m"] = 50.0  # a quarter of the 200 m
    (card,) = found(flights).scorecards
    assert card.finding("settled_error").effect.pairs == SEEDS  # one that leaves the circle of the baseline costs


def test_where_no_flight_converges_convergence_is_not_measured() -> None:
    flights = result_matrix({"law.name": ["smc", "nftsm"]})
    flights.loc[flights["law.name"] == "smc", "convergence_time_s"] = np.nan
    (card,) = found(flights).scorecards
    (cell,) = card.finding("convergence").cells
    assert cell.at == {"law": "nftsm paper"}


def test_one_flight_each_is_one_difference_without_interval() -> None:
    flights = result_matrix()
    flights = shifted(flights[flights["seed"] == 0], "sideslip_rms_deg", 1.0, scatter=0.0)
    (card,) = found(flights).scorecards
    sideslip = card.finding("sideslip")
    assert sideslip.effect.mean == pytest.approx(1.0)
    assert sideslip.effect.low is None
    assert "one seed" in sideslip.effect.why
    assert sideslip.verdict == HOLDS
    assert "No interval (one seed: nothing was drawn): " in "\n".join(lines(found(flights)))


def test_the_bank_limit_is_the_airframes() -> None:
    """At 33 deg/s and 13 m/s the relation asks for 37.4 deg; the Ultra Stick's inner loop stops at 46."""
    flights = result_matrix({"law.max_heading_rate_deg_s": [5.0, 33.0, 50.0]})
    (card,) = found(flights).scorecards
    reach = card.finding("reach")
    needed = [math.degrees(math.atan(13.0 * math.radians(limit) / 9.80665)) for limit in (5.0, 33.0, 50.0)]
    limit = math.degrees(0.8)
    assert [cell.mean for cell in reach.cells] == pytest.approx([n - limit for n in needed], abs=0.1)
    assert (reach.verdict, reach.condition) == (IF, "law.max_heading_rate_deg_s <= 33")
