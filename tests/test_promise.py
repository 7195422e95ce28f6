"""What is asked of the laws that know the inner loop: flown where it is quickest, against the page."""

import csv
import math
from dataclasses import replace
from typing import Any

import pytest

from harness.studies.promise import (
    ACTIVITY,
    AIRFRAMES,
    CONDITIONS,
    ERROR,
    KNOWING,
    SETTLED,
    Asked,
    lines,
    measured,
    page,
    table,
)
from tests.builders import DOCS

QUICK = [one for one in CONDITIONS if one.name in ("still air", "wind of 60 %", "100 ms of delay")]
AIRFRAME = "skywalker_x8"


def test_every_bound_of_the_page_is_met_and_flown_anew_it_is_the_same() -> None:
    with (DOCS / "answers" / "promise.csv").open(encoding="utf-8") as file:
        rows = {(row["condition"], row["law"], row["metric"]): row for row in csv.DictReader(file)}
    asked = {
        (one.name, name, bound.metric)
        for one in CONDITIONS
        for name in KNOWING
        for bound in one.bounds
        if bound.law in ("", name)
    }
    assert set(rows) == asked
    assert {row["met"] for row in rows.values()} == {"True"}
    for line in lines(QUICK, [AIRFRAME]):
        row = rows[line.condition, line.law, line.metric]
        assert line.is_met
        assert line.values[AIRFRAME] == pytest.approx(float(row[AIRFRAME]), rel=0.02, abs=1e-6)
        assert line.allowed[AIRFRAME] == pytest.approx(float(row[f"{AIRFRAME}: allowed"]), rel=0.02)


def test_a_flight_that_is_lost_or_does_not_settle_meets_no_bound() -> None:
    still = QUICK[0]
    flight = still.flight("nftsm_lead", "by_lag", AIRFRAME, 1)
    own: Any = flight.law
    lost = measured(still, replace(flight, law=replace(own, standoff=1.0), duration=30.0))
    assert math.isnan(lost["convergence_time_s"])
    line = Asked("still air", "nftsm_lead", SETTLED, dict.fromkeys(AIRFRAMES, math.nan), dict.fromkeys(AIRFRAMES, 20.0))
    assert not line.is_met
    told = page([line], [])
    assert "**0 of 1 bounds" in told
    assert "Missed: `nftsm_lead`, still air, convergence time, s" in told


def test_the_table_has_a_line_for_each_bound() -> None:
    values = dict.fromkeys(AIRFRAMES, 0.5)
    text = table([Asked("a", "lq_orbit", ERROR, values, values), Asked("a", "lq_orbit", ACTIVITY, values, values)])
    assert [row["met"] for row in csv.DictReader(text.splitlines())] == ["True", "True"]
