"""`harness demo`: the shipped experiment flown, compared and recorded by the ordinary machinery."""

from pathlib import Path

import pandas as pd
import pytest

from harness.log import COLUMNS
from harness.review.reading import read_logs, read_recording
from harness.runs.recordings import recording_path
from harness.runs.results import load_results
from harness.tables import number
from tests.builders import digests, invoke


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("demo")


@pytest.fixture(scope="module")
def said(out: Path) -> str:
    done = invoke("demo", "--out", out)
    assert done.exit_code == 0, done.output
    return done.stdout


@pytest.fixture(scope="module")
def flown(out: Path, said: str) -> pd.DataFrame:
    """Its flights, by wind, limit, law, airframe and plant."""
    results = load_results(out)
    results["wind"] = results["wind.steady_mps"].map(lambda wind: wind[0])
    by = ["wind", "law.max_heading_rate_deg_s", "law.name", "aircraft", "plant"]
    results = results.set_index(by).sort_index()
    assert results.index.is_unique
    return results


def test_two_laws_fly_three_cases_on_three_aircraft_to_the_end(flown: pd.DataFrame) -> None:
    cases = {(0.0, 5.0), (3.0, 5.0), (3.0, 8.0)}
    laws, airframes = ("nftsm", "smc"), ("ultra_stick_25e", "skywalker_x8")
    assert set(flown.index) == {
        (*case, law, airframe, plant)
        for case in cases
        for law in laws
        for airframe in airframes
        for plant in ("kinematic", "sixdof")
    }
    assert set(flown["outcome"]) == {"completed"}
    assert set(flown["law.gains"]) == {"paper_1", "paper"}


def test_the_table_has_a_line_for_each_flight_with_its_metrics(flown: pd.DataFrame, said: str) -> None:
    lines = [line.split() for line in said.splitlines() if " of 1 " in line]
    assert len(lines) == len(flown)
    for row in flown.reset_index().to_dict("records"):
        plant = row["plant"]
        (line,) = (
            words
            for words in lines
            if {row["law.name"], row["aircraft"], plant} <= set(words)
            and f"[{row['wind']:g}," in words
            and f"{row['law.max_heading_rate_deg_s']:g}" in words[:6]
        )
        settles = row["convergence_time_s"]
        assert number(None if pd.isna(settles) else settles) in line
        assert line[-1] == ("-" if plant == "kinematic" else number(row["sideslip_peak_deg"]))


def test_in_still_air_nftsm_settles_later_on_an_airframe_and_keeps_moving_its_command(flown: pd.DataFrame) -> None:
    still = flown.xs((0.0, 5.0))
    settles, activity = still["convergence_time_s"], still["command_activity_deg_s2"]
    for airframe in ("ultra_stick_25e", "skywalker_x8"):
        assert settles["nftsm", airframe, "sixdof"] > settles["nftsm", airframe, "kinematic"] + 10.0
        assert activity["nftsm", airframe, "sixdof"] > 100.0 * activity["nftsm", airframe, "kinematic"]
        assert activity["smc", airframe, "sixdof"] < 0.01


def test_a_circle_that_cannot_be_held_is_warned_of_and_left_on_every_aircraft(flown: pd.DataFrame, out: Path) -> None:
    margin = flown["feasibility_margin_deg_s"]
    assert set(margin.loc[(3.0, 5.0)].round(2)) == {-0.64}
    assert (flown.xs((3.0, 5.0))["range_error_peak_m"] > 20.0).all()
    assert (margin.loc[(3.0, 8.0)] > 0.0).all()
    again = invoke("demo", "--out", out)
    assert "0 flown, 24 earlier" in again.stdout


def test_every_flight_is_recorded_and_a_pair_opens_as_the_output_says(
    flown: pd.DataFrame, out: Path, said: str, tmp_path: Path
) -> None:
    for key, digest in digests(out).items():
        (log,) = read_logs(recording_path(out, key)).values()
        assert log.digest == digest
    assert list(read_recording(recording_path(out, flown["key"].iloc[0])).columns) == list(COLUMNS)
    (line,) = (line for line in said.splitlines() if " harness view " in line)
    words = line.partition(" harness ")[2].split()
    assert invoke(*words, "--save", tmp_path / "pair.rrd").exit_code == 0
    assert {"kinematic", "sixdof"} <= set(read_logs(tmp_path / "pair.rrd"))
