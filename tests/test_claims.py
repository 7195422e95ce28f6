"""The ledger of claims: the committed documents say what the experiments say, however they are shared out."""

import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace
from html import unescape
from pathlib import Path

import numpy as np
import pytest

from harness.flight import Flight
from harness.loop import simulate
from harness.studies.paper.airframes import FLOWN_ON
from harness.studies.paper.claims import CLAIMS
from harness.studies.paper.columns import AIRFRAMES, COLUMNS, CONDITIONS, GRID, Column, column, scaled
from harness.studies.paper.documents import airframes_markdown, row
from harness.studies.paper.experiments import LAWS, Reading, flight
from harness.studies.paper.job import Part, computed, flown_claims, theory
from harness.studies.paper.ledger import Finding, Findings, Flown, Verdict, decided, holds, holds_if
from harness.world.wind import Wind

DOCS = Path(__file__).parent.parent / "docs"
FLOWN = [claim for claims in CLAIMS.values() for claim in claims if isinstance(claim, Flown)]


@pytest.fixture(scope="module")
def on_airframes() -> Findings:
    """What the committed ledger of the airframes says."""
    findings = {}
    key = ""
    for line in (DOCS / "claims_sixdof.md").read_text(encoding="utf-8").splitlines():
        key = line.split()[1] if line.startswith("### ") else key
        condition, *cells = (cell.strip().replace("\\|", "|") for cell in re.split(r"(?<!\\)\|", line)[1:-1] or [""])
        if key and condition in CONDITIONS:
            for aircraft, cell in zip(FLOWN_ON, cells, strict=True):
                findings[key, column(condition, aircraft).name] = _finding(cell)
    return findings


def _finding(cell: str) -> Finding:
    match = re.fullmatch(r"\*\*(.*?)\*\*(.*)", cell, re.DOTALL)
    assert match
    verdict, rest = match.groups()
    condition, number = rest.split(": ", 1)
    return Finding(Verdict(verdict), number, condition.strip())


@pytest.mark.parametrize("title", CLAIMS)
def test_the_ledger_says_what_its_experiments_say(title: str, on_airframes: Findings) -> None:
    """All of them are run anew on the paper's aircraft; what is said of the airframes is what their ledger says."""
    committed = (DOCS / "claims.md").read_text(encoding="utf-8").splitlines()
    claims = CLAIMS[title]
    findings = {key: found for each in (None, *COLUMNS) for key, found in decided(claims, each).items()}
    assert f"## {title}" in committed
    for claim in claims:
        assert row(claim, {**findings, **on_airframes}) in committed


def test_the_ledger_of_the_airframes_has_every_claim_in_every_column(on_airframes: Findings) -> None:
    assert set(on_airframes) == {(claim.key, each.name) for claim in FLOWN for each in GRID}


def test_the_ledger_of_the_airframes_is_what_its_findings_make_it(on_airframes: Findings) -> None:
    assert (DOCS / "claims_sixdof.md").read_text(encoding="utf-8") == airframes_markdown(CLAIMS, on_airframes)


@pytest.mark.parametrize("each", GRID, ids=lambda each: each.name)
def test_the_ledger_of_the_airframes_says_what_its_experiments_say(each: Column, on_airframes: Findings) -> None:
    """Two of its claims are flown anew, in every column; `make paper` flies them all."""
    some = [claim for claim in FLOWN if claim.key in ("2.1c", "4.1a")]
    for key, finding in decided(some, each).items():
        assert finding == on_airframes[key]


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


def test_every_column_has_its_own_name() -> None:
    names = [each.name for each in (*COLUMNS, *GRID)]
    assert len(set(names)) == len(names) == 2 + 4 * 6


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
    truth, ekf = (each.real(each.held(flight("S", "SMC"))) for each in COLUMNS)
    assert truth == flight("S", "SMC")
    assert ekf.estimator.kind == "ekf"
    assert replace(ekf, estimator=truth.estimator) == truth


_CHANGES = {"wind": "wind", "turbulence": "wind", "EKF": "estimator", "45° of bank": "law", "45° at 60 m": "law"}


@pytest.mark.parametrize("condition", CONDITIONS)
def test_a_condition_changes_one_part_of_a_flight_and_the_aircraft_plant_hold_and_size(condition: str) -> None:
    one = flight("manoeuvres", "NFTSM_1")
    for aircraft in FLOWN_ON:
        there = column(condition, aircraft)
        flown = there.real(there.held(one))
        own = {_CHANGES[condition]} if condition in _CHANGES else set()
        similar = {"law", "start", "target"} if there.scale != 1.0 else set()
        changed = {name for name in Flight.__dataclass_fields__ if getattr(flown, name) != getattr(one, name)}
        assert own <= changed <= own | similar | {"plant", "aircraft", "guidance_period", "wind"}
        assert ("wind" in changed) == (condition in ("wind", "turbulence"))
        assert (flown.plant, flown.start.airspeed) == ("sixdof" if there.aircraft else "kinematic", aircraft.airspeed)


@pytest.mark.parametrize("label", sorted(set(LAWS) - {"NFTSM as printed"}))
def test_a_larger_flight_is_the_similar_one_on_the_kinematic_aircraft(label: str) -> None:
    """Distances larger by the scale, headings the same: in wind, round a manoeuvring target, limited, held for 50 ms.

    To rounding, that a law of high gain makes larger; with the printed gains, singular on the circle, without bound.
    """
    one = replace(flight("manoeuvres", label, Reading(0.05, (1.5, -0.5), limited=True)), duration=470.0, step=0.005)
    scale = 25.0 / 13.0
    small, large = simulate(one), simulate(scaled(one, scale))
    assert np.abs(large["range_error"] / scale - small["range_error"]).max() < 1e-6
    assert np.abs(np.unwrap(large["heading"]) - np.unwrap(small["heading"])).max() < 1e-5


def test_a_flight_on_another_aircraft_is_told_in_the_papers_size() -> None:
    aerosonde = column("still air", AIRFRAMES[-1])
    told = aerosonde.paper("30", "SMC")
    real = simulate(aerosonde.real(aerosonde.held(flight("30", "SMC"))))
    assert told.flight.start.airspeed == 13.0
    assert told["range_error"] * 25.0 / 13.0 == pytest.approx(real["range_error"], abs=1e-9)
    assert (told["heading"] == real["heading"]).all()


def _doomed(one: Flight) -> Flight:
    return replace(one, start=replace(one.start, altitude=16.0), wind=Wind(turbulence="severe"))


def test_a_flight_that_ends_early_decides_against_the_claim_and_is_told() -> None:
    doomed = Column("doomed", "", _doomed, 1.0, aircraft="ultra_stick_25e", period=0.05, periods=(0.5,))
    some = [claim for claim in FLOWN if claim.key in ("0a", "2.1a", "2.2e", "4a")]
    found = {key: finding for (key, _), finding in decided(some, doomed).items()}
    assert {finding.verdict for finding in found.values()} == {Verdict.NOT}
    assert re.match(r"the flight of NFTSM over 330 s ended: ground after \d+\.\d s", found["0a"].number)
    assert re.match(r"the flight of NFTSM over 80 s ended: ground after", found["2.1a"].number)
    assert found["2.2e"].number == "never within 1 m of the circle, at rest neither"


def test_two_processes_find_what_one_finds() -> None:
    section = "3.1 Loitering algorithm"
    jobs = [theory, flown_claims(section, COLUMNS[1])]
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
    from harness.studies.paper.coefficients import BETA2, COARSE, FINE, map_row, point, unfitted_rows

    committed = (DOCS / "answers" / "fitted.md").read_text(encoding="utf-8").splitlines()
    for line in unfitted_rows():
        assert line in committed
    assert map_row(0.4, [point((0.4, beta2, COARSE)) for beta2 in BETA2]) in committed
    assert point((0.4, 2.4, FINE)).prints
    assert not point((0.5, 3.0, FINE)).prints
