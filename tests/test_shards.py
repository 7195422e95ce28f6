"""A matrix flown in parts by several machines, and the parts as one run."""

import shutil
import sqlite3
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

import harness
from harness.runs.journal import JOURNAL, StoreError
from harness.runs.matrix import Shard, read_matrix
from harness.runs.merge import merge
from harness.runs.store import FLIGHTS
from harness.settings import read_settings
from tests.builders import invoke, write

EXPERIMENT = """\
[flight]
duration_s = 3.0
law = { name = "nftsm" }
[matrix]
plant = ["kinematic", "lagged"]
"law.k2" = [1.0, 12.0]
seed = { start = 0, count = 3 }
"start.heading_deg" = { uniform = [10.0, 60.0] }
[[exclude]]
"law.k2" = 12.0
seed = 1
[[include]]
plant = "kinematic"
seed = 9
[[include]]
plant = "lagged"
seed = 9
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return write(tmp_path / "parts.toml", EXPERIMENT)


def flown(file: Path, out: Path, *options: object) -> Path:
    done = invoke("run", file, "--out", out, "--workers", 0, *options)
    assert done.exit_code == 0, done.output
    return out


def rows(folder: Path) -> pd.DataFrame:
    """The results without what belongs to the run and the machine."""
    return harness.load_results(folder).drop(columns=["run", "seconds"])


@pytest.mark.parametrize("of", [1, 2, 3, 7, 40])
def test_shards_are_disjoint_and_together_the_whole_and_no_pair_is_torn(file: Path, of: int) -> None:
    whole = read_matrix(read_settings(file))
    parts = [replace(whole, shard=Shard(number, of)) for number in range(1, of + 1)]
    positions = [[one.position for one in part.combinations()] for part in parts]
    assert [len(part) for part in parts] == list(map(len, positions))
    assert sorted(p for part in positions for p in part) == [one.position for one in whole.combinations()]
    assert all(
        {whole.group(p) for p in a}.isdisjoint(map(whole.group, b)) for a in positions for b in positions if a != b
    )


def test_the_merged_shards_are_the_run_in_one_piece(file: Path, tmp_path: Path) -> None:
    parts = [flown(file, tmp_path / str(i), "--shard", f"{i}/3") for i in (3, 1, 2)]
    done = invoke("merge", *parts, "--out", tmp_path / "one")
    assert done.output.startswith(f"12 flights in {tmp_path / 'one'}, from 3 runs\n")
    whole = flown(file, tmp_path / "whole")
    pd.testing.assert_frame_equal(rows(tmp_path / "one"), rows(whole))
    assert harness.compare(tmp_path / "one").answer == harness.compare(whole).answer
    recorded = {path.name: path.read_bytes() for part in parts for path in (part / "flights").iterdir()}
    assert {path.name: path.read_bytes() for path in (tmp_path / "one" / "flights").iterdir()} == recorded != {}
    again = invoke("run", file, "--out", tmp_path / "one", "--workers", 0)
    assert "0 flown, 12 earlier, 0 failed" in again.output


def test_a_flight_of_several_runs_is_kept_once_and_different_bits_are_told(file: Path, tmp_path: Path) -> None:
    first = flown(file, tmp_path / "a", "--limit", 4)
    other = flown(file, tmp_path / "b", "--limit", 6, "--log", "none")
    assert merge([first, other], tmp_path / "same") == (6, 4, ())
    key = harness.load_results(first)["key"][0]
    with sqlite3.connect(other / JOURNAL) as journal:
        journal.execute("UPDATE flights SET digest = 'other' WHERE key = ?", (key,))
    done = invoke("merge", first, other, "--out", tmp_path / "apart")
    assert f"1 flown by several runs with different bits ({key[:8]}): the first run's are kept" in done.output
    assert "3 flown by several runs, bit-identical: kept once" in done.output
    assert "other" not in harness.load_results(tmp_path / "apart")["digest"].to_list()


def test_a_failed_flight_gives_way_to_one_that_was_flown_whichever_comes_first(file: Path, tmp_path: Path) -> None:
    good = flown(file, tmp_path / "good", "--limit", 2)
    bad = shutil.copytree(good, tmp_path / "bad")
    with sqlite3.connect(bad / JOURNAL) as journal:
        journal.execute("UPDATE flights SET outcome = 'timeout', digest = ''")
    for run in (good, bad):
        (run / FLIGHTS).mkdir(exist_ok=True)
        for key in harness.load_results(good)["key"]:
            (run / FLIGHTS / f"{key}.rrd").write_text(run.name)
    for order in ([good, bad], [bad, good]):
        to = tmp_path / order[0].name / "merged"
        assert merge(order, to).flights == 2
        assert set(harness.load_results(to)["outcome"]) == {"completed"}
        assert {path.read_text() for path in (to / FLIGHTS).iterdir()} == {"good"}


def test_what_is_no_part_of_the_same_experiment_is_refused_and_nothing_is_left(file: Path, tmp_path: Path) -> None:
    one = flown(file, tmp_path / "one", "--limit", 1)
    other = flown(write(tmp_path / "other.toml", "# other\n" + EXPERIMENT), tmp_path / "two", "--limit", 1)
    before = sorted(tmp_path.iterdir())
    with pytest.raises(StoreError, match="is a run of another settings file"):
        merge([one, other], tmp_path / "out")
    with pytest.raises(StoreError, match="holds no results of `harness run`"):
        merge([one, tmp_path / "none"], tmp_path / "out")
    with pytest.raises(StoreError, match="exists already: merge into a new folder"):
        merge([one, one], other)
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("text", ["0/4", "5/4", "x", "1", "1/0", "-1/2", "1/2/3", "١/2"])
def test_a_shard_that_there_is_not_is_one_line(file: Path, tmp_path: Path, text: str) -> None:
    done = invoke("run", file, "--out", tmp_path / "out", "--shard", text)
    assert done.exit_code == 2
    assert done.output == f"--shard is {text!r}, must be I/N with I from 1 to N, as in 2/4\n"
