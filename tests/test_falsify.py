"""A search for the flight that breaks a requirement: planted failures, real ones, and what is said of none."""

import json
import os
import signal
import subprocess
from pathlib import Path

import numpy as np
import pytest
from scipy.stats.qmc import discrepancy

import harness
from benchmarks.guided_falsify import probed
from benchmarks.planted_failures import flights_needed, needed_at_random
from harness.review.reading import read_logs
from harness.search.prober import Prober
from harness.settings import load_flight
from harness.verdict.statistics import upper_bound
from tests.builders import command, invoke, words_of, write
from tests.processes import runs_of, until

KINEMATIC = """\
[flight]
plant = "kinematic"
duration_s = 60.0
law = { name = "nftsm", gains = "fitted" }
"""
OVER = ("--over", "start.heading_deg=0:360", "--over", "target.speed_mps=0:6")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return write(tmp_path / "moving.toml", KINEMATIC)


def falsify(file: Path, out: Path, *words: object, workers: int = 0) -> str:
    done = invoke("falsify", file, "--out", out, *OVER, "--workers", workers, *words)
    assert done.exit_code == 0, done.output
    return done.output


@pytest.mark.parametrize(
    ("kind", "dimensions", "share"), [("bowl", 2, 0.001), ("ripple", 3, 0.01), ("kink", 4, 0.01), ("dips", 6, 0.01)]
)
def test_planted_failures_with_a_slope_are_found_with_half_of_what_random_search_needs(
    kind: str, dimensions: int, share: float
) -> None:
    needed = [flights_needed(kind, dimensions, share, seed) for seed in range(6)]
    assert max(needed) <= 0.5 * needed_at_random(share, 0.95)
    assert max(needed) <= 300


def test_a_failure_of_one_in_a_thousand_inside_a_flat_step_is_found() -> None:
    for dimensions in (2, 3, 4):
        assert max(flights_needed("stairs", dimensions, 0.001, seed) for seed in range(4)) <= 300


def test_answers_that_are_all_equal_leave_points_more_even_than_uniform_draws() -> None:
    prober = Prober(3, 0)
    for i in range(120):
        prober.tell(prober.ask(prober.is_uniform(i)), 1.0)
    even = discrepancy([prober.ask(False).at for _ in range(120)])
    assert even < 0.5 * discrepancy(np.random.default_rng(0).random((120, 3)))


def test_the_counterexample_breaks_the_requirement_when_it_is_flown_again(file: Path, tmp_path: Path) -> None:
    out = falsify(file, tmp_path / "out", "--requirement", "range_error_peak_m < 5", "--flights", 24)
    assert "to be broken: range_error_peak_m < 5" in out
    again = json.loads(command("fly", tmp_path / "out" / "counterexample.toml", "--json").stdout)
    results = harness.load_results(tmp_path / "out").set_index("key")
    assert again["metrics"]["range_error_peak_m"] == results["range_error_peak_m"].max() > 5.0
    assert again["key"] in results.index
    done = invoke("view", tmp_path / "out" / "counterexample.toml", "--save", tmp_path / "a.rrd")
    assert done.exit_code == 0, done.output
    assert read_logs(tmp_path / "a.rrd")["kinematic"].digest == again["digest"]


def test_a_search_is_the_same_on_any_number_of_workers_and_when_it_is_resumed(file: Path, tmp_path: Path) -> None:
    words = ("--requirement", "convergence_time_s < 30")
    falsify(file, tmp_path / "a", *words, "--flights", 8)
    assert "8 flown, 8 earlier, 0 failed" in falsify(file, tmp_path / "a", *words, "--flights", 16)
    falsify(file, tmp_path / "b", *words, "--flights", 16, workers=2)
    for name in ("trials.csv", "counterexample.toml"):
        assert (tmp_path / "a" / name).read_text() == (tmp_path / "b" / name).read_text()


def test_of_none_the_bound_is_that_of_the_uniform_trials_alone(file: Path, tmp_path: Path) -> None:
    out = falsify(file, tmp_path / "out", "--requirement", "range_error_peak_m < 1e6", "--flights", 20)
    assert "none in 20 trials; above is the one that came closest" in out
    again = falsify(file, tmp_path / "out", "--requirement", "range_error_peak_m < 1e6", "--flights", 20, "--json")
    told = json.loads(again.splitlines()[-1])
    assert told["counterexample"] is None
    uniform = told["uniform"]
    assert 5 <= uniform["trials"] < 20
    assert uniform["broken"] == 0
    assert uniform["share"] == pytest.approx(1.0 - 0.05 ** (1.0 / uniform["trials"]))  # Clopper and Pearson, of none
    assert "safe" not in out
    assert not (tmp_path / "out" / "counterexample.toml").exists()


def test_ctrl_c_keeps_what_was_flown_and_the_same_command_goes_on(tmp_path: Path) -> None:
    file, out = write(tmp_path / "long.toml", KINEMATIC.replace("60.0", "300.0")), tmp_path / "out"
    asked = ("--requirement", "convergence_time_s < 30", "--flights", 60, "--workers", 2)
    words = ("falsify", file, "--out", out, *OVER, *asked)
    process = subprocess.Popen(
        words_of(*words), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    until(lambda: runs_of(out), process)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to every process
    _, errors = process.communicate(timeout=20)
    assert process.returncode == 130, errors
    assert errors.splitlines()[-1] == "interrupted"
    kept = len(runs_of(out))
    assert 0 < kept < 60
    assert f"{60 - kept} flown, {kept} earlier, 0 failed" in command(*words).stdout


def test_the_upper_bound_holds_the_share_in_95_of_100_cases() -> None:
    assert upper_bound(0, 59) == pytest.approx(0.0495, abs=1e-4)
    assert upper_bound(3, 3) == 1.0


def test_a_real_aircraft_loses_its_target_and_the_search_finds_how(tmp_path: Path) -> None:
    text = KINEMATIC.replace("kinematic", "sixdof").replace("60.0", "30.0")
    file = write(tmp_path / "lost.toml", f"{text}[flight.metrics]\nmonitoring_range_m = 400.0\n")
    out = falsify(file, tmp_path / "out", "--requirement", "outcome = completed", "--flights", 16)
    assert "target_lost" in out
    flight = load_flight(tmp_path / "out" / "counterexample.toml")
    assert harness.simulate(flight).outcome == "target_lost"


def test_a_guide_that_is_right_halves_the_flights_and_one_that_is_wrong_hides_no_failure() -> None:
    unguided, right, wrong = (
        [probed("dips", guide, seed, 100)[-1] for seed in range(3)]
        for guide in ("", "the same function", "another function")
    )
    assert sum(right) <= 0.5 * sum(unguided)
    assert max(wrong) <= 100


def test_a_search_of_a_real_aircraft_is_guided_by_a_cheaper_plant_and_goes_on_with_more_flights(tmp_path: Path) -> None:
    file = write(tmp_path / "moving.toml", KINEMATIC.replace("kinematic", "sixdof").replace("60.0", "20.0"))
    words = ("--requirement", "range_error_peak_m < 150", "--json")
    falsify(file, tmp_path / "out", *words, "--flights", 4)
    told = json.loads(falsify(file, tmp_path / "out", *words, "--flights", 8).splitlines()[-1])
    assert told["guide"]["plant"] == "coordinated"
    assert told["guide"]["broken"] > 0
    assert told["first_broken"] <= 2  # the first one that is no uniform draw
    assert (told["trials"], told["uniform"]["trials"]) == (8, 2)
    flown = harness.load_results(tmp_path / "out")["plant"].value_counts()
    assert 32 < flown["coordinated"] <= 64  # one that is asked for twice is flown once
    assert flown["sixdof"] == 8
    assert load_flight(tmp_path / "out" / "counterexample.toml").plant == "sixdof"
    alone = json.loads(falsify(file, tmp_path / "alone", *words, "--flights", 2, "--guide", "none").splitlines()[-1])
    assert alone["guide"] is None


def test_a_plant_without_the_metric_is_no_guide(tmp_path: Path) -> None:
    file = write(tmp_path / "moving.toml", KINEMATIC.replace("kinematic", "sixdof").replace("60.0", "5.0"))
    out = falsify(file, tmp_path / "out", "--requirement", "sideslip_peak_deg < 30", "--flights", 2)
    assert "coordinated has no sideslip_peak_deg, so it was no guide" in out
    assert "10 flown, 0 earlier" in out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--requirement", "laps > 1", "--guide", "lagged"], "must be a cheaper plant than kinematic"),
        (["--requirement", "speed < 5"], "--requirement 'speed < 5': "),
        (["--requirement", "laps"], "--requirement 'laps': "),
        (["--requirement", "laps > 1", "--over", "law.k2=3"], "--over law.k2=3: must be KEY=LO:HI"),
    ],
)
def test_bad_input_is_one_line(words: list[str], said: str, file: Path, tmp_path: Path) -> None:
    done = invoke("falsify", file, "--out", tmp_path / "out", *OVER, *words)
    assert done.exit_code == 2
    assert said in done.output
    assert len(done.output.splitlines()) == 1
