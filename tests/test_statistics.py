"""What pairs say, against textbook values, other implementations and flights of chance."""

import numpy as np
import pytest
from scipy import stats

from harness.verdict.statistics import LEAST_SEEDS, effect, equivalence, holm, mcnemar, share

RNG = np.random.default_rng(7)


def test_holm_gives_the_known_values_whatever_the_order() -> None:
    assert holm([0.01, 0.02, 0.03, 0.5]) == pytest.approx([0.04, 0.06, 0.06, 0.5])
    assert holm([0.5, 0.03, 0.01, 0.02]) == pytest.approx([0.5, 0.06, 0.04, 0.06])
    assert holm([0.9, 0.8]) == [1.0, 1.0]
    assert holm([]) == []


def test_mcnemar_is_exact() -> None:
    assert mcnemar(2, 9) == pytest.approx(0.0654, abs=5e-5)
    assert mcnemar(0, 0) == 1.0
    assert mcnemar(5, 0) == pytest.approx(2 * 0.5**5)


def test_wilsons_interval_is_known() -> None:
    """Wilson (1927): 0 of 10 reaches up to z^2/(n + z^2)."""
    z2 = stats.norm.ppf(0.975) ** 2
    none = share(0, 10)
    assert none.low == 0.0
    assert none.high == pytest.approx(z2 / (10 + z2))
    assert share(10, 10).low == pytest.approx(1.0 - none.high)


def test_equivalence_is_two_one_sided_t_tests() -> None:
    d = RNG.normal(0.1, 0.5, 20)
    low = stats.ttest_1samp(d, -0.5, alternative="greater").pvalue
    high = stats.ttest_1samp(d, 0.5, alternative="less").pvalue
    assert equivalence(d + 0.5, d - 0.5) == pytest.approx(max(low, high))
    assert equivalence(d[:0], d - 0.5) == pytest.approx(high)


def test_no_significant_difference_is_no_equivalence() -> None:
    """Three scattered differences around zero: no difference is found, and no equivalence either."""
    d = np.array([-3.0, 0.1, 3.0])
    assert stats.ttest_1samp(d, 0.0).pvalue > 0.9
    p = equivalence(d + 1.0, d - 1.0)
    assert p is not None
    assert p > 0.2


def test_without_variation_there_is_nothing_to_test() -> None:
    assert equivalence(np.array([1.0, 1.0]), np.array([-1.0, -1.0])) is None
    assert equivalence(np.array([1.0]), np.array([-1.0])) is None


@pytest.mark.parametrize(
    ("values", "seeds", "why"),
    [
        ([3.0], [0], "one seed"),
        ([3.0, 4.0], [0, 0], "one seed"),
        ([3.0] * 6, range(6), "no variation"),
        ([1.0, 2.0], [0, 1], "too few"),
    ],
)
def test_a_population_without_variation_has_a_difference_and_no_interval(
    values: list[float], seeds: list[int], why: str
) -> None:
    found = effect(np.array(values), list(seeds), "test")
    assert found.mean == pytest.approx(np.mean(values))
    assert found.low is found.high is None
    assert why in found.why


def test_an_interval_is_the_same_each_time() -> None:
    values = RNG.exponential(1.0, 20)
    assert effect(values, range(20), "a") == effect(values, range(20), "a")
    assert effect(values, range(20), "a") != effect(values, range(20), "b")


def test_flights_of_one_seed_count_once() -> None:
    """Ten copies of every flight bring no knowledge: the interval stays as wide."""
    values = RNG.normal(0.0, 1.0, 12)
    once = effect(values, range(12), "copies")
    tenfold = effect(np.repeat(values, 10), np.repeat(np.arange(12), 10), "copies")
    assert tenfold[:3] == pytest.approx(once[:3])
    assert (tenfold.pairs, tenfold.seeds) == (120, 12)


def test_intervals_cover_the_truth_as_often_as_they_say() -> None:
    """20 skewed differences (exponential, mean 1), 300 times over: BCa is known to fall short by a few percent."""
    rng = np.random.default_rng(1)
    hits = 0
    for i in range(300):
        found = effect(rng.exponential(1.0, 20), range(20), f"coverage {i}")
        assert found.low is not None
        assert found.high is not None
        hits += found.low <= 1.0 <= found.high
    assert 0.88 <= hits / 300 <= 0.98


def test_enough_seeds_give_an_interval() -> None:
    assert effect(RNG.normal(size=LEAST_SEEDS), range(LEAST_SEEDS), "few").low is not None
