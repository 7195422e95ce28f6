"""The ledger of claims: the committed documents say what the experiments say, however they are shared out."""

import csv
import math
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
from harness.pool import computed
from harness.studies.fitted import BETA2, COARSE, FINE, map_csv, pair_of, unfitted_rows
from harness.studies.paper.airframes import FLOWN_ON
from harness.studies.paper.claims import CLAIMS
from harness.studies.paper.columns import AIRFRAMES, COLUMNS, CONDITIONS, GRID, Column, column, scaled
from harness.studies.paper.decision import Decision, decide, every, less
from harness.studies.paper.documents import FORMULAS, HEADINGS, airframes_page, claims_csv, claims_page
from harness.studies.paper.experiments import LAWS, Reading, flight
from harness.studies.paper.job import Reproduction, flown_claims, theory
from harness.studies.paper.ledger import Decisions, FlownClaim, TheoryClaim, decided
from harness.vocabulary import Verdict
from harness.world.wind import Wind
from tests.builders import DOCS

ANSWERS = DOCS / "answers"
FLOWN = [claim for claims in CLAIMS.values() for claim in claims if isinstance(claim, FlownClaim)]


@pytest.fixture(scope="module")
def committed() -> Decisions:
    """What the committed ledger says."""
    with (ANSWERS / "claims.csv").open(encoding="utf-8", newline="") as file:
        lines = list(csv.DictReader(file))
    assert tuple(lines[0]) == HEADINGS
    return {
        (line["claim"], line["decided by"].replace(FORMULAS, "")): Decision(
            Verdict(line["verdict"]), line["numbers"], line["condition"]
        )
        for line in lines
    }


@pytest.mark.parametrize("title", CLAIMS)
def test_the_ledger_says_what_its_experiments_say(title: str, committed: Decisions) -> None:
    """All of them are run anew, on the paper's aircraft."""
    for each in (None, *COLUMNS):
        for key, decision in decided(CLAIMS[title], each).items():
            assert decision == committed[key], key


def test_the_ledger_has_every_claim_in_every_column(committed: Decisions) -> None:
    theories = {(c.key, "") for claims in CLAIMS.values() for c in claims if isinstance(c, TheoryClaim)}
    assert set(committed) == theories | {(claim.key, each.name) for claim in FLOWN for each in (*COLUMNS, *GRID)}


def test_the_pages_are_what_their_decisions_make_them(committed: Decisions) -> None:
    assert (ANSWERS / "claims.csv").read_text(encoding="utf-8") == claims_csv(CLAIMS, committed)
    assert (ANSWERS / "claims.md").read_text(encoding="utf-8") == claims_page(CLAIMS, committed)
    assert (ANSWERS / "claims_sixdof.md").read_text(encoding="utf-8") == airframes_page(CLAIMS, committed)


@pytest.mark.parametrize("each", GRID, ids=lambda each: each.name)
def test_the_ledger_of_the_airframes_says_what_its_experiments_say(each: Column, committed: Decisions) -> None:
    """Two of its claims are flown anew, in every column; `make paper` flies them all."""
    some = [claim for claim in FLOWN if claim.key in ("2.1c", "4.1a")]
    for key, decision in decided(some, each).items():
        assert decision == committed[key]


def test_the_committed_page_holds_the_ledger_and_fetches_nothing(committed: Decisions) -> None:
    page = (ANSWERS / "paper.html").read_text(encoding="utf-8")
    cells = {
        unescape(re.sub(r"<[^>]+>", "", cell)).strip()
        for cell in re.findall(r"<td[^>]*>(.*?)(?=<td|</tr>)", page, re.DOTALL)
    }
    on_the_page = {"", *(each.name for each in COLUMNS)}
    for (_, name), decision in committed.items():
        if name in on_the_page:
            assert str(decision).replace("**", "") in cells
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


def test_a_decision_has_one_of_four_verdicts_and_says_which() -> None:
    assert str(decide(True, "3 m")) == "**holds**: 3 m"
    assert str(decide(False, "3 m")) == "**fails**: 3 m"
    assert str(decide(None, "3 m")) == "**undecided**: 3 m"
    assert str(decide(False, "3 m", under={"it is calm": True})) == "**holds if** it is calm: 3 m"
    assert decide(True, "3 m", under={"it is calm": False}).verdict is Verdict.HOLDS
    assert decide(False, "3 m", under={"it is calm": False}).verdict is Verdict.FAILS
    assert decide(False, "3 m", under={"it is calm": None}).verdict is Verdict.UNDECIDED
    assert decide(None, "3 m", under={"it is calm": True}).verdict is Verdict.UNDECIDED


def test_a_missing_number_is_no_answer_unless_another_number_decides() -> None:
    assert less(1.0, None) is less(math.nan, 1.0) is None
    assert every(True, None) is None
    assert every(False, None) is False
    assert every(True, less(1.0, 2.0)) is True


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
    decisions = {key: decision for (key, _), decision in decided(some, doomed).items()}
    assert {decision.verdict for decision in decisions.values()} == {Verdict.FAILS}
    assert re.match(r"the flight of NFTSM over 330 s ended: ground after \d+\.\d s", decisions["0a"].number)
    assert re.match(r"the flight of NFTSM over 80 s ended: ground after", decisions["2.1a"].number)
    assert "not at 0.1 m/s" in decisions["2.2e"].number


def test_two_processes_find_what_one_finds() -> None:
    section = "3.1 Loitering algorithm"
    jobs = [theory, flown_claims(section, COLUMNS[1])]
    alone, shared = (_decisions(list(computed(jobs, workers))) for workers in (1, 2))
    assert alone == shared
    assert any(isinstance(claim, FlownClaim) and (claim.key, COLUMNS[1].name) in alone for claim in CLAIMS[section])


def _decisions(parts: list[Reproduction]) -> dict[tuple[str, str], Decision]:
    return {key: decision for part in parts for key, decision in part.decisions.items()}


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
    """The fitted and unfitted numbers in full, a row of the map; that no other pair fits is left to `make paper`."""
    page = (ANSWERS / "fitted.md").read_text(encoding="utf-8").splitlines()
    for row in unfitted_rows():
        assert f"| {' | '.join(row)} |" in page
    flown = map_csv([pair_of((0.4, beta2, COARSE)) for beta2 in BETA2]).splitlines()
    assert set(flown) <= set((ANSWERS / "fitted.csv").read_text(encoding="utf-8").splitlines())
    assert pair_of((0.4, 2.4, FINE)).prints
    assert not pair_of((0.5, 3.0, FINE)).prints
