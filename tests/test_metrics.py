"""The metrics against logs whose numbers are known."""

import math

import numpy as np
import pytest

from harness.log import FlightLog
from harness.metric import METRICS, measure
from harness.plants.plant import Outcome
from tests.builders import log_of

TIME = log_of({})["time"]


def test_convergence_is_for_good() -> None:
    error = 50.0 * np.exp(-TIME / 10.0)
    assert measure(log_of({"range_error": error}))["convergence_time_s"] == pytest.approx(
        10.0 * math.log(50.0), abs=0.06
    )
    error[(TIME > 70.0) & (TIME < 70.2)] = 3.0  # leaves once more
    assert measure(log_of({"range_error": error}))["convergence_time_s"] == pytest.approx(70.2, abs=0.06)
    error[TIME > 96.0] = 0.5  # inside, but not for 5 s after having been out
    error[(TIME > 95.5) & (TIME < 95.8)] = 3.0
    assert measure(log_of({"range_error": error}))["convergence_time_s"] is None


def test_a_flight_inside_the_tolerance_from_the_start_has_converged_at_zero() -> None:
    assert measure(log_of({"range_error": 0.1}))["convergence_time_s"] == 0.0


def test_range_error_is_judged_over_the_last_half() -> None:
    error = np.where(TIME < 50.0, 80.0, 2.0 * np.sin(TIME))
    judged = measure(log_of({"range_error": error}))
    assert judged["range_error_rms_m"] == pytest.approx(math.sqrt(2.0), rel=0.02)
    assert judged["range_error_peak_m"] == pytest.approx(2.0, rel=1e-3)


def test_overshoot_is_the_largest_error_beyond_the_circle() -> None:
    error = 60.0 * np.exp(-TIME / 20.0) * np.cos(TIME / 5.0)
    beyond = error[error < 0]
    assert measure(log_of({"range_error": error}))["overshoot_m"] == pytest.approx(-beyond.min())
    assert measure(log_of({"range_error": np.exp(-TIME)}))["overshoot_m"] is None


def test_saturation_counts_commands_at_the_limit() -> None:
    unlimited = np.where(TIME >= 75.0, 1.0, 0.01)
    command = np.minimum(unlimited, 0.08)
    judged = measure(log_of({"heading_rate_command": command, "unlimited_command": unlimited}))
    assert judged["saturation_fraction"] == pytest.approx(0.5, abs=0.01)


def test_activity_is_total_variation_per_second() -> None:
    square = np.where(np.floor(TIME) % 2 == 0, 0.05, -0.05)
    judged = measure(log_of({"heading_rate_command": square, "unlimited_command": square}))
    assert judged["command_activity_deg_s2"] == pytest.approx(math.degrees(0.1), rel=0.03)


@pytest.mark.parametrize(("lag", "gain"), [(0.0, 1.0), (0.3, 0.9), (0.425, 1.05)])
def test_lag_and_gain_of_a_delayed_turn_are_found(lag: float, gain: float) -> None:
    amplitude, w = 0.06, 1.2
    command = amplitude * np.cos(w * (TIME + 0.025))  # the held command, at the middle of its period
    heading = 0.3 + gain * amplitude / w * np.sin(w * (TIME - lag))
    judged = measure(log_of({"heading_rate_command": command, "unlimited_command": command, "heading": heading}))
    assert judged["heading_rate_lag_s"] == pytest.approx(lag, abs=0.02)
    assert judged["heading_rate_gain"] == pytest.approx(gain, rel=0.01)


@pytest.mark.parametrize("lag", [0.013, 0.2, 0.425, 1.99])
def test_lag_and_gain_of_a_held_command_with_a_pure_delay_are_exact(lag: float) -> None:
    """The heading is the integral of 0.9 times the held command, delayed: the mean rate is a mix of two periods."""
    command = 0.08 * np.random.default_rng(0).choice([-1.0, 1.0], len(TIME)) + 0.03
    turned = np.concatenate([[0.0], 0.05 * 0.9 * np.cumsum(command)])
    heading = np.interp(TIME - lag, np.arange(len(turned)) * 0.05, turned)
    judged = measure(log_of({"heading_rate_command": command, "unlimited_command": command, "heading": heading}))
    assert judged["heading_rate_lag_s"] == pytest.approx(lag, abs=1e-9)
    assert judged["heading_rate_gain"] == pytest.approx(0.9, abs=1e-9)


def test_a_slow_command_tells_the_gain_and_not_the_lag() -> None:
    """SMC's: it moves by a degree per second in a quarter of a minute."""
    command = 0.06 * np.cos(0.2 * TIME)
    heading = 0.9 * 0.06 / 0.2 * np.sin(0.2 * (TIME - 0.3))
    judged = measure(log_of({"heading_rate_command": command, "unlimited_command": command, "heading": heading}))
    assert judged["heading_rate_lag_s"] is None
    assert judged["heading_rate_gain"] == pytest.approx(0.9, rel=0.01)


@pytest.mark.parametrize(("gusts", "is_told"), [(0.5, True), (2.0, False)])
def test_a_command_that_gusts_outweigh_tells_nothing_of_lag(gusts: float, is_told: bool) -> None:
    noise = np.random.default_rng(1)
    command = 0.05 * noise.choice([-1.0, 1.0], len(TIME))
    turned = np.concatenate([[0.0], 0.05 * np.cumsum(command + gusts * 0.05 * noise.normal(size=len(TIME)))])
    heading = np.interp(TIME - 0.3, np.arange(len(turned)) * 0.05, turned)
    judged = measure(log_of({"heading_rate_command": command, "unlimited_command": command, "heading": heading}))
    assert (judged["heading_rate_lag_s"] is not None) == is_told


def test_a_constant_command_tells_nothing_of_lag() -> None:
    judged = measure(log_of({"heading_rate_command": 0.05, "unlimited_command": 0.05, "heading": 0.05 * TIME}))
    assert judged["heading_rate_lag_s"] is None
    assert judged["heading_rate_error_rms_deg_s"] == pytest.approx(0.0, abs=1e-9)


def test_turn_ratio_is_heading_rate_over_the_coordinated_one() -> None:
    bank = 0.2 * np.sin(0.3 * TIME)
    rate = 0.93 * 9.80665 * np.tan(bank) / 13.0
    assert measure(log_of({"bank": bank, "heading_rate": rate}))["turn_ratio"] == pytest.approx(0.93)


def test_what_a_plant_does_not_have_is_none() -> None:
    judged = measure(log_of({}))
    assert set(judged) == set(METRICS)
    missing = {name for name, value in judged.items() if value is None}
    assert missing == {
        "overshoot_m", "heading_rate_lag_s", "heading_rate_gain", "turn_ratio", "sideslip_rms_deg", "sideslip_peak_deg",
        "bank_peak_deg", "lateral_acceleration_rms_mps2",
    }  # fmt: skip


def test_a_flight_that_ended_before_its_first_row_has_no_metric() -> None:
    log = log_of({})
    assert measure(FlightLog(log.flight, Outcome.INVALID, "", log.table[:0])) == dict.fromkeys(METRICS)
