"""Pairs, words and conditions: made-up flights whose answer is known."""

import math
from collections.abc import Mapping
from itertools import product

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.margins import Assess
from harness.verdict.comparison import Comparison, Scorecard, compare_flights
from harness.verdict.conditions import conclude
from harness.verdict.judgement import Judgement
from harness.verdict.pairs import CompareError, axes, entered, pairs_by, spread
from harness.verdict.parts import PARTS
from harness.verdict.statistics import LEAST_EQUAL
from harness.verdict.text import lines
from harness.vocabulary import Verdict
from tests.builders import QUIET, SEEDS, result, result_matrix, results, shifted


def compared(flights: pd.DataFrame) -> Comparison:
    return compare_flights(flights, Assess())


def card_of(flights: pd.DataFrame) -> Scorecard:
    (card,) = compared(flights).scorecards
    return card


# Pairs


def test_flights_that_differ_in_the_plant_alone_are_pairs_whatever_their_order() -> None:
    flights = entered(result_matrix({"guidance_period_s": [0.05, 0.5]}), 0.25).sample(frac=1.0, random_state=1)
    paired = pairs_by(flights, "plant", "kinematic")
    assert len(paired) == 2 * SEEDS
    assert not len(paired.unpaired)
    for column in ("seed", "guidance_period_s", "start.heading_deg"):
        assert list(paired.reference[column]) == list(paired.other[column])


def test_a_new_column_of_results_breaks_no_pair() -> None:
    flights = result_matrix()
    flights["fuel_used_kg"] = np.arange(len(flights), dtype=float)
    assert len(compared(flights).pairs) == SEEDS


def test_a_flight_without_partner_and_a_failed_one_are_listed_with_what_they_are_set_to() -> None:
    flights = result_matrix()
    flights = flights.drop(index=flights.index[(flights["plant"] == "kinematic") & (flights["seed"] == 3)])
    flights.loc[(flights["plant"] == "sixdof") & (flights["seed"] == 5), "outcome"] = "worker_died"
    found = compared(flights)
    assert len(found.pairs) == SEEDS - 2
    without = [flight for flight in found.unpaired if flight.why == "without a partner"]
    failed = [flight for flight in found.unpaired if flight.why == "failed"]
    assert [flight.settings["seed"] for flight in without] == [5, 3]
    assert [(flight.outcome, flight.settings["seed"]) for flight in failed] == [("worker_died", 5)]
    assert "3 flights could not be compared:" in "\n".join(lines(found))


@pytest.mark.parametrize(
    ("flights", "message"),
    [
        (results([result("sixdof")]), "1 flight in all: a comparison takes at least two"),
        (
            results([result("sixdof", 0), result("sixdof", 1)]),
            "all 2 flights have plant = sixdof: add another value to the matrix, or compare another setting: --by",
        ),
        (results([result("kinematic", 0), result("kinematic", 1)]), "all 2 flights have plant = kinematic"),
        (
            results([result("kinematic"), result("sixdof", settings={"aircraft": "skywalker_x8"})]),
            "differs from the nearest of the baseline in aircraft too",
        ),
        (
            results([result("kinematic"), {**result("sixdof"), "outcome": "timeout"}]),
            "no flight with the baseline's plant, or none with another, ended in a result",
        ),
    ],
)
def test_what_is_missing_for_a_comparison_is_said(flights: pd.DataFrame, message: str) -> None:
    with pytest.raises(CompareError, match=message):
        compared(flights)


def test_a_lost_flight_is_no_data_and_has_no_convergence_time() -> None:
    table = entered(results([result("kinematic"), {**result("sixdof"), "outcome": "departed"}]), 0.25)
    last = table.iloc[1]
    assert (last["lost"], last["converged"]) == (1.0, 0.0)
    assert all(math.isnan(last[name]) for name in QUIET if name in table)


def test_what_is_set_is_an_axis_and_what_is_drawn_or_follows_is_none() -> None:
    flights = result_matrix({"law.max_heading_rate_deg_s": [20.0, 5.0], "law.gains": ["paper", "paper_1"]})
    flights["law.alpha2"] = flights["law.gains"].map({"paper": 0.5, "paper_1": 2.0})
    speed = flights["law.max_heading_rate_deg_s"].map({5.0: 0.0, 20.0: 4.0})
    angle = np.radians(30.0 * flights["seed"])
    flights["wind.steady_mps"] = list(zip(speed * np.cos(angle), speed * np.sin(angle), strict=True))
    assert axes(spread(flights), ("plant",)) == {
        "law": ["smc paper", "smc paper_1"],
        "law.max_heading_rate_deg_s": [5.0, 20.0],
    }  # the wind's speed follows the limit, its direction and the heading are drawn
    severities = result_matrix({"wind.turbulence": ["severe", "none", "moderate"]})
    assert axes(spread(severities), ("plant",)) == {"wind.turbulence": ["none", "moderate", "severe"]}


# Words


def repeated(flights: pd.DataFrame, times: int) -> pd.DataFrame:
    """The same flights with so many times the seeds, each with a start of its own."""
    found = pd.concat(
        flights.assign(seed=flights["seed"] + i * SEEDS, key=flights["key"] + f"-{i}") for i in range(times)
    )
    found["start.heading_deg"] = 30.0 + found["seed"]
    return found.reset_index(drop=True)


def words_of(flights: pd.DataFrame) -> dict[str, Verdict]:
    card = card_of(flights)
    return {part.column: card.conclusion(part.column).word for part in card.parts}


def test_equal_plants_differ_in_nothing_and_enough_equal_seeds_hold() -> None:
    flights = result_matrix()
    drawn = [j for j in card_of(flights).judgements if j.column not in PARTS or PARTS[j.column].drawn]
    assert {judgement.word for judgement in drawn} == {Verdict.UNDECIDED}  # 12 seeds that agree are too few
    assert 2 * SEEDS >= LEAST_EQUAL
    two = words_of(repeated(flights, 2))
    assert {column for column, word in two.items() if word != HOLD} == {"chatters", "lost", "converged"}
    assert set(words_of(repeated(flights, 8)).values()) == {HOLD}  # 96 seeds


def test_a_share_of_no_flight_is_shown_to_lie_within_its_margin_by_as_many_seeds_as_the_binomial_asks() -> None:
    """Three such parts are one family: 0.95^94 is below 0.025 / 3, 0.95^93 is not."""
    for seeds, word in ((93, OPEN), (94, HOLD)):
        flights = repeated(result_matrix(), 8)
        words = words_of(flights[flights["seed"] < seeds])
        assert [words[column] for column in ("chatters", "lost", "converged")] == 3 * [word]
    two = {j.column: j for j in card_of(repeated(result_matrix(), 2)).judgements}
    cycle, lost = two["chatters"], two["lost"]
    assert (cycle.why, cycle.seeds_needed) == ("0 of 24 seeds: at most 14.2 %", 94)
    assert (lost.why, lost.seeds_needed) == ("0 of 24 seeds differ: at most 14.2 %", 94)
    assert cycle.low == 0.0
    assert cycle.high == pytest.approx(1.0 - 0.025 ** (1.0 / 24.0))
    assert (lost.low, lost.high) == (-cycle.high, cycle.high)


def test_a_limit_cycle_in_every_flight_fails_by_the_seeds_that_show_it_and_without_draws_by_one() -> None:
    flights = result_matrix()
    flights.loc[flights["plant"] == "sixdof", "chatters"] = 1.0
    for seeds, word in ((1, OPEN), (3, FAIL)):  # with a margin of 5 %: 2 x 0.05, and 2 x 0.05^3
        (cycle,) = card_of(flights[flights["seed"] < seeds].assign(**{"wind.turbulence": "light"})).of("chatters")
        assert cycle.word == word
    flights["start.heading_deg"] = 30.0
    (cycle,) = card_of(flights[flights["seed"] == 0]).of("chatters")
    assert (cycle.word, cycle.low, cycle.high) == (FAIL, 1.0, 1.0)


@pytest.mark.parametrize(
    ("bounds", "difference", "use"),
    [
        ((None, 0.0), -0.1, 0.0),
        ((None, 0.0), 0.0, 0.0),
        ((None, 0.0), 0.1, math.inf),
        ((-0.0, 0.0), 0.0, 0.0),
        ((-0.0, 0.0), -0.1, math.inf),
        ((None, 0.05), -0.1, -2.0),
        ((-0.05, 0.05), -0.1, 2.0),
        ((5.0, None), 10.0, 0.5),
    ],
)
def test_a_bound_of_zero_is_used_up_by_what_lies_beyond_it_alone(
    bounds: tuple[float | None, float | None], difference: float, use: float
) -> None:
    judgement = Judgement("lost", "sixdof", {}, 5, 5, 0, 0.0, 0.0, difference, 0.0, 0.0, bounds)
    assert judgement.use == pytest.approx(use)


def test_a_word_needs_evidence_in_its_direction() -> None:
    for by, scatter, word in ((1.0, 0.2, HOLD), (1.0, 3.0, OPEN), (4.0, 0.2, FAIL)):
        (judgement,) = card_of(shifted(result_matrix(), "range_error_rms_m", by, scatter=scatter)).of(
            "range_error_rms_m"
        )
        assert judgement.word == word
        assert (judgement.seeds_needed is not None) is (word == OPEN)


def test_without_draws_one_flight_is_a_number() -> None:
    flights = result_matrix()
    flights["start.heading_deg"] = 30.0
    one = shifted(flights[flights["seed"] == 0].copy(), "sideslip_rms_deg", 1.0, scatter=0.0)
    (judgement,) = card_of(one).of("sideslip_rms_deg")
    assert (judgement.word, judgement.low, judgement.high, judgement.seeds) == (Verdict.HOLDS, 1.0, 1.0, 1)


def test_one_seed_of_turbulence_shows_nothing() -> None:
    flights = result_matrix({"wind.turbulence": ["moderate"]})
    (judgement,) = card_of(flights[flights["seed"] == 0]).of("sideslip_rms_deg")
    assert (judgement.word, judgement.why) == (Verdict.UNDECIDED, "1 seed; 5 are needed")


def test_lost_flights_count_against_their_cell_and_never_as_data() -> None:
    flights = shifted(result_matrix({"wind.turbulence": ["none", "severe"]}), "range_error_rms_m", 0.5, scatter=0.1)
    lost = (flights["plant"] == "sixdof") & (flights["wind.turbulence"] == "severe") & (flights["seed"] < 3)
    flights.loc[lost, "outcome"] = "departed"
    flights.loc[lost, "range_error_rms_m"] = 999.0
    card = card_of(flights)
    assert (card.lost.number, card.lost.of) == (3, 2 * SEEDS)
    calm, severe = card.of("range_error_rms_m")
    assert (calm.word, severe.word) == (Verdict.HOLDS, Verdict.UNDECIDED)
    assert severe.why == "3 of 12 flights ended early"
    assert severe.difference == pytest.approx(0.5, abs=0.2)
    text = "\n".join(lines(compared(flights)))
    assert "3 of 24 flights with plant = sixdof ended early: 3 departed." in text


def test_flights_lost_on_both_plants_are_told_of_both_before_anything_else() -> None:
    flights = result_matrix()
    flights["outcome"] = "target_lost"
    answer = compared(flights).answer
    compared_, *said = answer.splitlines()
    assert compared_.startswith("Compared: ")
    assert said[:3] == [
        "12 of 12 flights with plant = kinematic ended early: 12 target_lost.",
        "12 of 12 flights with plant = sixdof ended early: 12 target_lost.",
        "",
    ]
    assert "constant airspeed" not in answer
    assert "does not circle" not in answer  # another cause
    assert Verdict.FAILS not in {judgement.word for judgement in card_of(flights).judgements}  # it costs no flight more
    (last,) = card_of(flights).of("lost")
    assert (last.word, last.difference, last.why) == (OPEN, 0.0, "12 of 12 flights of the baseline ended early")


def test_a_convergence_time_is_of_pairs_that_both_converge_and_holds_only_where_all_do() -> None:
    flights = shifted(result_matrix(), "convergence_time_s", 1.0, scatter=0.1)
    (judgement,) = card_of(flights).of("convergence_time_s")
    assert (judgement.word, judgement.pairs) == (Verdict.HOLDS, SEEDS)
    flights.loc[(flights["plant"] == "sixdof") & (flights["seed"] < 2), "convergence_time_s"] = math.nan
    (judgement,) = card_of(flights).of("convergence_time_s")
    assert (judgement.word, judgement.pairs) == (Verdict.UNDECIDED, SEEDS - 2)
    assert judgement.why == "in 2 pairs only the reference converges, in 0 only the other"
    assert judgement.difference == pytest.approx(1.0, abs=0.2)  # not the 60 s at which the flights end


def test_where_the_law_does_not_circle_on_the_baseline_the_cost_says_nothing() -> None:
    flights = shifted(result_matrix(), "range_error_rms_m", 1.0)
    away = flights["seed"] < 6
    flights.loc[away, "range_error_rms_m"] = 51.0 + 100.0 * (flights["plant"] == "sixdof")
    (error,) = card_of(flights).of("range_error_rms_m")
    (sideslip,) = card_of(flights).of("sideslip_rms_deg")
    assert (error.pairs, sideslip.pairs) == (SEEDS - 6, SEEDS)
    assert error.difference == pytest.approx(1.0, abs=0.02)


def test_where_the_baseline_does_not_go_round_its_target_the_cost_says_nothing() -> None:
    """Held up by the wind, with a small range error: it does not circle."""
    flights = shifted(result_matrix(), "range_error_rms_m", 1.0)
    flights.loc[flights["seed"] < 6, "goes_round"] = 0.0
    (error,) = card_of(flights).of("range_error_rms_m")
    assert error.pairs == SEEDS - 6
    older = flights.drop(columns=["goes_round", "laps"])
    assert card_of(older).of("range_error_rms_m")[0].pairs == SEEDS


def test_holm_makes_a_lonely_test_harder_in_company() -> None:
    alone = shifted(result_matrix(), "range_error_rms_m", 1.2, scatter=0.3)
    (judgement,) = card_of(alone).of("range_error_rms_m")
    assert judgement.word == Verdict.HOLDS
    many = result_matrix({"guidance_period_s": [0.05 + 0.05 * i for i in range(40)]})
    many = shifted(shifted(many, "range_error_rms_m", 1.2, scatter=0.3), "sideslip_rms_deg", 1.9, scatter=0.4)
    word = card_of(many).of("range_error_rms_m")[0]
    assert word.word == Verdict.UNDECIDED
    assert "shown as the only test, not as one of" in word.why


def test_without_a_margin_a_difference_is_lower_or_higher_where_its_interval_excludes_zero() -> None:
    for by, scatter, word in ((-1.0, 0.1, "lower"), (1.0, 0.1, "higher"), (0.01, 1.0, Verdict.UNDECIDED)):
        flights = shifted(result_matrix(), "heading_rate_error_rms_deg_s", by, scatter=scatter)
        (judgement,) = card_of(flights).of("heading_rate_error_rms_deg_s")
        assert judgement.word == word


def test_any_setting_can_be_compared_and_only_consequences_have_margins_then() -> None:
    flights = result_matrix({"law.gains": ["paper", "paper_1"]})
    flights["law.alpha2"] = flights["law.gains"].map({"paper": 0.5, "paper_1": 2.0})  # follows the set
    flights.loc[flights["law.gains"] == "paper_1", "range_error_rms_m"] = 5.0
    comparison = compare_flights(flights, Assess(), "law.gains", "paper")
    assert len(comparison.pairs) == 2 * SEEDS
    (card,) = comparison.scorecards
    assert {part.column for part in card.parts}.isdisjoint({"sideslip_rms_deg", "turn_ratio"})
    assert "range_error_rms_m" in {part.column for part in card.parts}
    assert list(comparison.axes) == ["plant"]


def test_the_frames_have_the_columns_of_the_contract() -> None:
    flights = shifted(result_matrix({"law.max_heading_rate_deg_s": [5.0, 20.0]}), "sideslip_rms_deg", 1.0)
    comparison = compared(flights)
    differences = comparison.differences
    assert {"metric", "value", "law.max_heading_rate_deg_s", "pairs", "seeds", "difference", "low", "high",
            "verdict"} <= set(differences.columns)  # fmt: skip
    assert list(comparison.conditions.columns[:2]) == ["metric", "value"]
    row = differences[(differences["metric"] == "sideslip_rms_deg")].iloc[0]
    assert row["low"] < row["difference"] < row["high"]
    assert set(differences["verdict"]) <= {"holds", "fails", "undecided", "lower", "higher"}


# Conditions

LIMITS: Mapping[str, list[object]] = {"limit": [5.0, 10.0, 20.0]}
HOLD, FAIL, OPEN = Verdict.HOLDS, Verdict.FAILS, Verdict.UNDECIDED


def cells(words: Mapping[tuple[object, ...], Verdict], names: tuple[str, ...]) -> list[Judgement]:
    return [
        Judgement("range_error_rms_m", "sixdof", dict(zip(names, at, strict=True)), 5, 5, 0, 0.0, 0.0, 0.0, 0.0, 0.0,
                  (-2.0, 2.0), word)
        for at, word in words.items()
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("words", "verdict", "condition"),
    [
        ([HOLD, HOLD, HOLD], Verdict.HOLDS, None),
        ([HOLD, OPEN, HOLD], Verdict.UNDECIDED, None),
        ([OPEN, FAIL, FAIL], Verdict.FAILS, None),
        ([HOLD, HOLD, FAIL], Verdict.HOLDS_IF, "limit = 5 to 10"),
        ([HOLD, FAIL, FAIL], Verdict.HOLDS_IF, "limit = 5"),
        ([FAIL, HOLD, HOLD], Verdict.HOLDS_IF, "limit = 10 to 20"),
        ([FAIL, HOLD, FAIL], Verdict.HOLDS_IF, "limit = 10"),
        ([HOLD, OPEN, FAIL], Verdict.HOLDS_IF, "limit = 5 to 10"),
    ],
)
def test_a_condition_is_a_stretch_of_flown_values(
    words: list[Verdict], verdict: Verdict, condition: str | None
) -> None:
    at: dict[tuple[object, ...], Verdict] = {(value,): word for value, word in zip(LIMITS["limit"], words, strict=True)}
    conclusion = conclude(cells(at, ("limit",)), LIMITS)
    assert conclusion.word == verdict
    assert (conclusion.condition.text if conclusion.condition else None) == condition


def test_a_condition_of_two_axes_is_found() -> None:
    across: Mapping[str, list[object]] = {**LIMITS, "law": ["a", "b"]}
    at: dict[tuple[object, ...], Verdict] = {
        (limit, law): HOLD if limit in (5.0, 10.0) and law == "a" else FAIL for limit, law in product(*across.values())
    }
    conclusion = conclude(cells(at, ("limit", "law")), across)
    assert conclusion.condition is not None
    assert conclusion.condition.text == "limit = 5 to 10 and law = a"


def test_an_axis_that_varies_with_the_cause_is_not_named() -> None:
    """The long period was flown at the lowest limit alone: what holds there holds by the limit, or by the period."""
    names = ("limit", "period")
    across: Mapping[str, list[object]] = {"limit": [5.0, 20.0], "period": [0.05, 0.2]}
    conclusion = conclude(cells({(5.0, 0.2): HOLD, (20.0, 0.05): FAIL}, names), across)
    assert (conclusion.word, conclusion.condition) == (Verdict.FAILS, None)
    assert set(conclusion.confounded) == {"limit", "period"}
    assert {tuple(cell.values()) for cell in conclusion.missing} == {(5.0, 0.05), (20.0, 0.2)}
    matched = conclude(cells({(5.0, 0.2): HOLD, (20.0, 0.05): FAIL, (5.0, 0.05): HOLD}, names), across)
    assert matched.condition is not None
    assert matched.condition.text == "limit = 5"


@given(words=st.lists(st.sampled_from([HOLD, FAIL, OPEN]), min_size=2, max_size=6))
def test_no_cell_within_a_condition_has_the_opposite_word(words: list[Verdict]) -> None:
    values: list[object] = [float(i) for i in range(len(words))]
    at: dict[tuple[object, ...], Verdict] = {(value,): word for value, word in zip(values, words, strict=True)}
    judgements = cells(at, ("x",))
    conclusion = conclude(judgements, {"x": values})
    if (named := conclusion.condition) is not None:
        inside = [judgement.word for judgement in judgements if named.covers(judgement.at)]
        assert named.word in inside
        assert (FAIL if named.word is HOLD else HOLD) not in inside


def test_flights_that_would_tell_two_axes_apart_are_printed_as_options() -> None:
    flights = result_matrix({"law.max_heading_rate_deg_s": [5.0, 20.0], "guidance_period_s": [0.05, 0.2]})
    together = (flights["law.max_heading_rate_deg_s"] == 5.0) == (flights["guidance_period_s"] == 0.2)
    flights = flights[together]
    flights = shifted(flights, "sideslip_rms_deg", 5.0, where={"law.max_heading_rate_deg_s": 20.0})
    flights = shifted(flights, "sideslip_rms_deg", 0.5, where={"law.max_heading_rate_deg_s": 5.0})
    text = "\n".join(lines(compared(flights)))
    assert "Flights that would separate what varies together:" not in text  # one axis follows the other: it is one
    assert "no sideslip holds if" in text
