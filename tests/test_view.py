"""`harness view` and `harness export`: flights of a run chosen, flown again where need be, compared with the store."""

import socket
import sqlite3
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from harness.log import COLUMNS
from harness.plants.ladder import PLANTS
from harness.review.reading import read_logs
from harness.runs.journal import JOURNAL
from harness.runs.logs import distinctly_named
from harness.runs.results import load_results
from tests.builders import HERE, fly_matrix, invoke, write

MATRIX = """\
[flight]
plant = "sixdof"
duration_s = 3.0
[flight.law]
name = "nftsm"
gains = "paper_1"
[matrix]
plant = ["{plant}"]
"law.gains" = ["paper", "paper_1", "fitted"]
"""


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Six flights; those on the kinematic plant are recorded."""
    folder = tmp_path_factory.mktemp("run")
    file = folder / "matrix.toml"
    for plant, log in (("kinematic", "all"), ("sixdof", "none")):
        fly_matrix(write(file, MATRIX.format(plant=plant)), folder / "out", options=replace(HERE, log=log))
    return folder / "out"


def key_of(out: Path, plant: str, gains: str) -> str:
    rows = load_results(out)
    return str(rows[(rows["plant"] == plant) & (rows["law.gains"] == gains)]["key"].item())


def test_a_pair_is_the_same_flight_on_each_plant_with_the_kinematic_one_first(out: Path, tmp_path: Path) -> None:
    done = invoke("view", out, "--pair", key_of(out, "sixdof", "paper")[:6], "--save", tmp_path / "pair.rrd")
    assert done.exit_code == 0, done.output
    logs = read_logs(tmp_path / "pair.rrd")
    assert list(logs) == list(PLANTS)
    digests = load_results(out).set_index("key")["digest"]
    for plant in ("kinematic", "sixdof"):
        assert logs[plant].digest == digests[key_of(out, plant, "paper")]
        assert logs[plant].flight.law == logs["kinematic"].flight.law


def test_six_flights_are_named_by_what_they_differ_in(out: Path, tmp_path: Path) -> None:
    chosen = [word for key in load_results(out)["key"] for word in ("--flight", key)]
    done = invoke("view", out, *chosen, "--save", tmp_path / "six.rrd")
    assert done.exit_code == 0, done.output
    logs = read_logs(tmp_path / "six.rrd")
    gains = ("paper", "paper_1", "fitted")
    assert sorted(logs) == sorted(f"{plant} {name}" for plant in ("kinematic", "sixdof") for name in gains)
    assert sorted(log.digest for log in logs.values()) == sorted(load_results(out)["digest"])
    again = invoke("view", tmp_path / "six.rrd", "--flight", "sixdof paper", "--save", tmp_path / "one.rrd")
    assert again.exit_code == 0, again.output
    assert read_logs(tmp_path / "one.rrd")["sixdof paper"].digest == logs["sixdof paper"].digest
    assert list(distinctly_named([logs["sixdof paper"]] * 2)) == ["sixdof", "sixdof 2"]


def test_without_a_choice_the_flights_are_offered(out: Path) -> None:
    done = invoke("view", out)
    assert done.exit_code == 2
    assert all(key[:8] in done.stdout for key in load_results(out)["key"])


def test_a_flight_flown_again_that_is_not_the_stored_one_is_said(out: Path, tmp_path: Path) -> None:
    key = key_of(out, "sixdof", "fitted")
    with sqlite3.connect(out / JOURNAL) as journal:
        (digest,) = journal.execute("SELECT digest FROM flights WHERE key = ?", (key,)).fetchone()
        journal.execute("UPDATE flights SET digest = 'of another flight' WHERE key = ?", (key,))
    try:
        done = invoke("view", f"{out}:{key}", "--save", tmp_path / "a.rrd")
    finally:
        with sqlite3.connect(out / JOURNAL) as journal:
            journal.execute("UPDATE flights SET digest = ? WHERE key = ?", (digest, key))
        journal.close()
    assert done.exit_code == 0
    assert f"warning: {key}: differs from the stored flight" in done.stderr


@pytest.mark.parametrize("plant", ["kinematic", "sixdof"])
def test_an_exported_log_is_the_flight_to_the_last_bit(plant: str, out: Path, tmp_path: Path) -> None:
    key = key_of(out, plant, "paper_1")
    assert invoke("view", f"{out}:{key}", "--save", tmp_path / "a.rrd").exit_code == 0
    (log,) = read_logs(tmp_path / "a.rrd").values()
    for what in (f"{out}:{key[:8]}", tmp_path / "a.rrd"):
        for kind, read in (
            ("csv", lambda path: pd.read_csv(path, dtype=str).astype(float)),
            ("parquet", pd.read_parquet),
        ):
            done = invoke("export", what, "--to", kind, "--out", tmp_path / f"a.{kind}")
            assert done.exit_code == 0, done.output
            table = read(tmp_path / f"a.{kind}")
            assert tuple(table.columns) == COLUMNS
            assert np.array_equal(table.to_numpy(dtype=float), log.table, equal_nan=True)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["view", "{out}"], "choose flights with --flight KEY or --pair KEY"),
        (["view", "{out}", "--flight", "zz"], "no flight has a key that begins with 'zz'"),
        (["view", "{out}", "--flight", "a", "--pair", "b"], "--pair and --flight exclude each other"),
        (["view", "{out}", *["--flight", "a"] * 7], "--flight is given 7 times, must be at most 6"),
        (["view", "experiments/stationary.toml", "--flight", "a"], "--flight is for a folder or a recording"),
        (["view", "no/such/place"], "no/such/place: no such file or folder"),
        (["view", "--save", "a.rrd"], "--web require a folder or a file"),
        (["view", "{out}/journal.sqlite", "--flight", "a"], "is not a complete recording"),
        (["view", "{out}/journal.sqlite", "--pair", "a"], "--pair is for a folder"),
        (["export", "{out}:zz", "--to", "csv"], "no flight has a key that begins with 'zz'"),
        (["export", "nothing.rrd", "--to", "csv"], "nothing.rrd: No such file or directory"),
        (["fly", "experiments/stationary.toml", "--pace", "2"], "--pace and --port require --live"),
    ],
)
def test_bad_input_is_one_line(words: list[str], said: str, out: Path) -> None:
    done = invoke(*(word.format(out=out) for word in words))
    assert done.exit_code == 2
    assert said in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_without_a_display_the_way_out_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    (tmp_path / "a.rrd").touch()
    done = invoke("view", tmp_path / "a.rrd")
    assert done.exit_code == 2
    assert (
        done.stderr
        == "there is no display here: use --web, or write a file with --save and open it where there is one\n"
    )


def test_an_empty_viewer_on_a_port_that_is_taken_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DISPLAY", ":0")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        done = invoke("view", "--port", port)
    assert done.exit_code == 2
    assert f"port {port} is taken" in done.stderr
