"""A search for settings: the same on any number of workers, resumed, checked against a grid, and told plainly."""

import csv
import os
import signal
import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import harness
from harness.flight import Flight
from harness.log.metric import measure
from harness.requirement import requirement
from harness.runs.run import Options
from harness.search.dimension import Dimension, dimension
from harness.search.files import TRIALS
from harness.search.sampler import Sampler
from harness.search.space import Space
from harness.search.tune import AT_ONCE, Tuning, tuning
from harness.settings import document, load_flight, read_settings
from harness.settings.written import toml
from harness.world.target import Segment, Target
from harness.world.wind import Gust, Wind
from tests.builders import EXPERIMENTS, FLIGHT, HERE, command, invoke, words_of, write
from tests.processes import ended, runs_of, until

KINEMATIC = """\
question = "How fast?"
[flight]
plant = "kinematic"
duration_s = {duration}
[flight.law]
name = "nftsm"
gains = "fitted"
[matrix]
seed = {{ start = 0, count = 2 }}
"start.heading_deg" = {{ uniform = [10.0, 70.0] }}
"""
OVER = ("--over", "law.k2=0.5:20", "--over", "law.k3=0:10")
PEAK = ("--minimise", "range_error_peak_m")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return write(tmp_path / "tune.toml", KINEMATIC.format(duration=60))


def tune(file: Path, out: Path, *words: object, workers: int = 0) -> str:
    """What the command prints; it must have found settings."""
    done = invoke("tune", file, "--out", out, *OVER, *PEAK, "--workers", workers, *words)
    assert done.exit_code == 0, done.output
    return done.output


def test_a_search_is_the_same_on_any_number_of_workers_and_when_it_is_resumed(file: Path, tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    tune(file, first, "--flights", 14)
    assert "28 flown, 0 earlier, 0 failed" in tune(file, second, "--flights", 28, workers=2)
    assert "14 flown, 14 earlier, 0 failed" in tune(file, first, "--flights", 28)
    for name in ("best.toml", TRIALS):
        assert (first / name).read_text() == (second / name).read_text()
    other = tmp_path / "other"
    tune(file, other, "--flights", 28, "--seed", 1)
    assert (other / TRIALS).read_text() != (second / TRIALS).read_text()


def test_every_trial_flies_the_same_conditions_and_each_flight_is_a_row_of_a_run(file: Path, tmp_path: Path) -> None:
    tune(file, tmp_path / "out", "--flights", 12, "--set", 'plant=["kinematic","lagged"]')
    flights = harness.load_results(tmp_path / "out")
    assert len(flights) == 12
    drawn = flights.groupby(["law.k2", "law.k3"])[["plant", "seed", "start.heading_deg"]].agg(tuple)
    assert len(drawn) == 3
    assert all(drawn[column].nunique() == 1 for column in drawn)
    assert invoke("show", tmp_path / "out").exit_code == 0
    compared = invoke("compare", tmp_path / "out")
    assert compared.exit_code == 0
    assert "6 pairs" in compared.output


def test_the_best_settings_are_a_file_whose_flight_reaches_what_was_printed(file: Path, tmp_path: Path) -> None:
    tune(file, tmp_path / "out", "--flights", 16)
    with (tmp_path / "out" / TRIALS).open(newline="") as text:
        best = min((row for row in csv.DictReader(text) if row["range_error_peak_m"]), key=_peak)
    flight = load_flight(tmp_path / "out" / "best.toml")
    peak = measure(harness.simulate(flight))["range_error_peak_m"]
    assert peak == float(best["range_error_peak_m"])
    flights = harness.load_results(tmp_path / "out").set_index("key").loc[best["flights"].split()]
    assert flights["range_error_peak_m"].max() == peak
    assert set(flights["law.k2"]) == {float(best["law.k2"])}


def _peak(row: dict[str, str]) -> float:
    return float(row["range_error_peak_m"])


def test_the_mean_over_the_conditions_is_minimised_when_it_is_asked_for(file: Path, tmp_path: Path) -> None:
    tune(file, tmp_path / "out", "--flights", 8, "--aggregate", "mean")
    flights = harness.load_results(tmp_path / "out").set_index("key")
    with (tmp_path / "out" / TRIALS).open(newline="") as text:
        for row in csv.DictReader(text):
            of_trial = flights.loc[row["flights"].split(), "range_error_peak_m"]
            assert float(row["range_error_peak_m"]) == pytest.approx(of_trial.mean())


def test_two_metrics_give_a_front_with_a_file_for_each_point(file: Path, tmp_path: Path) -> None:
    search = searched(Space(read_settings(file), [dimension("law.k2=0.5:20"), dimension("law.k3=0:10")]),
                      ["convergence_time_s", "saturation_fraction"], [], tmp_path / "out", 60)  # fmt: skip
    reached = [attempt.goals for attempt in search.attempts if attempt.goals]
    front = [attempt.goals for attempt in search.front]
    assert front == sorted(front)
    for goals in front:
        assert not any(all(x <= y for x, y in zip(other, goals, strict=True)) and other != goals for other in reached)
    both = ("--minimise", "convergence_time_s", "--minimise", "saturation_fraction")
    done = invoke("tune", file, "--out", tmp_path / "out", *OVER, *both, "--flights", 60, "--workers", 0)
    assert "0 flown, 60 earlier" in done.output
    assert {path.name for path in (tmp_path / "out").glob("best*")} == {
        f"best_{i}.toml" for i in range(1, len(front) + 1)
    }
    tune(file, tmp_path / "out", "--flights", 8)
    assert {path.name for path in (tmp_path / "out").glob("best*")} == {"best.toml"}


def searched(
    space: Space, goals: Sequence[str], asked: Sequence[str], out: Path, flights: int, options: Options = HERE
) -> Tuning:
    search = tuning(space, goals, [requirement(text) for text in asked], margin=1.5, flights=flights)
    for _ in search.fly(out, options):
        pass
    return search


@pytest.mark.parametrize("airframe", ["ultra_stick_25e", "skywalker_x8", "aerosonde"])
def test_on_each_airframe_it_finds_the_quiet_gains_of_a_fine_grid_with_a_tenth_of_its_flights(
    airframe: str, tmp_path: Path
) -> None:
    """On one line of gains, behind the identified response; benchmarks/tuned_gains.py does the plane on 6-DOF."""
    gains = Dimension("law.k2", 0.1, 10.0)
    overrides = [f"aircraft={airframe}", "plant=lagged", "law.k3=0.3"]
    space = Space(read_settings(EXPERIMENTS / "tune.toml", overrides), [gains])
    grid = [space.candidate({"law.k2": float(k2)}, ["limit_cycle_margin"]) for k2 in np.geomspace(0.1, 10.0, 60)]
    margin, quiet = requirement("limit_cycle_margin >= 1.5"), requirement("chatters = false")
    kept = [each for each in grid if all(map(margin.is_met, each.foreseen))]
    assert 20 < len(kept) < 60
    metrics = [[measure(harness.simulate(flight)) for flight in each.flights] for each in kept]
    best = min(
        max(float(one["range_error_rms_m"] or 0.0) for one in each) for each in metrics if all(map(quiet.is_met, each))
    )
    search = searched(
        space, ["range_error_rms_m"], ["chatters = false"], tmp_path / "out", len(kept) * len(space.conditions) // 10
    )
    found = search.front[0].goals[0]
    assert found <= max(1.1 * best, best + 1e-3)


def test_settings_that_come_too_near_to_the_limit_cycle_are_refused_before_they_are_flown(tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = ("--minimise", "range_error_rms_m", "--flights", 20, "--workers", 0)
    done = invoke("tune", EXPERIMENTS / "tune.toml", "--out", out, "--over", "law.k2=15:20", *words)
    assert done.exit_code == 1
    (sentence,) = (line for line in done.stdout.splitlines() if line.startswith("no settings meet the requirements"))
    assert sentence.endswith(" in 300 trials: limit_cycle_margin >= 1.5 refused 300, before they were flown")
    assert runs_of(out) == {}
    assert not (out / "best.toml").exists()


def test_a_margin_that_is_unknown_is_not_checked_and_that_is_said(file: Path, tmp_path: Path) -> None:
    done = invoke("tune", file, "--out", tmp_path / "out", *OVER, *PEAK, "--flights", 8, "--workers", 0)
    assert done.exit_code == 0, done.output
    assert "warning: limit_cycle_margin was unknown in 4 of 4 trials and was not checked there\n" in done.stderr


def test_an_infeasible_search_says_what_refused_how_many_trials(file: Path, tmp_path: Path) -> None:
    words = ("--subject-to", "range_error_peak_m < 1e-9", "--flights", 8, "--workers", 0)
    done = invoke("tune", file, "--out", tmp_path / "out", *OVER, *PEAK, *words)
    assert done.exit_code == 1
    assert "no settings meet the requirements in 4 trials: range_error_peak_m < 1e-09 refused 4\n" in done.stdout
    words = ("--subject-to", "bank_peak_deg < 45", "--flights", 8, "--workers", 0)
    done = invoke("tune", file, "--out", tmp_path / "out", *OVER, *PEAK, *words)
    assert "in 4 trials: bank_peak_deg < 45 (unknown) refused 4\n" in done.stdout


def test_flights_that_do_not_last_are_told_with_their_reason(file: Path, tmp_path: Path) -> None:
    file.write_text(file.read_text().replace("[matrix]", "[flight.metrics]\nmonitoring_range_m = 100.0\n[matrix]"))
    done = invoke("tune", file, "--out", tmp_path / "out", *OVER, *PEAK, "--flights", 4, "--workers", 0)
    assert done.exit_code == 1
    assert "outcome = completed refused 2" in done.stdout
    assert "4 x target_lost: beyond the monitoring range, 100 m\n" in done.stdout


def test_a_key_that_is_searched_is_no_axis_of_the_matrix() -> None:
    space = Space(read_settings(EXPERIMENTS / "gains.toml"), [dimension("law.k2=0.5:20")])
    assert len(space.conditions) == 4 * 4  # plants, and values of k3
    flights = space.candidate({"law.k2": 3.25}).flights
    assert {document(flight)["law"]["k2"] for flight in flights} == {3.25}


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--over", "law.k2"], "--over law.k2: must be KEY=LO:HI, as in law.k2=0.5:20"),
        (["--over", "law.k2=20:5"], "--over law.k2=20:5: LO and HI must be two numbers, the lower one first"),
        (["--over", "law.k2=-1:5"], "--over law.k2=-1.0: flight.law.k2: is -1.0, must be a number > 0"),
        (["--over", "plant=1:5"], "--over plant=1.0: flight.plant: is 1.0, must be one of "),
        (["--over", "law.k3=1:5", "--over", "law.k3=1:5"], "--over law.k3=1:5: law.k3 is given twice"),
        (["--over", "law.k3=1:5", "--set", "law.k3=2"], "--over law.k3=1:5: --set law.k3=2 gives it one value"),
        (["--over", "law.k3=1:5", "--minimise", "laps", "--minimise", "overshoot_m"], "--minimise is "),
        (["--over", "law.k3=1:5", "--flights", "1"], "--flights is 1, must be 2 at least, which is one trial"),
        (["--over", "law.k3=1:5", "--subject-to", "chatter=false"], "did you mean 'chatters'?"),
    ],
)
def test_a_mistake_is_one_line_that_says_what_is_allowed(file: Path, words: list[str], said: str) -> None:
    done = invoke("tune", file, "--out", file.parent / "out", *PEAK, *words)
    assert done.exit_code == 2
    (line,) = done.stderr.splitlines()
    assert said in line
    assert not (file.parent / "out").exists()


def test_ctrl_c_keeps_what_was_flown_and_the_same_command_goes_on(tmp_path: Path) -> None:
    file, out = write(tmp_path / "long.toml", KINEMATIC.format(duration=300)), tmp_path / "out"
    words = words_of("tune", file, "--out", out, *OVER, *PEAK, "--flights", 60, "--workers", 2)
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)
    until(lambda: runs_of(out), process)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to every process
    _, errors = process.communicate(timeout=20)
    assert process.returncode == 130, errors
    assert ended(process.pid, within=1.0)
    assert "Traceback" not in errors
    assert errors.splitlines()[-1] == "interrupted"
    kept = len(runs_of(out))
    assert 0 < kept < 60
    done = command("tune", file, "--out", out, *OVER, *PEAK, "--flights", 60, "--workers", 2)
    assert f"{60 - kept} flown, {kept} earlier, 0 failed" in done.stdout


def test_a_written_flight_is_read_back_as_it_was(tmp_path: Path) -> None:
    wind = Wind(steady=(1.0, -2.0), gusts=(Gust(from_=1.0, to=2.0, velocity=(0.0, 1.0, 0.5)),))
    segments = (Segment(from_=1.0, to=2.0, acceleration=0.1, turn_rate=0.02),)
    for flight in (
        FLIGHT,
        load_flight(EXPERIMENTS / "stationary.toml", ["law.max_heading_rate_deg_s=inf"]),
        Flight(plant="sixdof", law=FLIGHT.law, wind=wind, target=Target(speed=3.0, segments=segments)),
    ):
        assert load_flight(write(tmp_path / "flight.toml", toml(flight))) == flight


def test_a_search_of_one_setting_asks_for_a_whole_batch_before_it_is_told() -> None:
    sampler = Sampler([dimension("law.k2=1:9")], 1, 0)
    asked = [sampler.ask() for _ in range(AT_ONCE)]
    assert len({ask.values["law.k2"] for ask in asked}) == AT_ONCE
