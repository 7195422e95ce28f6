"""Gain sets that follow from a rule: the circle's own units, and half of where the limit cycle begins."""

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import aircraft
import harness
from autopilot.laws import LAWS
from autopilot.rules import RuleError
from harness.cli.main import harness as cli
from harness.error import ArgumentError, SettingsError
from harness.flight import Flight
from harness.limit_cycle.margin import following
from harness.loop import simulate
from harness.plants.plant import Start
from harness.runs.description import flown
from harness.settings.file import flight_from_document
from harness.settings.gains import by_rule
from harness.settings.written import document
from harness.world.target import Target
from harness.world.wind import Wind
from tests.builders import write

AIRSPEEDS = {"ultra_stick_25e": 13.0, "skywalker_x8": 13.0, "aerosonde": 25.0}


def described(law: Mapping[str, object], **flight: object) -> Flight:
    return flight_from_document({"plant": "kinematic", **flight, "law": law})


def circle_of(law: str, standoff: float, airspeed: float) -> Flight:
    """The paper's case with its lengths in radii and its times in radii over airspeed."""
    larger, longer = standoff / 200.0, (standoff / 200.0) / (airspeed / 13.0)
    limit = math.degrees(math.radians(5.0) / longer)
    flight = described(
        {"name": law, "gains": "scaled", "standoff_m": standoff, "max_heading_rate_deg_s": limit},
        start={"airspeed_mps": airspeed},
    )
    return replace(
        flight,
        duration=100.0 * longer,
        guidance_period=0.05 * longer,
        step=0.005 * longer,
        start=Start(position=(-200.0 * larger, 200.0 * larger), airspeed=airspeed),
        target=Target(position=(10.0 * larger, 10.0 * larger), speed=2.0 * airspeed / 13.0, heading=0.4),
        wind=Wind(steady=(0.0, 3.0 * airspeed / 13.0)),
    )


@pytest.mark.parametrize("law", [name for name, kind in LAWS.items() if "scaled" in kind.rules])
@pytest.mark.parametrize(("standoff", "airspeed"), [(400.0, 13.0), (200.0, 26.0), (50.0, 19.5)])
def test_with_scaled_gains_another_circle_or_airspeed_is_the_same_flight(
    law: str, standoff: float, airspeed: float
) -> None:
    one, other = simulate(circle_of(law, 200.0, 13.0)), simulate(circle_of(law, standoff, airspeed))
    assert len(other) == len(one) == 2001
    assert np.abs(other["range_error"] / standoff - one["range_error"] / 200.0).max() < 1e-9
    assert np.abs(other["heading_error"] - one["heading_error"]).max() < 1e-7
    assert np.ptp(one["heading_rate_command"]) > math.radians(3.0)


def test_scaled_gains_are_the_papers_on_the_papers_circle() -> None:
    for name, kind in LAWS.items():
        if "scaled" in kind.rules:
            paper: Any = described({"name": name, "gains": "scaled"}).law
            assert {gain: getattr(paper, gain) for gain in kind.numbers("scaled")} == kind.numbers("scaled")


@pytest.mark.parametrize("airframe", aircraft.names())
def test_behind_the_inner_loop_the_margin_to_the_limit_cycle_is_two(airframe: str) -> None:
    airspeed = AIRSPEEDS[airframe]
    law = {"name": "nftsm", "gains": "behind_inner_loop", "standoff_m": 15.4 * airspeed, "max_heading_rate_deg_s": 8.0}
    flight = described(law, plant="sixdof", aircraft=airframe, start={"airspeed_mps": airspeed})
    own: Any = flight.law
    assert own.k3 == 0.5 * own.k2
    doubled = replace(own, k2=2.0 * own.k2, k3=2.0 * own.k3)
    assert following(replace(flight, law=doubled)).margin == pytest.approx(1.0, abs=0.02)
    assert f"by the rule behind_inner_loop, k2 = {own.k2:g}, k3 = {own.k3:g}" in flown(document(flight))


def test_a_gain_that_is_given_stands_beside_those_of_the_rule() -> None:
    own: Any = described({"name": "nftsm", "gains": "scaled", "standoff_m": 400.0, "k2": 1.0}).law
    assert (own.k1, own.k2, own.k3) == (0.025, 1.0, 3.0)


def test_what_a_row_keeps_is_not_calculated_again() -> None:
    flight = described({"name": "nftsm", "gains": "scaled", "standoff_m": 400.0})
    kept = document(flight)
    kept["law"]["k1"] = 0.03
    assert flight_from_document(kept) == replace(flight, law=replace(flight.law, k1=0.03))  # type: ignore[type-var]


def test_a_rule_without_an_answer_is_a_mistake_of_the_file() -> None:
    law = {"name": "nftsm", "gains": "behind_inner_loop"}
    with pytest.raises(SettingsError, match=r"flight.law.gains: .* is identified at 13 m/s.*run harness identify"):
        described(law, start={"airspeed_mps": 19.0}, aircraft="ultra_stick_25e")
    with pytest.raises(SettingsError, match="the circle cannot be held"):
        described({**law, "standoff_m": 50.0})


def test_python_gives_the_flight_for_a_rule() -> None:
    flight = described({"name": "nftsm", "standoff_m": 400.0})
    own: Any = harness.law("nftsm", "scaled", flight=flight, standoff=400.0, k3=1.0)
    assert (own.gains, own.k1, own.k2, own.k3) == ("scaled", 0.025, 6.0, 1.0)
    with pytest.raises(ArgumentError, match="follows from a flight by a rule: give the flight"):
        harness.law("nftsm", "scaled")
    with pytest.raises(RuleError, match="no airframe"):
        by_rule(replace(flight, law=replace(own, gains="behind_inner_loop"), aircraft="no such"), ())


def test_compare_and_report_say_which_rule_gave_which_numbers(tmp_path: Path) -> None:
    experiment = write(
        tmp_path / "scaled.toml",
        '[flight]\nduration_s = 2.0\nlaw = { name = "nftsm", gains = "scaled", standoff_m = 400.0 }\n'
        '[matrix]\nplant = ["kinematic", "lagged"]\n"law.k3" = [1.0, 3.0]\n',
    )
    harness.run(experiment, tmp_path / "out", workers=0)
    told = (
        "Gains of nftsm by the rule scaled, from fitted: k1 = 0.025, k2 = 6, k3 = 1 "
        "(ultra_stick_25e, 13 m/s, circle of 400 m); k1 = 0.025, k2 = 6, k3 = 3 "
        "(ultra_stick_25e, 13 m/s, circle of 400 m)."
    )
    assert told in harness.compare(tmp_path / "out").answer.splitlines()
    report = CliRunner().invoke(cli, ["report", str(tmp_path / "out"), "--out", str(tmp_path / "page.html")])
    assert report.exit_code == 0
    assert told in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_compare_says_which_laws_predict_on_one_plant_and_not_on_another(tmp_path: Path) -> None:
    experiment = write(
        tmp_path / "lead.toml",
        '[flight]\nduration_s = 2.0\nlaw = { name = "nftsm_lead" }\n'
        '[matrix]\nplant = ["kinematic", "lagged"]\n"law.name" = ["nftsm_lead", "lq_orbit", "smc"]\n',
    )
    harness.run(experiment, tmp_path / "out", workers=0)
    told = "Use a model of the inner loop, bypassed on kinematic (ideal inner loop): nftsm_lead, lq_orbit."
    assert told in harness.compare(tmp_path / "out").answer.splitlines()
