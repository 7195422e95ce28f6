"""The test for a limit cycle: on records that are known, and on a few flights of docs/answers/chatter.md's study."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from harness.chatter import SHORTEST, VISIBLE, Oscillation, oscillation
from harness.studies.chatter import cases, false_alarms, seen, tell

PERIOD = 0.05
TIME = PERIOD * np.arange(2000)


def judged(command: NDArray[np.float64], flown: NDArray[np.float64], period: float = PERIOD) -> Oscillation:
    found = oscillation(command, flown, period)
    assert found is not None
    return found


def test_a_lopsided_cycle_is_told_with_its_frequency_and_amplitude() -> None:
    phase = math.tau * 0.7 * TIME
    flown = 0.05 * np.sin(phase) + 0.02 * np.cos(2.0 * phase)
    found = judged(1.5 * flown, flown)
    assert found.chatters
    assert found.frequency == pytest.approx(0.7, rel=2e-3)
    assert found.heading_rate == pytest.approx(0.5 * np.ptp(flown), rel=0.02)
    assert found.command == pytest.approx(1.5 * found.heading_rate, rel=1e-6)


@pytest.mark.parametrize(("swing", "chatters"), [(0.98 * VISIBLE, False), (1.05 * VISIBLE, True)])
def test_a_cycle_counts_from_half_a_degree_per_second_of_command(swing: float, chatters: bool) -> None:
    wave = np.sin(math.tau * 0.8 * TIME)
    assert judged(swing * wave, 0.5 * swing * wave).chatters is chatters


def test_a_command_that_alternates_every_period_is_a_cycle_at_half_the_rate() -> None:
    """As the kinematic aircraft does under a high gain and a long guidance period."""
    command = np.radians(5.0) * (-1.0) ** np.arange(200)
    found = judged(command, command, period=0.5)
    assert found.chatters
    assert (found.frequency, found.heading_rate) == pytest.approx((1.0, math.radians(5.0)), rel=0.01)


def test_what_the_wind_asks_of_every_lap_is_no_cycle() -> None:
    lap = math.tau * TIME / 97.0
    flown = np.radians(3.7 + 2.0 * np.sin(lap) + 0.5 * np.sin(2.0 * lap) + 0.1 * np.sin(3.0 * lap))
    assert judged(flown, flown).chatters is False


@pytest.mark.parametrize("damping", [0.1, 0.2, 0.4])
def test_a_damped_loop_driven_by_noise_is_not_taken_for_a_cycle(damping: float) -> None:
    """The response of a second order at 0.8 Hz to white noise, as large as a cycle: 200 records of 100 s each."""
    omega = math.tau * 0.8
    poles = np.exp((-damping + 1j * math.sqrt(1.0 - damping**2)) * omega * PERIOD)
    noise = np.random.default_rng(1).standard_normal((200, len(TIME) + 400))
    swings = lfilter([1.0], [1.0, -2.0 * poles.real, abs(poles) ** 2], noise)[:, 400:]
    swings *= 0.05 / swings.std()
    told = [judged(swing, swing).chatters for swing in swings]
    assert False not in told  # of so large a swing it is not denied either
    assert sum(entry is True for entry in told) <= 2  # 1 %


@pytest.mark.parametrize(
    ("samples", "period"), [(round(SHORTEST / PERIOD) - 1, PERIOD), (100, 3.0)], ids=["short", "slow"]
)
def test_a_record_that_cannot_tell_is_not_judged(samples: int, period: float) -> None:
    wave = np.sin(np.arange(samples, dtype=np.float64))
    assert oscillation(wave, wave, period) is None


def test_a_record_with_a_hole_is_not_judged() -> None:
    wave = np.sin(math.tau * TIME)
    hole = wave.copy()
    hole[7] = math.nan
    assert oscillation(hole, wave, PERIOD) is None
    assert oscillation(wave, hole, PERIOD) is None


def test_calm_flights_raise_no_alarm_and_cycles_are_seen() -> None:
    """A small part of docs/answers/chatter.md."""
    told = [tell(case) for kind, count in (("calm", 24), ("cycling", 12)) for case in cases(kind, count)]
    alarms, calm, _ = false_alarms(told)
    hits, cycling, _ = seen(told)
    assert (alarms, hits) == (0, cycling)
    assert calm >= 15
    assert cycling >= 10
