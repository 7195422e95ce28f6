"""Requirements on flights: their grammar, and when a flight meets one."""

import math

import pytest

from harness.requirement import FORESEEN, Facts, Requirement, RequirementError, foreseen, requirement
from harness.settings import load_flight
from tests.builders import EXPERIMENTS

FACTS: Facts = {"outcome": "completed", "chatters": False, "range_error_peak_m": 5.0, "limit_cycle_margin": None}


@pytest.mark.parametrize(
    ("text", "distance"),
    [
        ("range_error_peak_m < 10", 0.5),
        ("range_error_peak_m<=5", 0.0),
        ("range_error_peak_m > 4", 0.25),
        ("chatters = false", 1.0),
        ("chatters == false", 1.0),
        ("chatters != true", 1.0),
        ("outcome = completed", 1.0),
        ("outcome != ground", 1.0),
    ],
)
def test_a_flight_that_meets_a_requirement_is_on_its_inner_side(text: str, distance: float) -> None:
    assert requirement(text).is_met(FACTS)
    assert requirement(text).distance(FACTS) == pytest.approx(distance)


@pytest.mark.parametrize(
    ("text", "distance"),
    [
        ("range_error_peak_m < 5", 0.0),
        ("range_error_peak_m >= 10", -0.5),
        ("range_error_peak_m < 0", -5.0),
        ("chatters = true", -1.0),
        ("outcome != completed", -1.0),
        ("limit_cycle_margin >= 1.5", -math.inf),
        ("bank_peak_deg > -100", -math.inf),
    ],
)
def test_a_flight_that_misses_a_requirement_is_off_by_a_share_of_its_value(text: str, distance: float) -> None:
    assert not requirement(text).is_met(FACTS)
    assert requirement(text).distance(FACTS) == pytest.approx(distance)


def test_what_is_asked_where_it_is_known_is_not_asked_elsewhere() -> None:
    margin = Requirement("limit_cycle_margin", ">=", 1.5, where_known=True)
    assert margin.is_met(FACTS)
    assert not margin.is_met({"limit_cycle_margin": 1.4})


@pytest.mark.parametrize("text", ["range_error_peak_m < 5", "chatters = false", "outcome != ground", "laps >= 1.5"])
def test_a_requirement_is_printed_as_it_is_read(text: str) -> None:
    assert str(requirement(text)) == text


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("range_error_peak_m", "must be NAME OP VALUE"),
        ("range_error_peak_m < ", "must be NAME OP VALUE"),
        ("range_error_peak < 5", "did you mean 'range_error_peak_m'?"),
        ("range_error_peak_m < five", "'five' must be a number"),
        ("range_error_peak_m < inf", "'inf' must be a number"),
        ("range_error_peak_m = 5", "'=' must be one of <=, >=, <, > for range_error_peak_m"),
        ("chatters < 1", "'<' must be one of =, != for chatters"),
        ("chatters = 0", "'0' must be one of true, false for chatters"),
        ("outcome = crashed", "'crashed' must be one of completed, ground"),
    ],
)
def test_what_is_no_requirement_is_refused_with_what_is_allowed(text: str, said: str) -> None:
    with pytest.raises(RequirementError) as caught:
        requirement(text)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_is_foreseen_of_a_flight_has_every_name_and_the_margin_alone_is_the_same() -> None:
    flight = load_flight(EXPERIMENTS / "stationary.toml")
    everything = foreseen(flight)
    assert {*everything} == {*FORESEEN}
    assert foreseen(flight, ["limit_cycle_margin"]) == {
        name: everything[name] for name in (FORESEEN[0], "limit_cycle_margin")
    }
    assert foreseen(flight, ["feasibility_margin_deg_s"]) == {FORESEEN[0]: everything[FORESEEN[0]]}
    kinematic = foreseen(load_flight(EXPERIMENTS / "stationary.toml", ["plant=kinematic"]))
    assert {name for name, fact in kinematic.items() if fact is not None} == {"feasibility_margin_deg_s"}
