"""The ledger of claims: the committed documents say what the experiments say, however they are shared out."""

import os
import re
import signal
import subprocess
import sys
import time
from html import unescape
from pathlib import Path

import pytest

from harness.paper.claims import CLAIMS
from harness.paper.job import Part, computed, flown_claims, theory
from harness.paper.ledger import COLUMNS, Finding, Flown, Verdict, decided, holds, holds_if, row

DOCS = Path(__file__).parent.parent / "docs"


@pytest.mark.parametrize("title", CLAIMS)
def test_the_ledger_says_what_its_experiments_say(title: str) -> None:
    """All of them are run anew, in every column."""
    committed = (DOCS / "claims.md").read_text(encoding="utf-8").splitlines()
    claims = CLAIMS[title]
    findings = {key: found for column in (None, *COLUMNS) for key, found in decided(claims, column).items()}
    assert f"## {title}" in committed
    for claim in claims:
        assert row(claim, findings) in committed


def test_the_committed_page_holds_the_ledger_and_fetches_nothing() -> None:
    page = (DOCS / "paper.html").read_text(encoding="utf-8")
    found = re.findall(r"<td[^>]*>(.*?)(?=<td|</tr>)", page, re.DOTALL)
    cells = {unescape(re.sub(r"<[^>]+>", "", cell)).strip() for cell in found}
    ledger = (DOCS / "claims.md").read_text(encoding="utf-8")
    rows = [
        re.split(r" (?<!\\)\| ", line.strip("| ")) for line in ledger.splitlines() if re.match(r"\| \d\S* \|", line)
    ]
    assert len(rows) == sum(map(len, CLAIMS.values()))
    for cell in (cell for each in rows for cell in each[2:]):
        assert cell.replace("**", "").replace("\\|", "|") in cells
    assert re.findall(r"(?:src|href)\s*=\s*[\"']?(?!#)([^\"'> ]+)|url\((?!#)([^)]+)\)", page) == []
    assert len(page) < 3_000_000


def test_keys_are_unique_and_in_the_papers_order() -> None:
    keys = [claim.key for claims in CLAIMS.values() for claim in claims]
    assert len(set(keys)) == len(keys)
    for title, claims in CLAIMS.items():
        assert [c.key for c in claims] == sorted(c.key for c in claims), title


def test_a_claim_holds_under_its_condition_or_not_at_all() -> None:
    assert str(holds(True, "3 m")) == "**holds**: 3 m"
    assert str(holds(False, "3 m")) == "**does not hold**: 3 m"
    assert str(holds_if("it is calm", True, "3 m")) == "**holds if** it is calm: 3 m"
    assert holds_if("it is calm", False, "3 m") == Finding(Verdict.NOT, "3 m")


def test_a_column_flies_what_it_changes_and_nothing_else() -> None:
    from harness.paper.experiments import flight

    truth, ekf = (column.change(flight("S", "SMC")) for column in COLUMNS)
    assert truth == flight("S", "SMC")
    assert ekf.estimator.kind == "ekf"
    assert (ekf.law, ekf.target, ekf.guidance_period) == (truth.law, truth.target, truth.guidance_period)


def test_two_processes_find_what_one_finds() -> None:
    section = "3.1 Loitering algorithm"
    jobs = [theory, flown_claims(section, 1)]
    alone, shared = (_findings(list(computed(jobs, workers))) for workers in (1, 2))
    assert alone == shared
    assert any(isinstance(claim, Flown) and (claim.key, COLUMNS[1].name) in alone for claim in CLAIMS[section])


def _findings(parts: list[Part]) -> dict[tuple[str, str], Finding]:
    return {key: finding for part in parts for key, finding in part.findings.items()}


def test_an_interrupt_ends_it_with_130_and_leaves_no_file_and_no_process(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "harness", "reproduce", "--out", str(tmp_path)]
    running = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True)
    time.sleep(4.0)  # the workers are up, or on their way
    os.killpg(running.pid, signal.SIGINT)  # as a terminal does
    _, said = running.communicate(timeout=20.0)
    assert running.returncode == 130
    assert said.decode().strip() == "interrupted"
    assert list(tmp_path.iterdir()) == []
    assert _gone(running.pid)


def _gone(group: int) -> bool:
    """Whether no process of the group is left, given the moment that a machine takes to clear a dead one away."""
    for _ in range(50):
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.1)
    return False


def test_the_coefficients_document_says_what_the_flights_say() -> None:
    """The fitted and unfitted numbers in full, one row of the map; that no other pair fits is left to `make paper`."""
    from harness.paper.identified import BETA2, COARSE, FINE, map_row, point, unfitted_rows

    committed = (DOCS / "identified.md").read_text(encoding="utf-8").splitlines()
    for line in unfitted_rows():
        assert line in committed
    assert map_row(0.4, [point((0.4, beta2, COARSE)) for beta2 in BETA2]) in committed
    assert point((0.4, 2.4, FINE)).prints
    assert not point((0.5, 3.0, FINE)).prints
