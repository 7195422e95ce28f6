"""A filter of one's own, and how its estimates are asked for."""

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from autopilot.estimator import (
    EstimatorKind,
    Measurement,
)
from harness.knowledge import Estimation, sensor, sighting
from harness.plants.plant import End, Outcome
from tests.test_estimator import EKF, MOVING, PAPER


class Believing:
    """A filter of one's own: every measurement is believed. `wrong` is what it does wrong."""

    def __init__(self, wrong: str = "") -> None:
        self.wrong, self.known, self._at = wrong, [0.0, 0.0], 0

    def update(self, measured: Measurement) -> Any:
        self._at += 1
        self.known[:] = measured if self.wrong != "known" or self._at < 3 else [*measured, 0.0]  # in place
        return Measurement(1.0, 2.0) if self.wrong != "update" else (1.0,)

    def miss(self) -> None: ...

    def ahead(self, known: Sequence[Any], age: Any) -> Any:
        if self.wrong == "complex":
            age = age * 1j
        estimate = (known[0] + age, known[1], 0.0, 0.0, 1.0, 1.0, 1.0, 1.0)
        return estimate if self.wrong != "ahead" else estimate[:7]


def believed(monkeypatch: pytest.MonkeyPatch, wrong: str = "") -> Estimation:
    kind = EstimatorKind("as measured", lambda settings: Believing(wrong))
    monkeypatch.setattr("autopilot.estimator.ESTIMATORS", {"own": kind})
    return Estimation(sighting(replace(EKF, estimator=replace(PAPER, kind="own"), duration=120.0)))


def test_a_filter_of_ones_own_may_change_what_it_knows_in_place(monkeypatch: pytest.MonkeyPatch) -> None:
    found, measure, at = believed(monkeypatch), sensor(PAPER, 0), MOVING.start()
    found.at(2400, at(0.0))
    ranges = [measure(at(0.5 * j)).range for j in range(241)]
    assert found.rows[:, 0].tolist() == [ranges[k // 10] + k % 10 * 10 * 0.005 for k in range(2401)]


def test_estimates_are_the_same_asked_for_one_by_one_or_the_last_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    each, last = believed(monkeypatch), believed(monkeypatch)
    for k in range(2401):
        each.at(k, EKF.target.start()(0.0))
    last.at(2400, EKF.target.start()(0.0))
    assert np.array_equal(each.rows, last.rows, equal_nan=True)


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        ("ahead", "TypeError: Expected 8 arguments, got 7"),
        ("update", "TypeError: Expected 2 arguments, got 1"),
        ("known", "ValueError: known has 3 numbers now, and had 2"),
        ("complex", "TypeError: Cannot cast array data from dtype('complex128')"),
    ],
)
def test_a_filter_of_ones_own_that_answers_amiss_says_so(
    wrong: str, reason: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(End, match=re.escape(f"the estimator raised {reason}")) as told:
        believed(monkeypatch, wrong).at(2400, EKF.target.start()(0.0))
    assert told.value.outcome is Outcome.INVALID
