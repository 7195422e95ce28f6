"""Several directories compared: the same flights in each, or flights of one design in several."""

import json
from pathlib import Path

import pytest

import harness
from harness.verdict.pairs import CompareError, usual
from tests.builders import fly_matrix, invoke, result_matrix, write

FLIGHT = """\
[flight]
plant = "kinematic"
duration_s = 40.0
[matrix]
"law.name" = ["smc", "nftsm"]
seed = [0, 1]
"start.heading_deg" = { uniform = [20.0, 40.0] }
"""


def flown(folder: Path, *words: str) -> Path:
    fly_matrix(write(folder.with_suffix(".toml"), FLIGHT), folder, *words)
    return folder


@pytest.fixture(scope="module")
def before(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return flown(tmp_path_factory.mktemp("before") / "out")


def test_the_same_flights_in_two_directories_are_the_same_to_the_last_bit(before: Path, tmp_path: Path) -> None:
    again = flown(tmp_path / "again")
    answer = harness.compare([before, again]).answer
    assert f"{again}: 4 of 4 flights are those of {before} to the last bit." in answer
    assert "Code, libraries, airframes and tracks are the same." in answer
    document = json.loads(invoke("compare", before, again, "--json").stdout)
    assert (document["by"], document["baseline"], document["moved"]) == ("directory", str(before), [])


def test_what_another_gain_moved_is_told_with_how_far_and_which_flights(before: Path, tmp_path: Path) -> None:
    after = flown(tmp_path / "after", "law.name=nftsm", "law.k2=3.0", "seed=[0, 1]")
    done = invoke("compare", before, after, "--json")
    assert done.exit_code == 0, done.stderr
    document = json.loads(done.stdout)
    assert "Set differently: law.k2 12 -> 3." in document["answer"]
    first, second = (harness.load_results(folder).set_index("key") for folder in (before, after))
    assert len(document["moved"]) == len(document["pairs"]) == 2
    for flight in document["moved"]:
        there, here = flight["keys"]
        assert first.loc[there, "law.name"] == "nftsm"
        assert first.loc[there, "seed"] == second.loc[here, "seed"]
        assert flight["values"] == [first.loc[there, "range_error_rms_m"], second.loc[here, "range_error_rms_m"]]
    assert f"{after}: 0 of 2 flights are those of {before} to the last bit; 2 moved." in document["answer"]
    assert {flight["why"] for flight in document["unpaired"]} == {"without a partner"}
    text = invoke("compare", before, after).stdout
    assert "The flights that moved most:" in text
    done = invoke("report", before, after, "--out", tmp_path / "page.html")
    assert done.exit_code == 0, done.stderr
    assert document["moved"][0]["keys"][0][:12] in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_flights_of_one_design_may_lie_in_several_directories(tmp_path: Path) -> None:
    halves = [flown(tmp_path / law, f"law.name={law}") for law in ("smc", "nftsm")]
    comparison = harness.compare(halves, by="law.name", baseline="smc")
    assert (len(comparison.pairs), comparison.values) == (2, ["nftsm"])


def test_directories_that_hold_other_flights_are_told_what_keeps_them_apart(before: Path, tmp_path: Path) -> None:
    other = flown(tmp_path / "other", "law.name=smc", "seed=[7]")
    done = invoke("compare", before, other)
    assert done.exit_code == 2
    assert "differs from the nearest of the baseline in seed" in done.stderr
    done = invoke("compare", before, before)
    assert (done.exit_code, done.stderr) == (2, f"{before}: is named twice\n")


def test_without_a_setting_named_the_plant_is_compared_or_the_law_or_what_varies() -> None:
    flights = result_matrix({"law.k2": [1.0, 4.0], "law.k3": [0.5, 6.0]})
    assert usual(flights) == "plant"
    alone = flights[flights["plant"] == "sixdof"]
    assert usual(alone) == "law.k2"
    assert usual(alone.assign(**{"law.name": alone["law.k2"].map({1.0: "smc", 4.0: "nftsm"})})) == "law.name"
    with pytest.raises(CompareError, match="1 flight in all"):
        harness.compare(alone.iloc[:1])
