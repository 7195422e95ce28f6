"""The answer's sentences, derived anew from the undisturbed flights that it was written from."""

import pandas as pd
import pytest

from harness.margins import Assess
from harness.studies.does_it_hold import (
    PAPERS_LIMIT,
    Followed,
    compared,
    core,
    followed,
    matrix,
    short_answer,
    still_air,
)
from harness.verdict.answer import plain
from harness.verdict.comparison import Comparison
from tests.builders import DOCS, ROOT

ROWS = ROOT / "tests" / "assumption_core.parquet"


@pytest.fixture(scope="module")
def comparison() -> Comparison:
    return compared(core(pd.read_parquet(ROWS)), Assess())


@pytest.fixture(scope="module")
def page() -> str:
    return (DOCS / "answers" / "does_it_hold.md").read_text(encoding="utf-8")


def test_every_sentence_of_the_answer_follows_from_the_flights(comparison: Comparison, page: str) -> None:
    sentences = [statement.text for statement in still_air(comparison)] + list(short_answer(comparison))
    assert len(sentences) == 3 * (3 + 1)  # airframes, each under three laws and over all of them
    for sentence in sentences:
        assert sentence in page


def test_the_readme_answers_with_the_same_sentences(comparison: Comparison) -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
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
        assert (row.cycling == row.of > 0) is _cycles(row), row


def _cycles(row: Followed) -> bool:
    return row.margin < 1.0


def test_the_undisturbed_core_is_what_was_asked(comparison: Comparison) -> None:
    assert PAPERS_LIMIT in comparison.axes["law.max_heading_rate_deg_s"]
    assert set(comparison.table["wind.turbulence"]) == {"none"}
    assert len(comparison.pairs) == 3 * 5 * 3 * 20
