"""The margin to the limit cycle, and how the heading rate is followed where a law needs it."""

import math
from dataclasses import replace

import numpy as np
import pytest

import aircraft
from autopilot.laws import law
from autopilot.response import critical_gain, plain
from harness.flight import Flight
from harness.limit_cycle.cycle import limit_cycle
from harness.limit_cycle.margin import ENOUGH, Following, following, gain_margin
from harness.limit_cycle.prediction import Loop, crossover
from harness.log.metric import measure
from harness.loop import simulate
from harness.plants.identified import identified
from harness.plants.lagged import Lagged
from harness.plants.plant import Start
from harness.studies.observed_cycle import fly
from tests.test_prediction import proportional

STICK = aircraft.folder("ultra_stick_25e")


def flight(name: str = "nftsm", gains: str = "fitted", airspeed: float = 13.0, **parameters: float) -> Flight:
    return Flight(plant="sixdof", law=law(name, gains, **parameters), start=Start(airspeed=airspeed))


def known(found: Following) -> tuple[float, float, float]:
    assert found.margin is not None
    assert found.phase_margin is not None
    assert found.crossover is not None
    return found.margin, found.phase_margin, found.crossover


def test_of_a_proportional_law_both_margins_are_those_of_the_textbook() -> None:
    """Gain K: K |P| / omega = 1 at the crossover, where 90 deg are left less the lag of P and of the hold."""
    response, period = plain(0.02, 6.0, 0.7), 0.005
    critical, _ = critical_gain(response, period)
    loop = Loop(proportional(0.3 * critical), response, 13.0, period)
    crossing = crossover(loop)
    assert crossing is not None
    P = complex(response.at(np.array([crossing.frequency]))[0])
    assert 0.3 * critical * abs(P) / crossing.frequency == pytest.approx(1.0, rel=0.01)
    left = 0.5 * math.pi + np.angle(P) - 0.5 * crossing.frequency * period
    assert crossing.phase_margin == pytest.approx(left, abs=0.02)
    assert gain_margin(loop, crossing.gain) == pytest.approx(1.0 / 0.3, rel=0.02)


@pytest.mark.parametrize("times", [0.85, 1.2])
def test_flights_chatter_when_the_gain_has_grown_beyond_the_margin_and_not_before(times: float) -> None:
    response = identified(STICK, 13.0).heading_rate
    gain = 2.0 * times * gain_margin(Loop(proportional(2.0), response, 13.0, 0.05))
    cycle = fly(Loop(proportional(gain), response, 13.0, 0.05), Lagged(response), 80.0)
    assert (cycle.command > math.radians(0.5)) == (times > 1.0)


@pytest.mark.parametrize("k2", [12.0, 3.2, 2.0, 1.0])
def test_a_limit_cycle_is_predicted_exactly_where_the_margin_is_below_one(k2: float) -> None:
    settings = flight(k2=k2, k3=0.5 * k2)
    margin, phase_margin, _ = known(following(settings))
    loop = Loop(settings.law, identified(STICK, 13.0).heading_rate, 13.0, 0.05)
    assert (limit_cycle(loop) is not None) == (margin < 1.0) == (phase_margin < 0.0)
    assert following(settings).chatters == (margin < 1.0)


def test_a_law_of_half_the_gain_has_twice_the_margin() -> None:
    loop = Loop(law("nftsm"), identified(STICK, 13.0).heading_rate, 13.0, 0.05)
    assert gain_margin(replace(loop, gain=0.5)) == pytest.approx(2.0 * gain_margin(loop), rel=1e-4)


def test_the_papers_nftsm_has_no_margin_and_its_smc_has_plenty() -> None:
    nftsm, smc = following(flight()), following(flight("smc", "paper"))
    assert known(nftsm)[0] < 1.0
    assert nftsm.cycle is not None
    assert nftsm.cycle.frequency == pytest.approx(0.68, abs=0.02)
    assert smc.cycle is None
    assert known(smc)[0] > 20.0 > ENOUGH
    assert known(smc)[2] < 0.2 < 3.0 < known(nftsm)[2]


@pytest.mark.parametrize("name", aircraft.names())
def test_the_heading_rate_is_followed_in_full_at_low_frequency(name: str) -> None:
    airframe = aircraft.folder(name)
    speed = aircraft.limits(airframe).design_airspeed
    settings = replace(flight("smc", "paper", speed, standoff=200.0 * speed / 13.0), aircraft=name)
    found, sweep = following(settings), identified(airframe, speed).sweep
    assert sweep is not None
    assert found.low_frequency_gain == pytest.approx(1.0, abs=0.005)
    crossing = known(found)[2]
    gain, phase = sweep.at(crossing)
    assert (found.crossover_gain, found.crossover_delay) == (gain, -phase / crossing)
    assert 0.25 < -phase / crossing < 0.6


def test_where_nothing_is_known_it_says_why() -> None:
    unknown = following(flight(airspeed=17.0))
    assert "ultra_stick_25e is identified at 13 m/s" in unknown.reason
    assert (unknown.margin, unknown.chatters) == (None, None)
    assert "cannot be held" in following(flight(max_heading_rate=0.05)).reason


def test_the_second_call_costs_nothing() -> None:
    assert following(flight(k2=3.3)) is following(flight(k2=3.3, k3=6.0))


def test_predicted_and_observed_stand_side_by_side() -> None:
    """What a flight's metrics say of its limit cycle, and what was predicted of it."""
    settings = replace(flight(), plant="lagged", duration=160.0)
    predicted, observed = following(settings), measure(simulate(settings))
    assert predicted.cycle is not None
    assert observed["chatters"] is predicted.chatters is True
    assert observed["limit_cycle_hz"] == pytest.approx(predicted.cycle.frequency, rel=0.03)
    amplitude = math.degrees(predicted.cycle.heading_rate)
    assert observed["limit_cycle_amplitude_deg_s"] == pytest.approx(amplitude, rel=0.05)

    calm = replace(settings, law=law("smc", "paper"))
    observed = measure(simulate(calm))
    assert observed["chatters"] is following(calm).chatters is False
    assert observed["limit_cycle_hz"] is None
    assert observed["limit_cycle_amplitude_deg_s"] == 0.0
