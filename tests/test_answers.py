"""The answer's sentences, derived anew from the undisturbed flights that it was written from."""

import pandas as pd
import pytest

from harness.margins import Assess
from harness.runs.results import as_results
from harness.studies.does_it_hold import (
    PAPERS_LIMIT,
    Gains,
    compared,
    core,
    followed,
    last_line,
    matrix,
    number,
    quieter,
    remedy,
    short_answer,
    still_air,
)
from harness.verdict.answer import plain, share
from harness.verdict.comparison import Comparison
from tests.builders import DOCS, ROOT

CORE = ROOT / "tests" / "assumption_core.parquet"
QUIET_GAINS = ROOT / "tests" / "quiet_gains.parquet"


@pytest.fixture(scope="module")
def comparison() -> Comparison:
    return compared(core(as_results(pd.read_parquet(CORE))), Assess())


@pytest.fixture(scope="module")
def gains() -> list[Gains]:
    return list(quieter(compared(as_results(pd.read_parquet(QUIET_GAINS)), Assess())))


@pytest.fixture(scope="module")
def page() -> str:
    return (DOCS / "answers" / "does_it_hold.md").read_text(encoding="utf-8")


def test_every_sentence_of_the_answer_follows_from_the_flights(comparison: Comparison, page: str) -> None:
    sentences = [statement.text for statement in still_air(comparison)] + list(short_answer(comparison))
    assert len(sentences) == 3 * (3 + 1)  # airframes, each under three laws and over all of them
    for sentence in sentences:
        assert sentence in page


def test_the_readme_answers_with_the_same_sentences(comparison: Comparison) -> None:
    readme = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())  # it is wrapped there
    for sentence in short_answer(comparison):
        assert sentence in readme


def test_the_matrix_of_parts_and_airframes_follows_from_the_flights(comparison: Comparison, page: str) -> None:
    parts = matrix(comparison)
    assert len({column[0] for column in parts.columns}) == 3
    for title, unit, cells in parts.rows:
        line = " ".join(f"{cell.text if cell else '–'} |" for cell in cells)
        assert f"| {title} [{unit}] | {line}" in page


def test_a_limit_cycle_is_predicted_where_it_is_observed(comparison: Comparison, page: str) -> None:
    rows = list(followed(comparison))
    assert len(rows) == 9
    for row in rows:
        assert f"| {row.aircraft} | {row.law} | {plain(row.gain)} |" in page
        assert (row.cycling == row.of > 0) is (row.margin < 1.0), row


def test_the_undisturbed_core_is_what_was_asked(comparison: Comparison) -> None:
    assert PAPERS_LIMIT in comparison.axes["law.max_heading_rate_deg_s"]
    assert set(comparison.table["wind.turbulence"]) == {"none"}
    assert len(comparison.pairs) == 3 * 5 * 3 * 20


def test_what_would_make_it_hold_follows_from_the_flights(gains: list[Gains], page: str) -> None:
    readme = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
    assert remedy(gains) in page
    assert remedy(gains) in readme
    assert len(gains) == 3 * 3  # airframes, pairs of gains
    for each in gains:
        time = number(each.costs["convergence_time_s"])
        assert f"| {share(each.cycle)} | {each.converged[0]}, {each.converged[1]} of {each.seeds} | {time} |" in page


def test_with_a_margin_of_one_and_a_half_no_flight_is_in_a_limit_cycle(gains: list[Gains]) -> None:
    asked = Assess().limit_cycle_margin
    with_margin = [each for each in gains if each.margin >= asked]
    assert {each.aircraft for each in with_margin} == {each.aircraft for each in gains}
    assert all(each.cycle.of == each.seeds for each in with_margin)
    assert sum(each.cycle.number for each in with_margin) == 0
    assert all(each.cycle.share == 1.0 for each in gains if each.margin < 1.0)


# What was said before, and what the flights say


def test_at_low_frequency_the_heading_rate_follows_its_command(comparison: Comparison) -> None:
    """It was said to be 20 to 40 % short: an attenuation at the frequency of the law's own limit cycle."""
    assert all(0.98 < row.gain < 1.005 for row in followed(comparison))


def test_sideslip_is_not_little_on_every_airframe(comparison: Comparison) -> None:
    """It was said that it mostly holds; at 45 deg of bank the Skywalker X8 has 7.3 deg."""
    steep = {
        column[0]: cell
        for title, _, cells in matrix(comparison).rows
        if title == "no sideslip"
        for column, cell in zip(matrix(comparison).columns, cells, strict=True)
        if cell is not None and column[1] > 20.0
    }
    assert steep["skywalker_x8"].word == "fails"
    assert steep["ultra_stick_25e"].word == "holds"


def test_command_activity_is_told_cell_by_cell(comparison: Comparison, page: str) -> None:
    """A mean over the design was -32.7 deg/s2, although undisturbed pairs of NFTSM chatter."""
    rows = comparison.differences.query("metric == 'command_activity_deg_s2'")
    assert set(rows.groupby("aircraft").size()) == {3 * 5 - 2}  # the paper's first gains circle nowhere on two circles
    nftsm = rows["law"].str.startswith("nftsm")
    assert (rows.loc[nftsm, "difference"] > 5.0).all()
    assert (rows.loc[~nftsm, "difference"].abs() < 0.1).all()  # SMC commands smoothly on the aircraft as well
    assert "activity" not in page.split("## What each disturbance alone adds")[0]


def test_a_time_whose_sign_rests_on_the_tolerance_says_so(comparison: Comparison) -> None:
    """SMC was said to settle sooner on the aircraft: at 1 m, not at 1.2 m."""
    smc = [statement.text for statement in still_air(comparison) if "smc paper" in statement.text]
    assert len(smc) == 3
    for text in smc:
        assert "not shown to converge later or sooner" in text or "a sign that changes with the tolerance" in text


def test_a_difference_of_convergence_times_is_of_pairs_that_both_converge(comparison: Comparison) -> None:
    """It was said to be +46 s: mostly the 150 s at which flights were cut off."""
    both = comparison.pairs.reference["converged"].astype(bool) & comparison.pairs.other["converged"].astype(bool)
    times = comparison.differences.query("metric == 'convergence_time_s'")
    assert times["pairs"].sum() == both.sum()
    assert times["difference"].max() < 150.0 / 2.0


def test_the_margin_to_the_limit_cycle_is_judged_once_and_no_lag_beside_it(comparison: Comparison) -> None:
    """Gain, lag and lag x k2 were one fact, counted three times; none of them could come out otherwise."""
    judged = {judgement.column for judgement in comparison.scorecards[0].judgements if judgement.has_margin}
    assert "limit_cycle_margin" in judged
    assert judged.isdisjoint({"heading_rate_lag_s", "heading_rate_gain", "lag_times_k2"})


def test_a_condition_names_flown_values_and_no_half_line(comparison: Comparison) -> None:
    """It was said: holds if guidance_period_s >= 0.2, the largest value that was flown."""
    texts = list(comparison.conditions["condition"])
    assert any(texts)
    assert not [text for text in texts if "≥" in text or "≤" in text or ">" in text or "<" in text]


def test_the_last_line_says_who_keeps_the_promise_as_the_laws_were_flown(page: str) -> None:
    assert page.endswith(f"{last_line((DOCS / 'answers' / 'which_law.csv').read_text(encoding='utf-8'))}\n")


def test_a_law_keeps_the_promise_where_it_is_shown_to_and_an_air_without_one_is_told() -> None:
    rows = ["condition,airframe,plant,law,keeps the promise", "still air,x,kinematic,a,", "still air,x,sixdof,a,yes"]
    rows += ["still air,x,sixdof,b,no", '"wind, strong",x,sixdof,a,no', "still air,y,sixdof,b,yes"]
    told = last_line("\n".join(rows)).splitlines()
    assert told[-4:] == ["| law | still air | wind, strong |", "|---|---|---|", "| a | x | none |", "| b | y | none |"]
