"""The paper's numbers, each under the one reading of its experiment, and the page that shows them."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.studies.paper.experiments import EXPERIMENTS, NEITHER, NO_ACCELERATION, Reading, flight, flown
from harness.studies.paper.figures import LAWS_DRAWN, sketch
from harness.studies.paper.job import Reproduction, theory
from harness.studies.paper.measures import delay, restricted, settled
from harness.studies.paper.page import page
from harness.studies.paper.reproduce import (
    NUMBERS,
    VARIANTS,
    Number,
    Reproduced,
    Value,
    formatted,
    moved,
    reproduced,
    table,
    under,
)

PAGE = Path(__file__).parent.parent / "docs" / "answers" / "paper_numbers.md"
TABLE_3 = [number for number in NUMBERS if number.where == "Table 3" and number.law != "NFTSM as printed"]
AS_PRINTED = [number for number in NUMBERS if number.law == "NFTSM as printed"]


def ours(number: Number) -> Value:
    return under(number, EXPERIMENTS[number.experiment].reading)


@pytest.mark.parametrize("number", TABLE_3, ids=lambda number: f"{number.law} {number.printed}")
def test_table_3_is_reproduced_to_the_printed_digits(number: Number) -> None:
    """Still air, 5 deg/s, a command held for 1 ms; NFTSM with the coefficients fitted to its two rows."""
    assert number.agrees(ours(number))


@pytest.mark.parametrize("number", AS_PRINTED, ids=lambda number: number.printed)
def test_the_printed_coefficients_cannot_give_the_printed_rows(number: Number) -> None:
    assert ours(number) is None


def test_the_page_shows_every_number_as_it_is() -> None:
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    for number in NUMBERS:
        value = ours(number)
        header, line = table([Reproduced(number, value, number.agrees(value), {})])
        assert header in lines
        assert line in lines


def test_a_number_not_printed_agrees_only_with_not_converging() -> None:
    shock = next(number for number in NUMBERS if number.printed == "shock")
    assert shock.agrees(None)
    assert not shock.agrees(36.3)
    assert not TABLE_3[0].agrees(None)
    assert not TABLE_3[0].agrees(31.26)


def test_an_interval_agrees_when_both_its_ends_do() -> None:
    number = next(number for number in NUMBERS if number.printed == "8-17 s")
    assert number.agrees((7.6, 17.4))
    assert not number.agrees((7.6, 17.6))
    assert not number.agrees(None)
    assert formatted(number, (0.0, 41.07)) == "0-41"


def test_manoeuvres_are_read_with_the_acceleration_unknown_and_the_turn_rate_known() -> None:
    """The one knowledge with which SMC is sensitive to the target's speed and not to its turns."""
    for label, limited in (("NFTSM", False), ("SMC", False), ("NFTSM_1", True)):
        one = flight("manoeuvres", label)
        assert one.estimator == NO_ACCELERATION
        assert np.isfinite(one.law.max_heading_rate) == limited


def test_a_target_without_manoeuvres_makes_all_knowledge_of_them_the_same_flight() -> None:
    assert flight("30", "SMC", Reading(known=NEITHER)) == flight("30", "SMC", Reading())
    assert flight("S", "SMC", Reading(known=NEITHER)) != flight("S", "SMC", Reading())


def test_restricted_settled_and_delay_are_read_off_a_flight() -> None:
    one = replace(flight("30", "NFTSM"), guidance_period=0.05, step=0.005)
    log = flown(one)
    span = restricted(log)
    assert span is not None
    begin, end = span
    inside = (log["time"] >= begin) & (log["time"] < end)
    assert (np.abs(log["unlimited_command"][inside]) > one.law.max_heading_rate).all()
    assert abs(log["unlimited_command"][~inside & (log["time"] >= end)][0]) <= one.law.max_heading_rate
    time = settled(log, 0.01)
    assert time is not None
    assert (np.abs(log["range_error"][log["time"] >= time]) < 0.01).all()
    assert settled(log, 0.01, until=time) is None
    assert delay(log, log) is None  # over before 350 s


def test_the_page_holds_everything_and_is_the_same_each_time() -> None:
    sketches = {
        (experiment, law): sketch(
            flown(replace(flight(experiment, law, duration=10.0), guidance_period=0.05, step=0.005))
        )
        for experiment in EXPERIMENTS
        for law in LAWS_DRAWN
    }
    everything = Reproduction(
        [Reproduced(TABLE_3[0], 31.2, True, dict.fromkeys(VARIANTS))], sketches, theory().decisions
    )
    text = page(everything)
    for number in range(2, 11):
        assert re.search(rf"Figures? (\d+ and )?{number}\D", text), number
    assert text.count("<svg") == 9
    assert "holds if" in text
    assert text == page(everything)


def test_the_table_tells_what_moves_a_number() -> None:
    (result,) = reproduced((TABLE_3[1],))
    header, line = moved([result])
    assert "0.5 s" in header
    assert "1 ms" not in result.otherwise  # that is the reading itself
    assert result.otherwise["wind"] == pytest.approx(-0.664, abs=5e-4)
    assert "-0.664" in line
