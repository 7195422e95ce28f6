"""The statistics against closed forms, and against drawn samples whose truth is known."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from harness.verdict.statistics import LEAST_EQUAL, LEAST_SEEDS, Sample, evidence, holm, sample, seeds_to_decide, share

Array = NDArray[np.float64]


def drawn(values: Array) -> Sample:
    return Sample(np.asarray(values, float), len(values), drawn=True)


SYMMETRIC = drawn(np.array([-2.0, -1.0, 0.0, 1.0, 2.0]))
SKEWED = drawn(np.array([0.1, 0.2, 0.2, 0.3, 0.5, 0.9, 2.5]))


def test_without_skewness_the_interval_is_students_with_half_of_the_degrees_of_freedom() -> None:
    expected = stats.t.interval(0.95, 2, 0.0, math.sqrt(2.5 / 5.0))
    assert SYMMETRIC.interval() == pytest.approx(expected)
    assert SYMMETRIC.p_above(-1.0) == pytest.approx(stats.t.sf(1.0 / math.sqrt(2.5 / 5.0), 2))


def test_skewness_widens_the_interval_on_its_own_side_only() -> None:
    low, high = SKEWED.interval() or (0.0, 0.0)
    student = stats.t.interval(0.95, 3, SKEWED.mean, stats.sem(SKEWED.means))
    assert low == pytest.approx(student[0])
    assert high > student[1] + 0.5


def test_an_interval_ends_where_the_test_at_its_level_begins() -> None:
    for of in (SYMMETRIC, SKEWED):
        low, high = of.interval() or (0.0, 0.0)
        assert of.p_above(low) == pytest.approx(0.025)
        assert of.p_below(high) == pytest.approx(0.025)


def test_a_mirrored_sample_has_the_mirrored_interval() -> None:
    low, high = SKEWED.interval() or (0.0, 0.0)
    assert drawn(-SKEWED.means).interval() == pytest.approx((-high, -low))


def test_flights_of_one_seed_are_one_draw() -> None:
    seeds = np.repeat(np.arange(6), 4)
    values = np.repeat([1.0, 2.0, 3.0, 4.0, 5.0, 7.0], 4)
    of = sample(values, seeds, drawn=True)
    assert (of.pairs, of.seeds) == (24, 6)
    assert of.interval() == drawn(np.array([1.0, 2.0, 3.0, 4.0, 5.0, 7.0])).interval()
    values[:2] = math.nan
    assert sample(values, seeds, drawn=True).pairs == 22


def test_too_few_seeds_have_no_interval_and_say_how_many_are_needed() -> None:
    few = drawn(np.arange(LEAST_SEEDS - 1.0))
    assert few.interval() is None
    assert few.why_not == "4 seeds; 5 are needed"
    assert evidence(few, -100.0, 100.0).strongest == 1.0


def test_what_is_not_drawn_is_a_number_and_what_is_drawn_needs_fourteen_that_agree() -> None:
    exact = Sample(np.array([1.5]), 1, drawn=False)
    assert exact.interval() == (1.5, 1.5)
    assert evidence(exact, -2.0, 2.0) == (0.0, 1.0, False)
    assert evidence(exact, -1.0, 1.0) == (1.0, 0.0, False)
    assert drawn(np.full(LEAST_EQUAL - 1, 1.5)).interval() is None
    assert drawn(np.full(LEAST_EQUAL, 1.5)).interval() == (1.5, 1.5)
    assert 1.0 - 0.05 ** (1.0 / LEAST_EQUAL) < 0.2 < 1.0 - 0.05 ** (1.0 / (LEAST_EQUAL - 1))


def test_a_share_on_which_all_seeds_agree_has_the_interval_and_the_evidence_of_the_binomial() -> None:
    for seeds in (1, 5, 20, 72):
        for value, number in ((0.0, 0), (1.0, seeds)):
            of = Sample(np.full(seeds, value), seeds, drawn=True, reach=(0.0, 1.0))
            exact = stats.binomtest(number, seeds, 0.05)
            expected = exact.proportion_ci(0.95, "exact")
            assert of.interval() == pytest.approx((expected.low, expected.high))
            assert not of.why_not
            assert of.p_below(0.05) == pytest.approx(stats.binom.cdf(number, seeds, 0.05))
            assert of.p_above(0.05) == pytest.approx(stats.binom.sf(number - 1, seeds, 0.05))
    flights = sample(np.zeros(72), np.repeat(np.arange(24), 3), drawn=True, reach=(0.0, 1.0))
    assert flights.interval() == Sample(np.zeros(24), 24, drawn=True, reach=(0.0, 1.0)).interval()  # one seed, one draw


def test_no_share_below_a_margin_is_shown_by_fewer_seeds_than_the_binomial_asks() -> None:
    for level in (0.05, 0.05 / 12.0):
        of = Sample(np.zeros(20), 20, drawn=True, reach=(-1.0, 1.0))
        needed = seeds_to_decide(of, -0.05, 0.05, level)
        assert needed is not None
        for seeds, decided in ((needed, True), (needed - 1, False)):
            more = Sample(np.zeros(seeds), seeds, drawn=True, reach=(-1.0, 1.0))
            assert (evidence(more, -0.05, 0.05).holds <= level) is decided
    assert seeds_to_decide(of, None, 0.05, 0.05) == 72
    assert seeds_to_decide(of, None, 0.0, 0.05) is None  # no number of seeds shows that it never happens


@pytest.mark.parametrize("other", [0.0, 0.2, 0.45])
def test_the_evidence_of_seeds_that_agree_is_the_largest_over_all_truths_on_the_bound(other: float) -> None:
    """Of pairs in which one flight alone has it: a share that has it beyond the other's, both of any size."""
    bound, seeds = 0.1, 9
    for value, chance in ((0.0, 1.0 - (bound + other) - other), (1.0, bound + other)):
        of = Sample(np.full(seeds, value), seeds, drawn=True, reach=(-1.0, 1.0))
        p = of.p_below(bound) if value < bound else of.p_above(bound)
        assert p >= chance**seeds - 1e-12
        assert (p == pytest.approx(chance**seeds)) is (other == (0.0 if value < bound else 0.45))


def test_a_share_that_does_not_depend_on_the_seed_is_exact_where_nothing_is_drawn_only() -> None:
    exact = Sample(np.zeros(1), 1, drawn=False, reach=(0.0, 1.0))
    assert exact.interval() == (0.0, 0.0)
    assert evidence(exact, None, 0.05) == (0.0, 1.0, False)
    few = Sample(np.zeros(5), 5, drawn=True, reach=(0.0, 1.0))
    assert evidence(few, None, 0.05) == (1.0, 1.0, True)  # it is in the family of tests, whatever it says
    assert evidence(drawn(np.zeros(5)), None, 0.05) == (1.0, 1.0, False)


def test_the_interval_of_a_share_ends_where_a_share_does() -> None:
    of = Sample(np.array([1.0] + 19 * [0.0]), 20, drawn=True, reach=(0.0, 1.0))
    low, high = of.interval() or (math.nan, math.nan)
    assert low == 0.0
    assert high == (drawn(of.means).interval() or (0.0, 0.0))[1]


def test_evidence_is_for_the_side_on_which_the_interval_lies() -> None:
    assert evidence(SYMMETRIC, -10.0, 10.0).holds < 0.05 < evidence(SYMMETRIC, -10.0, 10.0).fails
    assert evidence(SYMMETRIC, 10.0, None).fails < 0.05
    assert evidence(SYMMETRIC, -1.0, 1.0).strongest > 0.05
    moving = np.array([0.5, 1.0, 1.5, 2.0, 2.5])  # a bound for each seed
    assert evidence(SYMMETRIC, None, moving).holds == pytest.approx(2.0 * drawn(SYMMETRIC.means - moving).p_below(0.0))


def test_holm_is_the_textbooks() -> None:
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])


def test_as_many_seeds_as_advised_decide_when_mean_and_scatter_stay() -> None:
    of = drawn(np.array([0.4, 1.2, 0.9, 1.6, 0.7, 1.1]))
    assert evidence(of, None, 1.3).strongest > 0.05
    needed = seeds_to_decide(of, None, 1.3, 0.05)
    assert needed is not None
    spread = np.std(of.means, ddof=1)
    for n, decided in ((needed + 1, True), (max(7, round(0.8 * needed)), False)):
        half = stats.t.ppf(0.975, 0.5 * (n - 1)) * spread / math.sqrt(n)
        assert bool(of.mean + half <= 1.3) is decided
    assert seeds_to_decide(of, None, of.mean, 0.05) is None


def test_a_share_of_alike_flights_is_as_uncertain_as_that_of_their_seeds() -> None:
    """Twenty seeds, each with five flights that all converge or all do not: twenty draws, not a hundred."""
    by_seed = np.arange(20) < 8
    alike = share(np.repeat(by_seed, 5), np.repeat(np.arange(20), 5), drawn=True)
    expected = stats.binomtest(8, 20).proportion_ci(0.95, "exact")
    assert (alike.number, alike.of, alike.seeds) == (40, 100, 20)
    assert (alike.low, alike.high) == pytest.approx((expected.low, expected.high), abs=0.02)
    mixed = np.tile(np.arange(5) < 2, 20)
    wide = share(mixed, np.repeat(np.arange(20), 5), drawn=True)
    assert wide.high - wide.low <= alike.high - alike.low
    none = share(np.zeros(100, bool), np.repeat(np.arange(20), 5), drawn=True)
    assert (none.low, none.high) == pytest.approx((0.0, 1.0 - 0.025 ** (1.0 / 20.0)))
