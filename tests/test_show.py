"""`harness show DIR` and `harness export DIR`: the flights of a run as a table."""

import csv
import io
from pathlib import Path

import pandas as pd
import pyarrow.parquet as pq
import pytest

import harness
from tests.builders import EXPERIMENTS, fly_matrix, invoke


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("show") / "out"
    fly_matrix(EXPERIMENTS / "stationary.toml", folder, "plant=kinematic", "law.k2=[1.0, 4.0, 12.0]", "seed=[0, 1]")
    return folder


def shown(out: Path, *words: object) -> list[list[str]]:
    """The lines of the table, without its heading and what stands below it, in words."""
    done = invoke("show", out, *words)
    assert done.exit_code == 0, done.stderr
    lines = done.stdout.splitlines()
    begin = next(i for i, line in enumerate(lines) if line.startswith("--------"))
    return [line.split() for line in lines[begin + 1 :] if not line.startswith("...")]


def test_every_flight_has_a_line_with_its_key_what_varies_its_outcome_and_its_metrics(out: Path) -> None:
    results = harness.load_results(out)
    lines = shown(out)
    assert [line[0] for line in lines] == [key[:8] for key in results["key"]]
    assert [float(line[1]) for line in lines] == results["law.k2"].tolist()
    assert {line[3] for line in lines} == {"completed"}
    assert [float(line[4]) for line in lines] == pytest.approx(results["convergence_time_s"].tolist(), rel=5e-3)


def test_flights_are_chosen_sorted_and_limited(out: Path) -> None:
    results = harness.load_results(out)
    assert {line[1] for line in shown(out, "--where", "law.k2=4", "--where", "seed=1")} == {"4"}
    activity = results.sort_values("command_activity_deg_s2", kind="stable")["key"].str[:8].tolist()
    assert [line[0] for line in shown(out, "--sort", "command_activity_deg_s2")] == activity
    assert shown(out, "--sort", "-command_activity_deg_s2", "--limit", "2")[0][0] in activity[-2:]
    assert "... and 4 more; all of them: --limit 6, or --csv" in invoke("show", out, "--limit", "2").stdout


def test_csv_has_every_column_or_those_that_are_named(out: Path) -> None:
    whole = list(csv.DictReader(io.StringIO(invoke("show", out, "--csv").stdout)))
    results = harness.load_results(out)
    assert list(whole[0]) == list(results.columns)
    assert [float(row["range_error_rms_m"]) for row in whole] == results["range_error_rms_m"].tolist()
    named = invoke("show", out, "--csv", "--columns", "law.k2, chatters", "--limit", "1").stdout.splitlines()
    assert named == ["key,law.k2,chatters", f"{results['key'][0]},1.0,{results['chatters'][0]}"]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--sort", "convergence_time"], "--sort convergence_time: the results have no such column - did you mean"),
        (["--columns", "k2"], "--columns k2: the results have no such column"),
        (["--where", "law.k2=5"], "where: no flight has law.k2 = 5"),
        (["--where", "k2"], "--where k2: must be KEY=VALUE"),
    ],
)
def test_what_cannot_be_shown_is_one_line_and_exit_code_2(out: Path, words: list[str], told: str) -> None:
    done = invoke("show", out, *words)
    assert done.exit_code == 2
    (line,) = done.stderr.splitlines()
    assert told in line


def test_one_flight_takes_no_option_of_a_table(out: Path) -> None:
    key = harness.load_results(out)["key"][0]
    done = invoke("show", f"{out}:{key}", "--limit", "3")
    assert done.exit_code == 2
    assert "is one flight; --where" in done.stderr


def test_the_flights_are_exported_with_their_units(out: Path, tmp_path: Path) -> None:
    results = harness.load_results(out)
    done = invoke("export", out, "--to", "csv", "--out", tmp_path / "flights.csv")
    assert done.stdout == f"{tmp_path / 'flights.csv'}: {len(results)} rows, {len(results.columns)} columns\n"
    read = pd.read_csv(tmp_path / "flights.csv")
    assert read["range_error_rms_m"].tolist() == results["range_error_rms_m"].tolist()
    assert invoke("export", out, "--to", "parquet", "--out", tmp_path / "flights.parquet").exit_code == 0
    metadata = pq.read_schema(tmp_path / "flights.parquet").field("command_activity_deg_s2").metadata
    assert metadata[b"unit"] == b"deg/s2"


def test_one_flight_is_shown_with_every_setting_that_varies_in_its_run_also_where_it_is_the_default(out: Path) -> None:
    key = harness.load_results(out).query("`law.k2` == 12.0 and seed == 0")["key"].item()
    told = [line.split() for line in invoke("show", f"{out}:{key}").stdout.splitlines()]
    assert ["law.k2", "12.0"] in told
    assert ["seed", "0"] in told


def test_a_flight_says_what_is_flown_how_it_ended_and_what_differs_from_an_earlier_one(out: Path) -> None:
    flights = harness.load_results(out).query("seed == 0").set_index("law.k2").to_dict("index")
    earlier, changed = flights[12.0], flights[4.0]
    done = invoke("fly", f"{out}:{earlier['key']}", "--set", "law.k2=4", "--against", f"{out}:{earlier['key'][:9]}")
    _, what, ending, settled, against, *lines = done.stdout.splitlines()
    assert what == "law nftsm with gains paper_1, k2 = 4, on plant kinematic, for 100 s in still air, seed 0"
    assert ending == "The flight lasted its full duration."
    assert settled == f"The flight settled on its circle within 1 m in {changed['convergence_time_s']:.3g} s."
    assert against == f"against flight {earlier['key'][:8]}: law.k2 4.0 instead of 12.0"
    (peak,) = (line.split() for line in lines if line.startswith("range_error_peak_m"))
    now, then = changed["range_error_peak_m"], earlier["range_error_peak_m"]
    assert peak[1:5] == [f"{now:.3g}", f"{then:.3g}", f"{now - then:+.3g}", "m"]
    same = invoke("fly", f"{out}:{earlier['key']}", "--against", f"{out}:{earlier['key']}")
    assert "the same settings" in same.stdout
    assert invoke("fly", f"{out}:{earlier['key']}", "--against", out).stderr.startswith(f"--against {out}: must be")
