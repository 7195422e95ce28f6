"""The study of laws on flights of today: conditions, places above the floor, and the page that they give."""

import tomllib
from typing import TYPE_CHECKING

import pytest

import aircraft
from autopilot.laws import LAWS
from harness import run
from harness.studies.floor import FloorAt, read_floor
from harness.studies.which_law import (
    ACTIVITY,
    AIRCRAFT,
    REFERENCE,
    STILL,
    TURBULENCE,
    Above,
    above_floor,
    compared,
    judged,
    kept,
    level,
    page,
    places_csv,
)
from harness.verdict.ranking import Relation
from tests.builders import ROOT

if TYPE_CHECKING:
    import pandas as pd

LAWS_TOML = ROOT / "experiments" / "laws.toml"
FLOOR = ROOT / "docs" / "answers" / "floor.csv"

SMALL = """
title = "Two laws"
[flight]
duration_s = 40.0
law = { max_heading_rate_deg_s = 10.0, airspeed = "ground" }
target = { position_m = [0.0, 0.0] }
start = { position_m = [0.0, 200.0] }
metrics = { tolerance_m = 1e-12 }
[matrix]
seed = { start = 0, count = 6 }
plant = ["kinematic", "sixdof"]
"law.name, law.gains" = [["nftsm", "scaled"], ["nftsm", "behind_inner_loop"]]
"wind.turbulence" = ["none", "moderate"]
"start.heading_deg" = { uniform = [-1.0, 1.0] }
"""


@pytest.fixture(scope="module")
def flights(tmp_path_factory: pytest.TempPathFactory) -> "pd.DataFrame":
    folder = tmp_path_factory.mktemp("laws")
    (folder / "small.toml").write_text(SMALL, encoding="utf-8")
    return judged(run(folder / "small.toml", folder / "out", workers=0, log="none"))


def test_the_papers_gains_fall_behind_on_the_aircraft_in_still_air(flights: "pd.DataFrame") -> None:
    still, rough = compared(flights)
    assert [(each.condition, each.aircraft) for each in (still, rough)] == [
        (STILL, "ultra_stick_25e"),
        (TURBULENCE, "ultra_stick_25e"),
    ]
    papers, quiet = "nftsm scaled", "nftsm behind_inner_loop"
    assert still.error.orders[REFERENCE].relation(papers, quiet) is Relation.TIE
    assert still.error.orders[AIRCRAFT].relation(quiet, papers) is Relation.BETTER
    assert still.efficient == [quiet]
    assert kept(flights)[STILL, "ultra_stick_25e"] == [quiet]
    assert [change.is_reversal for change in still.changes] == [False]


def test_the_kinematic_aircraft_overstates_activity_in_gusts_and_no_law_flies_below_the_floor(
    flights: "pd.DataFrame",
) -> None:
    nearest, furthest = above_floor(flights, read_floor(FLOOR))
    assert (nearest.law, furthest.law) == ("nftsm behind_inner_loop", "nftsm scaled")
    assert 1.0 < nearest.times < 4.0 < furthest.times
    for each in (nearest, furthest):
        assert each.on_reference > 2.0 * each.activity
        assert each.low < each.times < each.high
        assert not each.is_below


def test_a_law_below_the_floor_is_told() -> None:
    floor = FloorAt("x", 3.0, 0.2, 0.18, 0.22)
    of = Above("a", "x", 0.1, 3.0, 9.0, 0.5, 0.4, 0.6, floor)
    assert of.is_below
    assert not of._replace(high=0.95).is_below  # within the floor's own interval
    assert level([floor, floor._replace(activity=6.0, error=0.05)], 4.0).error == pytest.approx(0.2 * (4.0 / 3.0) ** -2)


def test_the_page_says_what_was_flown_and_each_condition_by_itself(flights: "pd.DataFrame") -> None:
    each = compared(flights)
    text = page(flights, each, list(above_floor(flights, read_floor(FLOOR))), "out/laws")
    assert "\n- The order: of 2 comparisons of two laws by range error, 0 are shown to be reversed on sixdof." in text
    assert text.index("- The order") < text.index("![") < text.index("| condition |")  # the answer comes first
    assert "48 flights: 2 laws (nftsm behind_inner_loop, nftsm scaled), each with 6 seeds" in text
    assert "| still air | ultra_stick_25e | 2 |" in text
    assert "| moderate turbulence | ultra_stick_25e | 2 |" in text
    assert "\n\n\n" not in text
    lines = places_csv(each, kept(flights)).splitlines()
    assert len(lines) == 1 + 2 * 2 * 2
    assert [line.rsplit(",", 1)[1] for line in lines[1:] if ",sixdof," in line].count("yes") == sum(
        map(len, kept(flights).values())
    )
    assert all(line.startswith(("still air,", "moderate turbulence,")) for line in lines[1:])


def test_a_calmer_law_than_the_floor_has_no_number(flights: "pd.DataFrame") -> None:
    calm = flights.assign(**{ACTIVITY: 0.1})
    assert list(above_floor(calm, read_floor(FLOOR))) == []


def test_the_experiment_flies_every_law_on_the_plants_and_airframes_that_are_ranked() -> None:
    matrix = tomllib.loads(LAWS_TOML.read_text(encoding="utf-8"))["matrix"]
    assert {name for name, _ in matrix["law.name, law.gains"]} == set(LAWS)
    assert {REFERENCE, AIRCRAFT} < set(matrix["plant"])
    (conditions,) = (values for key, values in matrix.items() if key.startswith("aircraft, "))
    assert {name: sum(airframe == name for airframe, *_ in conditions) for name in read_floor(FLOOR)} == dict.fromkeys(
        aircraft.names(), 5
    )
