"""A gain set's former name is still read: in a file, from `--set`, in Python and in a row of an old journal."""

import re
import sqlite3
from pathlib import Path

import pytest

from autopilot.laws import LAWS, law
from harness.runs.journal import JOURNAL
from harness.runs.matrix import read_matrix
from harness.runs.run import Options, run
from harness.settings import load_flight, read_settings
from tests.builders import command, write

FILE = """\
[flight]
plant = "kinematic"
duration_s = 2.0
[flight.law]
name = "nftsm"
gains = "identified"
"""
MATRIX = """\
[flight]
plant = "kinematic"
duration_s = 2.0
[matrix]
"law.name, law.gains" = [
  ["nftsm", "paper_1"],
  ["nftsm", "identified"],
]
"""


def test_a_former_name_makes_the_same_law_and_warns() -> None:
    with pytest.warns(FutureWarning, match='"identified" was renamed "fitted"'):
        former = law("nftsm", "identified")
    assert former == law("nftsm", "fitted")


def test_a_law_that_names_no_gain_set_has_its_declared_default_and_that_converges() -> None:
    assert law("nftsm") == law("nftsm", "fitted")
    assert law("smc") == law("smc", "paper")
    assert all(kind.default in kind.gain_sets for kind in LAWS.values())
    assert law("nftsm").broken_conditions(0.0) == []


def test_a_file_with_the_former_name_is_read_and_told_its_line(tmp_path: Path) -> None:
    path = write(tmp_path / "a.toml", FILE)
    with pytest.warns(
        FutureWarning, match=f'^{re.escape(str(path))}:6: flight.law.gains: deprecated: the gain set "identified"'
    ):
        flight = load_flight(path)
    assert flight.law == law("nftsm")
    with pytest.warns(FutureWarning, match=r"^--set law.gains=identified: flight.law.gains: "):
        assert (
            load_flight(write(tmp_path / "a.toml", FILE.replace("identified", "paper")), ["law.gains=identified"])
            == flight
        )


def test_a_matrix_with_the_former_name_is_read_and_told_its_line(tmp_path: Path) -> None:
    path = write(tmp_path / "a.toml", MATRIX)
    with pytest.warns(FutureWarning, match=f"^{re.escape(str(path))}:7: matrix"):
        matrix = read_matrix(read_settings(path))
    assert [matrix.flight(c).law for c in matrix.combinations()] == [law("nftsm", "paper_1"), law("nftsm", "fitted")]


def test_a_row_of_an_old_journal_is_flown_again_to_the_last_bit(tmp_path: Path) -> None:
    out = tmp_path / "out"
    today = write(tmp_path / "a.toml", FILE.replace("identified", "fitted"))
    list(run(read_matrix(read_settings(today)), out, Options(workers=0, log="none")))
    with sqlite3.connect(out / JOURNAL) as journal:
        journal.execute("UPDATE flights SET settings = replace(settings, '\"fitted\"', '\"identified\"')")
        (key,) = journal.execute("SELECT key FROM flights").fetchone()
    again = command("fly", f"{out}:{key[:8]}")
    assert (again.returncode, "the same flight as stored, to the last bit" in again.stderr) == (0, True), again.stderr
    assert "identified" not in again.stderr
    assert command("show", f"{out}:{key[:8]}").returncode == 0


def test_the_command_line_warns_in_one_line(tmp_path: Path) -> None:
    path = write(tmp_path / "a.toml", FILE)
    done = command("fly", path, "--json")
    assert done.returncode == 0
    warnings = [line for line in done.stderr.splitlines() if line.startswith("warning")]
    assert warnings == [
        f'warning: {path}:6: flight.law.gains: deprecated: the gain set "identified" was renamed "fitted"; '
        "the old name will be removed"
    ]
