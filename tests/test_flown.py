"""What was flown, line by line and as a map: made-up flights whose counts are known."""

import numpy as np
import pandas as pd
import pytest

from harness.margins import Assess
from harness.verdict import curve, flown, grid
from harness.verdict.comparison import Comparison, compare_flights
from harness.verdict.pairs import CompareError
from harness.verdict.text import lines
from tests.builders import SEEDS, result_matrix

GAINS = {"law.k2": [1.0, 4.0, 12.0], "law.k3": [0.5, 6.0]}


def chattering(flights: pd.DataFrame) -> Comparison:
    """6-DOF flights with k2 = 12 are in a limit cycle, all others are not; one of k2 = 4 is lost."""
    flights["chatters"] = (flights["plant"] == "sixdof") & (flights["law.k2"] == 12.0)
    flights["range_error_rms_m"] = flights["law.k2"] * flights["law.k3"]
    first = (flights["plant"] == "sixdof") & (flights["law.k2"] == 4.0) & (flights["seed"] == 0)
    flights.loc[first & (flights["law.k3"] == 6.0), "outcome"] = "ground"
    return compare_flights(flights, Assess())


@pytest.fixture(scope="module")
def comparison() -> Comparison:
    return chattering(result_matrix(GAINS))


def test_every_combination_has_its_counts_and_its_flights(comparison: Comparison) -> None:
    axes, found = flown.combinations(comparison)
    assert axes == ["law.k2", "law.k3", "plant"]
    assert [each.at for each in found[:4]] == [
        (1.0, 0.5, "kinematic"), (1.0, 0.5, "sixdof"), (1.0, 6.0, "kinematic"), (1.0, 6.0, "sixdof"),
    ]  # fmt: skip
    assert sum(each.flights for each in found) == comparison.flights
    by_place = {each.at: each for each in found}
    assert by_place[12.0, 0.5, "sixdof"].cycling == (SEEDS, SEEDS)
    assert by_place[12.0, 0.5, "kinematic"].cycling == (0, SEEDS)
    assert (by_place[4.0, 6.0, "sixdof"].lost, by_place[4.0, 6.0, "sixdof"].flights) == (1, SEEDS)
    assert sorted(key for each in found for key in each.keys) == sorted(comparison.table["key"])


def test_a_map_holds_the_compared_setting_where_that_is_numeric() -> None:
    flights = result_matrix(GAINS)
    flights["range_error_rms_m"] = flights["law.k2"] * flights["law.k3"]
    comparison = compare_flights(flights[flights["plant"] == "sixdof"].reset_index(drop=True), Assess(), "law.k2")
    (found,) = grid.answering(comparison)
    assert (found.metric, found.rows[0], found.columns[0]) == ("range_error_rms_m", "law.k2", "law.k3")
    assert len(found.cells) == 6


def test_the_answer_begins_with_what_was_flown(comparison: Comparison) -> None:
    text = "\n".join(lines(comparison))
    cycling = f"0 of {6 * SEEDS} with plant = kinematic, {2 * SEEDS} of {6 * SEEDS - 1} with plant = sixdof"
    told = f"In a limit cycle, of the flights in which this can be decided: {cycling}."
    assert told in text
    assert text.index(told) < text.index("settled\n") < text.index("beside kinematic, 72 pairs, 12 seeds, ended early")


def test_a_map_holds_the_median_of_each_cell_and_leads_to_its_flights(comparison: Comparison) -> None:
    first, second = grid.grids(comparison, "range_error_rms_m")
    assert [each.at["plant"] for each in (first, second)] == ["kinematic", "sixdof"]
    assert second.rows == ("law.k2", [1.0, 4.0, 12.0])
    assert second.columns == ("law.k3", [0.5, 6.0])
    for (k2, k3), cell in second.cells.items():
        assert cell.value == pytest.approx(float(str(k2)) * float(str(k3)))
        assert len(cell.keys) == SEEDS
    assert second.shade(second.cells[12.0, 6.0]) == 1.0
    assert second.shade(second.cells[1.0, 0.5]) == 0.0


def test_a_map_of_yes_or_no_is_a_share_of_flights(comparison: Comparison) -> None:
    _, sixdof = grid.grids(comparison, "chatters")
    assert {k2: cell.value for (k2, _), cell in sixdof.cells.items()} == {1.0: 0.0, 4.0: 0.0, 12.0: 1.0}


def test_a_map_is_of_two_numeric_axes() -> None:
    comparison = compare_flights(result_matrix({"law.k2": [1.0, 4.0]}), Assess())
    assert grid.grids(comparison, "chatters") == []
    with pytest.raises(CompareError, match=r"needs two numeric axes; beside plant these vary: law\.k2"):
        list(lines(comparison, "chatters"))
    with pytest.raises(CompareError, match="did you mean 'chatters'"):
        list(lines(comparison, "chaters"))


def test_one_numeric_axis_makes_a_curve_for_each_plant_with_intervals_of_the_means() -> None:
    flights = result_matrix({"law.k2": [1.0, 4.0, 12.0]})
    noise = np.random.default_rng(1).normal(size=len(flights))
    flights["start.heading_deg"] = flights["seed"] + 0.5  # drawn
    flights["range_error_rms_m"] = flights["law.k2"] + noise
    (found,) = curve.curves(compare_flights(flights, Assess()))
    assert (found.axis, set(found.lines)) == ("law.k2", {"kinematic", "sixdof"})
    for plant, line in found.lines.items():
        for point in line["range_error_rms_m"]:
            there = flights[(flights["plant"] == plant) & (flights["law.k2"] == point.x)]
            assert point.mean == pytest.approx(there["range_error_rms_m"].mean())
            assert point.low < point.mean < point.high
            assert set(point.keys) == set(there["key"])
    assert curve.curves(compare_flights(result_matrix(GAINS), Assess())) == []  # two axes make a map
