"""The main job, flown whole: what it prints and what it records."""

from pathlib import Path

import pytest

from harness.cli import _demo as demo
from harness.log import COLUMNS
from harness.plants.plant import Outcome
from harness.review.reading import read_recording
from harness.tables import number

Flights = list[demo.Flown]


@pytest.fixture(scope="module")
def flown() -> Flights:
    return list(demo.fly_all())


def of(flown: Flights, case: str) -> Flights:
    return [one for one in flown if one.case.name == case]


def test_every_flight_of_the_main_job_is_flown_to_its_end(flown: Flights) -> None:
    assert len(flown) == 3 * 2 * 3
    assert {one.log.outcome for one in flown} == {Outcome.COMPLETED}


def test_a_table_has_a_line_per_flight_that_ends_in_its_metrics(flown: Flights) -> None:
    for case in demo.CASES:
        those = of(flown, case.name)
        *_, rule = [i for i, line in enumerate(demo.lines(those)) if line.startswith("---")]
        lines = list(demo.lines(those))[rule + 1 :]
        for one, line in zip(those, lines, strict=True):
            law, plant, settles, *_, sideslip = line.split()
            assert (law, plant) == (one.law, one.plant)
            assert settles == number(one.metrics["convergence_time_s"])
            assert sideslip == number(one.metrics["sideslip_peak_deg"])


def test_the_sentences_say_by_how_much_the_plants_differ(flown: Flights) -> None:
    those = of(flown, "still-air")
    times = [one.metrics["convergence_time_s"] for one in those if one.law == "NFTSM_1"]
    nftsm, smc = demo.differences(those)
    assert nftsm.startswith(f"NFTSM_1 settles in {times[0]:.1f} s on the kinematic aircraft, ")
    assert f"in {times[1]:.1f} s on ultra_stick_25e ({times[1] - times[0]:+.1f} s)" in nftsm
    assert "it chatters" in nftsm
    assert "it chatters" not in smc


def test_an_infeasible_circle_is_called_so_with_how_far_every_plant_leaves_it(flown: Flights) -> None:
    infeasible, nftsm, smc = demo.differences(of(flown, "wind-5"))
    assert infeasible.startswith("Infeasible: holding the circle in this wind takes up to 5.64 deg/s, the limit is 5.")
    for sentence, law in ((nftsm, "NFTSM_1"), (smc, "SMC")):
        peaks = [one.metrics["range_error_peak_m"] for one in of(flown, "wind-5") if one.law == law]
        assert min(peaks) > 20.0
        assert all(f"by {peak:.1f} m on " in sentence for peak in peaks)
    assert "Infeasible" not in " ".join(demo.differences(of(flown, "wind-8")))


def test_a_pair_is_recorded_with_both_aircraft_to_the_last_bit(flown: Flights, tmp_path: Path) -> None:
    pair = [one for one in of(flown, "wind-8") if one.law == "SMC" and one.plant != "skywalker_x8"]
    (path,) = demo.record_pairs(pair, tmp_path)
    for one in pair:
        assert (read_recording(path, one.plant)["range_error"].to_numpy() == one.log["range_error"]).all()
    assert list(read_recording(path, "kinematic").columns) == list(COLUMNS)
