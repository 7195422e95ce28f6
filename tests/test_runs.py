"""Runs as a user meets them: real workers, a real store, killed and resumed."""

import contextlib
import itertools
import json
import math
import os
import platform
import shutil
import sqlite3
import subprocess
import sys
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path

import pandas as pd
import pyarrow.parquet as pq
import pytest

import harness
from harness.log.metric import METRICS, YES_OR_NO
from harness.runs.comparable import comparable
from harness.runs.description import description
from harness.runs.journal import JOURNAL, reading
from harness.runs.matrix import read_matrix
from harness.runs.results import PARQUET, export
from harness.runs.store import find
from harness.runs.workers import Task, WorkerResult
from harness.settings import read_settings
from harness.verdict.pairs import settings_of
from tests.builders import (
    EXPERIMENTS,
    HERE,
    MATRIX,
    ROOT,
    command,
    copied_airframe,
    digests,
    fly_matrix,
    invoke,
    result_matrix,
    words_of,
    write,
)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return write(tmp_path / "matrix.toml", MATRIX)


def test_a_run_is_told_kept_exported_and_not_flown_twice(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = command("run", file, "--out", out, "--workers", 2)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("A title\nA question?\n10 flights\n")
    assert done.stderr.splitlines()[-1].startswith("10 of 10 flights done, 0 failed, ")
    kinematic, sixdof = (line.split() for line in done.stdout.splitlines() if " of 5 " in line)
    assert kinematic[:4] == ["kinematic", "0", "of", "5"]
    assert kinematic[-1] == "-" != sixdof[-1]  # the median sideslip
    assert "10 flown, 0 earlier, 0 failed" in done.stdout
    assert sorted(path.name for path in out.iterdir()) == ["flights", PARQUET, JOURNAL, "lock"]
    results = harness.load_results(out)
    assert len(results) == 10
    assert {f"{key}.rrd" for key in results["key"]} == {path.name for path in (out / "flights").iterdir()}
    exported = (out / PARQUET).stat().st_mtime_ns
    again = command("run", file, "--out", out, "--workers", 2)
    assert again.returncode == 0
    assert "0 flown, 10 earlier, 0 failed" in again.stdout
    assert (out / PARQUET).stat().st_mtime_ns == exported  # there was nothing to add
    pd.testing.assert_frame_equal(harness.load_results(out), results)


def test_the_table_of_another_journal_is_not_read_for_this_ones(file: Path, tmp_path: Path) -> None:
    out, copy = tmp_path / "out", tmp_path / "copy"
    fly_matrix(file, out, "start.heading_deg=10.0")
    export(out)
    (out / JOURNAL).rename(tmp_path / "moved")
    fly_matrix(file, out, "start.heading_deg=20.0")
    assert set(harness.load_results(out)["start.heading_deg"]) == {20.0}
    shutil.copytree(out, copy)  # from here on each goes its own way, with as many flights
    for folder, heading in ((out, 30.0), (copy, 40.0)):
        fly_matrix(file, folder, f"start.heading_deg={heading}")
        export(folder)
    shutil.copy(out / JOURNAL, copy / JOURNAL)
    assert set(harness.load_results(copy)["start.heading_deg"]) == {20.0, 30.0}


def test_a_journal_of_an_earlier_format_is_read_as_it_is_and_upgraded_by_the_next_run(
    file: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    fly_matrix(file, out)
    results = harness.load_results(out)
    with contextlib.closing(sqlite3.connect(out / JOURNAL)) as journal:  # what format 1 had in place of the state
        journal.executescript(
            "ALTER TABLE runs DROP COLUMN processor; DROP TABLE state; "
            "CREATE TABLE changes (number INTEGER NOT NULL); INSERT INTO changes VALUES (1); "
            "PRAGMA user_version = 1;"
        )
    before = (out / JOURNAL).read_bytes()
    pd.testing.assert_frame_equal(harness.load_results(out), results)
    assert (out / JOURNAL).read_bytes() == before
    assert fly_matrix(file, out).earlier == len(results)
    pd.testing.assert_frame_equal(harness.load_results(out), results)


def test_a_run_where_others_were_flown_with_another_library_or_processor_warns_once(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    fly_matrix(file, out, "seed=0")
    with contextlib.closing(sqlite3.connect(out / JOURNAL)) as journal:
        journal.execute("UPDATE runs SET packages = json_set(packages, '$.numpy', '2.2.0'), processor = 'arm64 (a)'")
        journal.commit()
    told = r"flown elsewhere \(processor arm64 \(a\) there, .* here; numpy 2\.2\.0 there, .* here\).*`harness doctor`"
    with pytest.warns(UserWarning, match=told) as warned:
        assert fly_matrix(file, out, "seed=1").earlier == 0
    assert len(warned) == 1
    fly_matrix(file, out, "seed=2")


def test_a_journal_of_a_later_format_is_refused_with_what_to_do(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    fly_matrix(file, out, "seed=0", "plant=kinematic")
    with contextlib.closing(sqlite3.connect(out / JOURNAL)) as journal:
        journal.execute("PRAGMA user_version = 99")
    for words in (("run", file, "--out", out), ("show", out)):
        done = command(*words)
        assert done.returncode == 2
        assert "has format 99, this harness reads formats 1 to " in done.stderr
        assert "use the harness that wrote it, or another directory" in done.stderr


def test_the_exported_table_says_of_each_column_what_it_is(file: Path, tmp_path: Path) -> None:
    fly_matrix(file, tmp_path / "out")
    export(tmp_path / "out")
    schema = pq.read_schema(tmp_path / "out" / PARQUET)
    kinds = {field.name: field.metadata[b"kind"].decode() for field in schema}
    assert {name for name, kind in kinds.items() if kind == "metric"} == set(METRICS)
    results = {"key", "outcome", "reason", "digest", "feasibility_margin_deg_s", "seconds", "run", "version"}
    assert {name for name, kind in kinds.items() if kind == "result"} == results
    assert schema.field("bank_peak_deg").metadata[b"unit"] == b"deg"


def test_a_new_column_of_results_is_no_setting_and_leaves_the_pairs_as_they_are() -> None:
    flights = result_matrix()
    added = flights.assign(note=[f"of flight {i}" for i in range(len(flights))], smoothness_m=range(len(flights)))
    assert settings_of(added) == settings_of(flights)
    pd.testing.assert_frame_equal(harness.compare(added).differences, harness.compare(flights).differences)


def test_results_flown_before_a_metric_was_added_have_its_column_without_a_value(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fly_matrix(file, tmp_path / "out")
    added = {
        "added_m": replace(METRICS["overshoot_m"], name="added_m"),
        "is_added": replace(METRICS["overshoot_m"], unit=YES_OR_NO),
    }
    monkeypatch.setattr("harness.runs.results.METRICS", {**METRICS, **added})
    results = harness.load_results(tmp_path / "out")
    assert results["added_m"].isna().all()
    assert results["added_m"].dtype == float
    assert results["is_added"].isna().all()
    assert results["is_added"].dtype == "boolean"


def test_a_value_that_is_listed_twice_is_flown_and_counted_once(tmp_path: Path) -> None:
    out = tmp_path / "out"
    text = MATRIX.replace("{ uniform = [0.0, 90.0] }", "[0.0, 5, -0.0, 5.0]").replace("count = 5", "count = 1")
    file = write(tmp_path / "matrix.toml", text + '[[include]]\nplant = "kinematic"\n"start.heading_deg" = -0.0\n')
    done = invoke("run", file, "--out", out, "--workers", 0, "--log", "none", "--set", "seed=[3, 3]")
    assert done.exit_code == 0, done.stderr
    line = text.splitlines().index('"start.heading_deg" = [0.0, 5, -0.0, 5.0]') + 1
    for place in (f"{file}:{line}: start.heading_deg: lists -0.0", f"{file}:{line}: start.heading_deg: lists 5.0"):
        assert done.stderr.count(f"warning: {place} more than once; it is flown and counted once\n") == 1
    assert done.stderr.count("warning: --set seed: lists 3 more than once") == 1
    assert "1 flight of the matrix the same as another one: flown and counted once" in done.stdout
    assert done.stdout.splitlines()[-2].startswith("4 flown, 0 earlier, 0 failed")
    assert len(digests(out)) == 4
    again = invoke("run", file, "--out", out, "--workers", 0, "--log", "none", "--set", "seed=[3, 3]")
    assert again.stdout.splitlines()[-2].startswith("0 flown, 4 earlier, 0 failed")


def test_a_flight_that_is_there_twice_is_not_compared_as_two() -> None:
    flights = result_matrix()
    twice = flights.head(1).assign(key="another", **{"start.heading_deg": flights["start.heading_deg"][0]})
    with pytest.raises(harness.CompareError, match="2 flights have the same settings as another"):
        harness.compare(pd.concat([flights, twice], ignore_index=True))


def test_a_run_without_a_flight_yet_is_told_in_one_sentence(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"

    def interrupted(task: Task, folder: Path) -> WorkerResult:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fly_matrix(file, out, options=replace(HERE, fly=interrupted))
    for words in (("show",), ("show", "--csv"), ("compare",), ("report",), ("export", "--to", "csv")):
        done = invoke(words[0], out, *words[1:])
        assert done.exit_code == 2
        assert done.stderr.startswith(
            f"{out}: has no flight yet: its run ended before the first, or is at it; to go on: "
        )
        assert done.stderr.count("\n") == 1
    assert fly_matrix(file, out).done == 10


def test_a_file_is_read_once_so_that_a_pipe_keeps_its_margins(tmp_path: Path) -> None:
    out, text = tmp_path / "out", MATRIX + "[assess]\nrange_error_margin_m = 100.0\n"
    run_it = words_of("run", "/dev/stdin", "--out", out, "--workers", 0, "--limit", 1, "--log", "none")
    done = subprocess.run(run_it, input=text, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert comparable([out]).assess.range_error_margin == 100.0


def test_a_file_in_the_place_of_the_directory_is_told_and_left(file: Path) -> None:
    done = command("run", file, "--out", file)
    assert done.returncode == 2
    assert done.stderr == f"{file}: is a file, not a folder\n"
    assert file.read_text(encoding="utf-8") == MATRIX


def test_progress_moves_on_a_terminal(file: Path, tmp_path: Path) -> None:
    terminal, its_end = os.openpty()
    words = words_of("run", file, "--out", tmp_path / "out", "--workers", 0, "--log", "none")
    with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=its_end) as run_:
        os.close(its_end)
        shown = ""
        with contextlib.suppress(OSError):  # the terminal's, when the last one that writes to it has ended
            while part := os.read(terminal, 10_000):
                shown += part.decode(errors="replace")
    os.close(terminal)
    assert run_.returncode == 0, shown
    assert "10 of 10 flights done, 0 failed" in shown
    assert "flights/s" in shown
    assert "\x1b[2K" in shown  # a line is replaced by the next


def test_results_are_one_row_per_flight_with_every_setting_and_metric(file: Path, tmp_path: Path) -> None:
    fly_matrix(file, tmp_path / "out", "law.max_heading_rate_deg_s=inf")
    results = harness.load_results(tmp_path / "out")
    assert set(METRICS) <= set(results.columns)
    assert list(results["plant"]) == ["kinematic", "sixdof"] * 5
    assert list(results["seed"]) == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4]
    assert results["wind.steady_mps"].iloc[0] == (0.0, 0.0)
    assert results["law.max_heading_rate_deg_s"].iloc[0] == math.inf
    assert results["feasibility_margin_deg_s"].isna().all()
    assert results["sideslip_peak_deg"].isna().tolist() == [True, False] * 5
    assert (results.groupby("seed")["start.heading_deg"].nunique() == 1).all()
    assert (results["seconds"] > 0).all()


def test_that_no_heading_rate_holds_the_circle_is_kept_and_told_wherever_a_row_goes(tmp_path: Path) -> None:
    settings = MATRIX.replace('"sixdof"', '"lagged"') + '"target.speed_mps" = [4.0, 13.0]\n'
    out = tmp_path / "out"
    fly_matrix(write(tmp_path / "matrix.toml", settings), out, "law.max_heading_rate_deg_s=45")
    export(out)
    for table in (harness.load_results(out), pd.read_parquet(out / PARQUET)):
        margins = table.groupby("target.speed_mps")["feasibility_margin_deg_s"].agg(set)
        assert margins[13.0] == {-math.inf}
        assert margins[4.0] != {-math.inf}
        assert min(margins[4.0]) > 0.0
    key = harness.load_results(out).set_index("target.speed_mps")["key"].loc[13.0].iloc[0]
    said = invoke("show", f"{out}:{key}").stdout
    assert "INFEASIBLE, it cannot be held at any heading rate" in said
    flown = json.loads(invoke("fly", f"{out}:{key}", "--json").stdout, parse_constant=pytest.fail)
    assert flown["feasibility_margin_deg_s"] == -sys.float_info.max
    compared = invoke("compare", out).stdout
    assert "In 5 pairs the circle cannot be held at any heading rate" in compared
    assert "the heading-rate limit is below" not in compared


def test_a_row_of_the_store_is_what_fly_prints(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    fly_matrix(file, out)
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
    told = command("show", place)
    assert told.returncode == 0, told.stderr
    for word in ("The flight lasted its full duration.", "sixdof ultra_stick_25e", "bank_peak_deg", row["digest"]):
        assert word in told.stdout
    _, listed = command("show", out).stdout.rsplit("---\n")
    assert len(listed.splitlines()) == 10
    assert [row["key"][:8], "sixdof", "0"] == listed.splitlines()[1].split()[:3]


def test_a_description_names_the_air_that_the_flight_met(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    fly_matrix(file, out, "seed=0", "plant=kinematic", "wind.turbulence=light", "wind.steady_mps=[3.0, 0.0]")
    told = list(description(out, find(out, harness.load_results(out)["key"][0])))
    (line,) = (line for line in told if line.startswith("law "))
    assert "wind of 3 m/s towards north and 0 m/s towards east, light turbulence, seed 0" in line


@pytest.mark.parametrize("key", ["", "zz", "f" * 40])
def test_a_key_that_names_no_row_is_one_line(file: Path, tmp_path: Path, key: str) -> None:
    fly_matrix(file, tmp_path / "out", "seed=0", "plant=kinematic")
    done = command("show", f"{tmp_path / 'out'}:{key}")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "no flight has a key" in done.stderr


def test_a_row_is_flown_from_the_store_when_its_track_and_its_airframe_are_gone(tmp_path: Path) -> None:
    rows = "".join(f"{t},{2 * t},{t * t / 9}\n" for t in range(5))
    track = write(tmp_path / "track.csv", "time_s,north_m,east_m\n" + rows)
    airframe = copied_airframe("skywalker_x8", tmp_path / "my_plane")
    file, out = tmp_path / "one.toml", tmp_path / "out"
    flight = f'[flight]\nplant = "sixdof"\naircraft = "{airframe}"\nduration_s = 2.0\n[flight.law]\nname = "smc"\n'
    file.write_text(flight + '[flight.target]\ntrack = "track.csv"\n')
    fly_matrix(file, out)
    track.unlink()
    shutil.rmtree(airframe)
    (key,) = harness.load_results(out)["key"]
    done = command("fly", f"{out}:{key[:6]}")
    assert done.returncode == 0, done.stderr
    assert "the same flight as stored, to the last bit" in done.stderr


def test_the_number_of_workers_and_the_order_change_nothing(file: Path, tmp_path: Path) -> None:
    fly_matrix(file, tmp_path / "serial")
    alone = digests(tmp_path / "serial")
    for workers in (1, 2, 4):
        fly_matrix(file, tmp_path / f"{workers}", options=replace(HERE, workers=workers))
        assert digests(tmp_path / f"{workers}") == alone


def test_the_store_knows_where_its_rows_come_from(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    command("run", file, "--out", out, "--workers", 1, "--limit", 1, "--log", "none")
    with reading(out) as journal:
        journal.row_factory = sqlite3.Row
        (run_,) = journal.execute("SELECT * FROM runs").fetchall()
    assert run_["settings"] == MATRIX
    assert "run" in run_["command"]
    assert str(file) in run_["command"]
    assert run_["started"] <= run_["ended"]
    assert json.loads(run_["packages"])["jsbsim"] == version("jsbsim")
    assert run_["python"] == platform.python_version()
    head = subprocess.run(["git", "-C", str(ROOT), "rev-parse", "HEAD"], capture_output=True, text=True, check=False)
    assert run_["git_commit"] == (head.stdout.strip() or None)
    assert (run_["git_dirty"] is None) == (run_["git_commit"] is None)


@pytest.mark.parametrize(("log", "expected"), [("all", 30), ("none", 0), ("failed", 3), ("sample", 10)])
def test_the_flights_asked_for_are_recorded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, log: str, expected: int
) -> None:
    file, out = tmp_path / "m.toml", tmp_path / "out"
    file.write_text(
        '[flight]\nduration_s = 1.0\nplant = "kinematic"\n[flight.law]\nname = "smc"\n'
        '[matrix]\n"metrics.monitoring_range_m" = [1.0, 5000.0]\nseed = { start = 0, count = 15 }\n'
        '[[exclude]]\n"metrics.monitoring_range_m" = 1.0\nseed = 0\n'
        "[[include]]\nseed = 99\n"
        if log != "failed"
        else '[flight]\nduration_s = 1.0\nplant = "kinematic"\n[flight.law]\nname = "smc"\n'
        '[matrix]\n"metrics.monitoring_range_m, seed" = [[1.0, 0], [1.0, 1], [1.0, 2], [5000.0, 3], [5000.0, 4]]\n'
    )
    monkeypatch.setattr("harness.runs.run.RECORDED", 10)
    fly_matrix(file, out, options=replace(HERE, log=log))
    results = harness.load_results(out)
    recorded = {path.stem for path in (out / "flights").iterdir()} if expected else set()
    assert recorded <= set(results["key"])
    assert len(recorded) == expected
    if log == "failed":
        assert set(results["key"][results["outcome"] == "target_lost"]) == recorded


def test_a_sample_has_whole_pairs(file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("harness.runs.run.RECORDED", 4)
    fly_matrix(file, tmp_path / "out", options=replace(HERE, log="sample"))
    results = harness.load_results(tmp_path / "out").set_index("key")
    recorded = [path.stem for path in (tmp_path / "out" / "flights").iterdir()]
    assert sorted(results.loc[recorded, "plant"]) == ["kinematic", "kinematic", "sixdof", "sixdof"]
    assert results.loc[recorded, "seed"].nunique() == 2


def test_a_dry_run_tells_the_size_and_writes_nothing(file: Path, tmp_path: Path) -> None:
    done = command("run", file, "--dry-run", "--set", "law.max_heading_rate_deg_s=3.0")
    assert done.returncode == 0
    lines = done.stdout.splitlines()
    assert lines[2:6] == [
        "10 flights",
        "  seed: 5 values",
        "  plant: 2 values",
        "  start.heading_deg: drawn from the seed",
    ]
    assert lines[6].startswith("about 1 s with ")
    assert "warning: 10 of 10 flights: the circle is infeasible" in done.stderr
    assert "warning: 10 of 10 flights: the law is flown outside its conditions: Eq. (28)" in done.stderr
    assert list(tmp_path.iterdir()) == [file]
    assert (
        "the 5 seeds repeat the same flight"
        in command("run", file, "--dry-run", "--set", "start.heading_deg=3.0").stderr
    )
    checked = command("check", file)
    assert checked.returncode == 0
    assert checked.stdout.splitlines()[-1] == f"{file}: ok"


SHIPPED = sorted(set(EXPERIMENTS.glob("*.toml")) - {EXPERIMENTS / "adopted.toml"})  # which needs adopted aircraft


@pytest.mark.parametrize("experiment", SHIPPED, ids=[path.stem for path in SHIPPED])
def test_a_shipped_experiment_flies(experiment: Path, tmp_path: Path) -> None:
    """The first flights of each, much shorter: by every plant that it names."""
    progress = fly_matrix(experiment, tmp_path / "out", "duration_s=2.0", options=replace(HERE, limit=4))
    assert (progress.failed, progress.done) == (0, min(4, progress.total))
    matrix = read_matrix(read_settings(experiment))
    assert matrix.experiment.question.endswith("?")
    results = harness.load_results(tmp_path / "out")
    assert set(results["plant"]) == {matrix.flight(c).plant for c in itertools.islice(matrix.combinations(), 4)}


def test_the_experiments_of_the_issue_are_shipped() -> None:
    names = {"paper", "wind", "bank", "sampling", "gains", "aircraft", "monte_carlo"}
    assert names <= {path.stem for path in SHIPPED}
