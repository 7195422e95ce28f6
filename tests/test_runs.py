"""Runs as a user meets them: real workers, a real store, killed and resumed."""

import json
import math
import shutil
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

import harness
from harness.metrics import MEANING
from harness.runs.matrix import read_matrix
from harness.runs.results import PARQUET, mixed_versions
from harness.runs.run import Options, Progress, run
from harness.runs.store import JOURNAL
from harness.settings import read_settings

MATRIX = """\
title = "A title"
question = "A question?"
[flight]
plant = "kinematic"
duration_s = 2.0
[flight.law]
name = "nftsm"
gains = "paper_1"
[matrix]
plant = ["kinematic", "sixdof"]
"start.heading_deg" = { uniform = [0.0, 90.0] }
seed = { start = 0, count = 5 }
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "matrix.toml"
    path.write_text(MATRIX, encoding="utf-8")
    return path


def command(*words: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "harness", *map(str, words)], capture_output=True, text=True, check=False, timeout=120
    )


def flown(file: Path, out: Path, *overrides: str, workers: int = 0, **options: object) -> Progress:
    """In this process, or by workers."""
    matrix = read_matrix(read_settings(file, overrides))
    *_, progress = run(matrix, out, Options(workers=workers, log=options.pop("log", "none"), **options))  # type: ignore[arg-type]
    return progress


def digests(out: Path) -> dict[str, str]:
    results = harness.load_results(out)
    return dict(zip(results["key"], results["digest"], strict=True))


def test_a_run_is_told_kept_exported_and_not_flown_twice(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = command("run", file, "--out", out, "--workers", 2)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("A title\nA question?\n10 flights\n")
    assert "10 flown, 0 earlier, 0 failed" in done.stdout
    assert sorted(path.name for path in out.iterdir()) == ["flights", PARQUET, JOURNAL, "lock"]
    results = harness.load_results(out)
    assert len(results) == 10
    assert {f"{key}.rrd" for key in results["key"]} == {path.name for path in (out / "flights").iterdir()}
    again = command("run", file, "--out", out, "--workers", 2)
    assert again.returncode == 0
    assert "0 flown, 10 earlier, 0 failed" in again.stdout
    pd.testing.assert_frame_equal(harness.load_results(out), results)


def test_results_are_one_row_per_flight_with_every_setting_and_metric(file: Path, tmp_path: Path) -> None:
    flown(file, tmp_path / "out", "law.max_heading_rate_deg_s=inf")
    results = harness.load_results(tmp_path / "out")
    assert set(MEANING) <= set(results.columns)
    assert list(results["plant"]) == ["kinematic", "sixdof"] * 5
    assert list(results["seed"]) == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4]
    assert results["wind.steady_mps"].iloc[0] == (0.0, 0.0)
    assert results["law.max_heading_rate_deg_s"].iloc[0] == math.inf
    assert results["feasibility_margin_deg_s"].isna().all()
    assert results["sideslip_peak_deg"].isna().tolist() == [True, False] * 5
    assert (results.groupby("seed")["start.heading_deg"].nunique() == 1).all()
    assert (results["seconds"] > 0).all()


def test_a_row_of_the_store_is_what_fly_prints(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    flown(file, out)
    row = harness.load_results(out).iloc[1]
    place = f"{out}:{row['key'][:7]}"
    again = command("fly", place, "--json")
    assert again.returncode == 0, again.stderr
    assert "the same flight as stored, to the last bit" in again.stderr
    answer = json.loads(again.stdout)
    assert (answer["key"], answer["digest"]) == (row["key"], row["digest"])
    assert answer["metrics"]["bank_peak_deg"] == row["bank_peak_deg"]
    other = json.loads(command("fly", place, "--json", "--set", "plant=kinematic").stdout)
    assert other["key"] == harness.load_results(out).iloc[0]["key"]
    told = command("show", place).stdout
    assert "It flew to its end." in told
    assert "sixdof ultra_stick_25e" in told
    assert "bank_peak_deg" in told


@pytest.mark.parametrize("key", ["", "zz", "f" * 40])
def test_a_key_that_names_no_row_is_one_line(file: Path, tmp_path: Path, key: str) -> None:
    flown(file, tmp_path / "out", "seed=0", "plant=kinematic")
    done = command("show", f"{tmp_path / 'out'}:{key}")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "no flight has a key" in done.stderr


def test_a_row_is_flown_from_the_store_when_its_track_and_its_airframe_are_gone(tmp_path: Path) -> None:
    track, airframe = tmp_path / "track.csv", tmp_path / "my_plane"
    track.write_text("time_s,north_m,east_m\n" + "".join(f"{t},{2 * t},{t * t / 9}\n" for t in range(5)))
    shipped = Path(harness.__file__).parent.parent / "aircraft" / "skywalker_x8"
    shutil.copytree(shipped, airframe)
    (airframe / "skywalker_x8.xml").rename(airframe / "my_plane.xml")
    file, out = tmp_path / "one.toml", tmp_path / "out"
    flight = f'[flight]\nplant = "sixdof"\naircraft = "{airframe}"\nduration_s = 2.0\n[flight.law]\nname = "smc"\n'
    file.write_text(flight + '[flight.target]\ntrack = "track.csv"\n')
    flown(file, out)
    track.unlink()
    shutil.rmtree(airframe)
    (key,) = harness.load_results(out)["key"]
    done = command("fly", f"{out}:{key[:6]}")
    assert done.returncode == 0, done.stderr
    assert "the same flight as stored, to the last bit" in done.stderr


def test_the_number_of_workers_and_the_order_change_nothing(file: Path, tmp_path: Path) -> None:
    flown(file, tmp_path / "serial")
    alone = digests(tmp_path / "serial")
    for workers in (1, 2, 4):
        flown(file, tmp_path / f"{workers}", workers=workers)
        assert digests(tmp_path / f"{workers}") == alone


def test_a_changed_setting_law_track_or_airframe_is_a_new_flight_and_a_mix_is_told(tmp_path: Path, file: Path) -> None:
    out = tmp_path / "out"
    flown(file, out, "plant=kinematic")
    assert flown(file, out, "plant=kinematic", "duration_s=3.0").done == 5
    assert mixed_versions(out) == []
