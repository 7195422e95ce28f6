"""The verdict's machine, proved on results whose truth is planted: `docs/reference/statistics.md` in short."""

import math

import pytest

from harness.studies.statistics import (
    DESIGNS,
    FLOORS,
    LEAST_FOUND,
    MOST_WRONG,
    SCATTERS,
    Design,
    conditions,
    coverage,
    shares,
    words,
)

REPLICATIONS = 2000
SIGMAS = 3.0  # of the count of replications, which is a draw itself


def slack(share: float) -> float:
    return SIGMAS * math.sqrt(share * (1.0 - share) / REPLICATIONS)


def test_an_interval_holds_the_truth_as_often_as_it_says_whatever_the_scatter() -> None:
    found = list(coverage(REPLICATIONS))
    assert {(each.scatter, each.seeds) for each in found if not math.isnan(each.share)} == {
        (scatter, seeds) for scatter in SCATTERS for seeds in FLOORS
    }  # below five seeds there is none
    for each in found:
        if not math.isnan(each.share):
            assert each.share >= FLOORS[each.seeds], each


@pytest.mark.parametrize("seeds", [5, 12])
def test_at_most_one_family_in_twenty_has_a_false_word(seeds: int) -> None:
    for each in words(seeds, REPLICATIONS, ("skewed to the right",)):
        assert each.false_families <= MOST_WRONG + slack(MOST_WRONG), each
        if seeds == 12 and each.truth == "well inside":
            assert each.decided > 0.4, each  # it is not honest by never deciding


def test_at_most_one_family_in_twenty_has_a_false_word_for_a_share_of_flights() -> None:
    for cells, seeds, replications in ((1, 72, REPLICATIONS), (12, 20, 100)):
        for each in shares(cells, (seeds,), replications, (1.001,)):
            assert each.false_families <= MOST_WRONG + slack(MOST_WRONG), each


@pytest.mark.parametrize("design", DESIGNS, ids=lambda design: design.name)
def test_a_planted_condition_is_found_and_a_spurious_one_is_not(design: Design) -> None:
    (each,) = conditions(12, REPLICATIONS, (design,))
    assert each.spurious <= MOST_WRONG, each
    if not math.isnan(each.found):
        assert each.found >= LEAST_FOUND, each
