"""Orders of laws whose truth is planted: reversals, ties, what is undecided, and conditions that are never mixed."""

import math
from collections.abc import Mapping

import numpy as np
import pandas as pd
import pytest

from harness.verdict.pairs import CompareError
from harness.verdict.ranking import Ranking, Relation, Tie, rankings

TIE = Tie(share=0.2, least=0.001)
AIR = "wind.turbulence"


def flights(
    truth: Mapping[str, Mapping[str, float]], *, scatter: float = 0.03, seeds: int = 8, air: str = "moderate"
) -> pd.DataFrame:
    """Errors by plant and law, with this relative scatter over the seeds."""
    random = np.random.default_rng(5)
    rows = [
        {"plant": plant, "law": law, "seed": seed, AIR: air, "error": error * math.exp(scatter * random.normal())}
        for plant, errors in truth.items()
        for law, error in errors.items()
        for seed in range(seeds)
    ]
    return pd.DataFrame(rows)


def ranked(table: pd.DataFrame) -> Ranking:
    (ranking,) = rankings(table, "error", TIE, [AIR])
    return ranking


def test_a_planted_reversal_is_found_and_nothing_else() -> None:
    ranking = ranked(flights({"kinematic": {"a": 0.1, "b": 0.2, "c": 0.4}, "sixdof": {"a": 0.2, "b": 0.1, "c": 0.4}}))
    (change,) = ranking.changes("sixdof")
    assert change == ("a", "b", Relation.BETTER, Relation.WORSE)
    assert change.is_reversal
    assert list(ranking.orders["sixdof"].places) == ["b", "a", "c"]
    tau, laws = ranking.agreement("sixdof")
    assert (round(tau, 12), laws) == (round(1.0 / 3.0, 12), 3)
    assert ranking.undecided("sixdof") == (0, 3)


def test_the_same_order_is_no_change() -> None:
    errors = {"a": 0.1, "b": 0.2, "c": 0.4}
    ranking = ranked(flights({"kinematic": errors, "sixdof": {law: 7.0 * error for law, error in errors.items()}}))
    assert ranking.changes("sixdof") == []
    assert ranking.agreement("sixdof") == (1.0, 3)


@pytest.mark.parametrize("errors", [{"a": 0.100, "b": 0.104}, {"a": 1e-9, "b": 9e-4}])
def test_laws_within_a_fifth_or_a_millimetre_tie(errors: Mapping[str, float]) -> None:
    ranking = ranked(flights({"kinematic": errors, "sixdof": {"a": 0.1, "b": 0.3}}))
    assert ranking.orders["kinematic"].relation("a", "b") is Relation.TIE
    assert ranking.orders["kinematic"].relation("b", "a") is Relation.TIE
    (change,) = ranking.changes("sixdof")
    assert (change.reference, change.there) == (Relation.TIE, Relation.BETTER)
    assert not change.is_reversal
    assert math.isnan(ranking.agreement("sixdof")[0])


def test_what_the_seeds_do_not_tell_is_undecided() -> None:
    noisy = flights({"kinematic": {"a": 0.1, "b": 0.13}, "sixdof": {"a": 0.13, "b": 0.1}}, scatter=0.4)
    ranking = ranked(noisy)
    assert ranking.orders["sixdof"].relation("a", "b") is Relation.UNDECIDED
    assert ranking.changes("sixdof") == []
    assert ranking.undecided("sixdof") == (1, 1)
    few = ranked(flights({"kinematic": {"a": 0.1, "b": 0.2}, "sixdof": {"a": 0.2, "b": 0.1}}, seeds=4))
    assert few.changes("sixdof") == []


def test_laws_that_are_equal_are_never_called_different() -> None:
    equal = {f"law {i}": 0.1 for i in range(8)}
    ranking = ranked(flights({"kinematic": equal, "sixdof": equal}, scatter=0.1, seeds=10))
    assert not any(relation.is_order for order in ranking.orders.values() for relation in order.relations.values())


def test_each_condition_has_its_own_order_and_a_mix_is_refused() -> None:
    calm = flights({"kinematic": {"a": 0.1, "b": 0.2}, "sixdof": {"a": 0.1, "b": 0.2}}, air="none")
    rough = flights({"kinematic": {"a": 1.0, "b": 3.0}, "sixdof": {"a": 3.0, "b": 1.0}})
    both = pd.concat([calm, rough], ignore_index=True)
    still, moved = rankings(both, "error", TIE, [AIR])
    assert (still.at, still.changes("sixdof")) == ({AIR: "none"}, [])
    assert [change.is_reversal for change in moved.changes("sixdof")] == [True]
    assert moved.orders["sixdof"].places["b"].mean == pytest.approx(1.0, rel=0.1)
    with pytest.raises(CompareError, match="mix of conditions"):
        list(rankings(both.assign(all="all"), "error", TIE, ["all"]))


def test_a_law_that_lost_a_flight_has_no_place() -> None:
    table = flights({"kinematic": {"a": 0.1, "b": 0.2, "c": 0.3}, "sixdof": {"a": 0.1, "b": 0.2, "c": 0.3}})
    table.loc[(table["plant"] == "sixdof") & (table["law"] == "a") & (table["seed"] == 3), "error"] = np.nan
    ranking = ranked(table)
    assert ranking.orders["sixdof"].left_out == {"a": 1}
    assert list(ranking.orders["sixdof"].places) == ["b", "c"]
    assert ranking.agreement("sixdof") == (1.0, 2)
