"""The metrics against logs whose numbers are known."""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import ArrayLike

from autopilot.laws import law
from harness.log import FlightLog
from harness.log.metric import METRICS, YES_OR_NO, measure, window_in_words
from harness.loop import simulate
from harness.plants.plant import Outcome
from harness.series import unwrapped
from harness.settings.columns import is_setting
from harness.world.wind import Wind
from tests.builders import FLIGHT, log_of

TIME = np.arange(0.0, 100.0, 0.05)


def measured(columns: Mapping[str, ArrayLike]) -> dict[str, float | bool | None]:
    """The metrics of the builder's flight of 100 s with these columns."""
    return measure(log_of(columns))


def circling(laps: float, error: ArrayLike) -> FlightLog:
    """A flight of 100 s that goes round the target at the origin so many times, at a constant rate."""
    angle = math.tau * laps * TIME / TIME[-1]
    return log_of({"north": 200.0 * np.cos(angle), "east": 200.0 * np.sin(angle), "range_error": error})


def test_convergence_is_for_good() -> None:
    error = 50.0 * np.exp(-TIME / 10.0)
    assert measured({"range_error": error})["convergence_time_s"] == pytest.approx(10.0 * math.log(50.0), abs=0.06)
    error[(TIME > 70.0) & (TIME < 70.2)] = 3.0  # leaves once more
    assert measured({"range_error": error})["convergence_time_s"] == pytest.approx(70.2, abs=0.06)
    error[TIME > 96.0] = 0.5  # inside, but not for 5 s after having been out
    error[(TIME > 95.5) & (TIME < 95.8)] = 3.0
    assert measured({"range_error": error})["convergence_time_s"] is None


def test_a_flight_inside_the_tolerance_from_the_start_has_converged_at_zero() -> None:
    assert measured({"range_error": 0.1})["convergence_time_s"] == 0.0


def test_convergence_at_half_and_at_twice_the_tolerance() -> None:
    judged = measured({"range_error": 50.0 * np.exp(-TIME / 10.0)})
    for name, tolerance in (("half", 0.5), ("double", 2.0)):
        time = judged[f"convergence_time_{name}_tolerance_s"]
        assert time == pytest.approx(10.0 * math.log(50.0 / tolerance), abs=0.06)


@pytest.mark.parametrize("outcome", [Outcome.GROUND, Outcome.DEPARTED, Outcome.TARGET_LOST, Outcome.INVALID])
def test_a_flight_that_ended_early_has_not_converged(outcome: Outcome) -> None:
    judged = measure(replace(circling(3.2, 0.1), outcome=outcome))
    assert [judged[name] for name in METRICS if name.startswith("convergence_time")] == [None] * 3
    assert (judged["window_begin_s"], judged["window_laps"]) == (50.0, None)
    assert window_in_words(judged).endswith("to 99.95 s: the last half, since the flight did not converge.")


@pytest.mark.parametrize(("laps", "settles"), [(0.01, False), (0.09, False), (0.12, True), (-0.12, True)])
def test_on_the_circle_without_going_round_a_flight_does_not_settle(laps: float, settles: bool) -> None:
    """A lap takes 96.7 s in still air: 0.103 laps in 100 s are a tenth of that pace."""
    judged = measure(circling(laps, 0.1))
    assert judged["laps"] == pytest.approx(abs(laps))
    assert (judged["convergence_time_s"] is not None, judged["goes_round"]) == (settles, settles)


@pytest.mark.parametrize(("wind", "settles"), [(11.7, True), (12.999, False)])
def test_a_flight_that_hangs_against_the_wind_does_not_settle(wind: float, settles: bool) -> None:
    steep = law("nftsm", "fitted", max_heading_rate=math.radians(45.0))
    log = simulate(replace(FLIGHT, law=steep, duration=400.0, wind=Wind(steady=(wind, 0.0))))
    judged = measure(log)
    assert np.abs(log["range_error"][600:]).max() < 1.0
    assert (judged["convergence_time_s"] is not None, judged["goes_round"]) == (settles, settles)


def test_circling_is_judged_over_the_last_whole_laps_after_convergence() -> None:
    """Four and a half laps in 100 s, converged after 30 s: three laps, 66.7 s, fit."""
    judged = measure(circling(4.5, np.where(TIME < 30.0, 80.0, 0.5 * np.sin(TIME))))
    assert judged["convergence_time_s"] == pytest.approx(30.0)
    assert judged["window_laps"] == 3.0
    assert judged["window_begin_s"] == pytest.approx(100.0 - 300.0 / 4.5, abs=0.1)
    assert judged["window_end_s"] == pytest.approx(99.95)
    assert judged["range_error_rms_m"] == pytest.approx(0.5 * math.sqrt(0.5), rel=0.02)
    assert "the last 3 whole laps" in window_in_words(judged)


def test_circling_is_judged_over_what_is_left_where_no_lap_fits() -> None:
    judged = measure(circling(-1.0, np.where(TIME < 43.0, 80.0, 0.3)))
    assert judged["window_begin_s"] == pytest.approx(43.0)
    assert judged["window_laps"] == 0.0
    assert judged["range_error_rms_m"] == pytest.approx(0.3)
    assert judged["range_error_peak_m"] == 0.3
    assert "what is left after convergence, less than a lap" in window_in_words(judged)


def test_a_circle_that_cannot_be_held_is_judged_over_the_last_half_wherever_the_flight_ends() -> None:
    """13 m/s in 3 m/s of wind takes 5.64 deg/s: the flight is back on its circle for the last 30 s, and leaves it."""
    log = circling(1.0, np.where(TIME < 70.0, 80.0, 0.3))
    slow = law("smc", max_heading_rate=math.radians(5.0))
    judged = measure(replace(log, flight=replace(log.flight, law=slow, wind=Wind(steady=(3.0, 0.0)))))
    assert judged["convergence_time_s"] == pytest.approx(70.0)
    assert (judged["window_begin_s"], judged["window_laps"]) == (50.0, None)
    assert judged["range_error_peak_m"] == 80.0
    assert window_in_words(judged).endswith("the last half, since the circle cannot be held.")


def test_a_flight_that_does_not_converge_is_judged_over_its_last_half() -> None:
    judged = measured({"range_error": np.where(TIME < 50.0, 80.0, 2.0 * np.sin(TIME))})
    assert (judged["window_begin_s"], judged["window_laps"]) == (50.0, None)
    assert judged["range_error_rms_m"] == pytest.approx(math.sqrt(2.0), rel=0.02)
    assert judged["range_error_peak_m"] == pytest.approx(2.0, rel=1e-3)


def test_overshoot_is_the_largest_error_beyond_the_circle() -> None:
    error = 60.0 * np.exp(-TIME / 20.0) * np.cos(TIME / 5.0)
    beyond = error[error < 0]
    assert measured({"range_error": error})["overshoot_m"] == pytest.approx(-beyond.min())
    assert measured({"range_error": np.exp(-TIME)})["overshoot_m"] == 0.0


def test_saturation_counts_commands_at_the_limit() -> None:
    unlimited = np.where(TIME >= 75.0, 1.0, 0.01)
    command = np.minimum(unlimited, FLIGHT.law.max_heading_rate)
    judged = measured({"heading_rate_command": command, "unlimited_command": unlimited})
    assert judged["saturation_fraction"] == pytest.approx(0.25, abs=0.01)


def test_activity_is_total_variation_per_second() -> None:
    square = np.where(np.floor(TIME) % 2 == 0, 0.05, -0.05)
    judged = measured({"heading_rate_command": square, "unlimited_command": square})
    assert judged["command_activity_deg_s2"] == pytest.approx(math.degrees(0.1), rel=0.03)


@pytest.mark.parametrize(("lag", "gain"), [(0.0, 1.0), (0.3, 0.9), (0.425, 1.05)])
def test_lag_and_gain_of_a_delayed_turn_are_found(lag: float, gain: float) -> None:
    amplitude, w = 0.06, 1.2
    command = amplitude * np.cos(w * (TIME + 0.025))  # the held command, at the middle of its period
    heading = 0.3 + gain * amplitude / w * np.sin(w * (TIME - lag))
    judged = measured({"heading_rate_command": command, "unlimited_command": command, "heading": heading})
    assert judged["heading_rate_lag_s"] == pytest.approx(lag, abs=0.02)
    assert judged["heading_rate_gain"] == pytest.approx(gain, rel=0.01)


@pytest.mark.parametrize("lag", [0.013, 0.2, 0.425, 1.99])
def test_lag_and_gain_of_a_held_command_with_a_pure_delay_are_exact(lag: float) -> None:
    """The heading is the integral of 0.9 times the held command, delayed: the mean rate is a mix of two periods."""
    command = 0.08 * np.random.default_rng(0).choice([-1.0, 1.0], len(TIME)) + 0.03
    turned = np.concatenate([[0.0], 0.05 * 0.9 * np.cumsum(command)])
    heading = np.interp(TIME - lag, np.arange(len(turned)) * 0.05, turned)
    judged = measured({"heading_rate_command": command, "unlimited_command": command, "heading": heading})
    assert judged["heading_rate_lag_s"] == pytest.approx(lag, abs=1e-9)
    assert judged["heading_rate_gain"] == pytest.approx(0.9, abs=1e-9)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("period", [0.5, 0.8, 1.2])
def test_the_lag_behind_a_periodic_command_is_the_smallest_that_explains_it(period: float, seed: int) -> None:
    """A limit cycle: a delay of one, two or three periods more explains as much, and with noise even more."""
    noise = np.random.default_rng(seed)
    command = 0.05 * np.sign(np.sin(math.tau * (TIME + 0.01) / period))
    turned = np.concatenate([[0.0], 0.05 * np.cumsum(0.8 * command + 0.005 * noise.normal(size=len(TIME)))])
    heading = np.interp(TIME - 0.2, np.arange(len(turned)) * 0.05, turned)
    judged = measured({"heading_rate_command": command, "unlimited_command": command, "heading": heading})
    assert judged["heading_rate_lag_s"] == pytest.approx(0.2, abs=0.01)
    assert judged["heading_rate_gain"] == pytest.approx(0.8, rel=0.02)


def test_a_slow_command_tells_the_gain_and_not_the_lag() -> None:
    """SMC's: it moves by a degree per second in a quarter of a minute."""
    command = 0.06 * np.cos(0.2 * TIME)
    heading = 0.9 * 0.06 / 0.2 * np.sin(0.2 * (TIME - 0.3))
    judged = measured({"heading_rate_command": command, "unlimited_command": command, "heading": heading})
    assert judged["heading_rate_lag_s"] is None
    assert judged["heading_rate_gain"] == pytest.approx(0.9, rel=0.01)


@pytest.mark.parametrize(("gusts", "is_told"), [(0.5, True), (2.0, False)])
def test_a_command_that_gusts_outweigh_tells_nothing_of_lag(gusts: float, is_told: bool) -> None:
    noise = np.random.default_rng(1)
    command = 0.05 * noise.choice([-1.0, 1.0], len(TIME))
    turned = np.concatenate([[0.0], 0.05 * np.cumsum(command + gusts * 0.05 * noise.normal(size=len(TIME)))])
    heading = np.interp(TIME - 0.3, np.arange(len(turned)) * 0.05, turned)
    judged = measured({"heading_rate_command": command, "unlimited_command": command, "heading": heading})
    assert (judged["heading_rate_lag_s"] is not None) == is_told


def test_a_constant_command_tells_nothing_of_lag() -> None:
    judged = measured({"heading_rate_command": 0.05, "unlimited_command": 0.05, "heading": 0.05 * TIME})
    assert judged["heading_rate_lag_s"] is None
    assert judged["heading_rate_error_rms_deg_s"] == pytest.approx(0.0, abs=1e-9)


def test_turn_ratio_is_heading_rate_over_the_coordinated_one() -> None:
    bank = 0.2 * np.sin(0.3 * TIME)
    rate = 0.93 * 9.80665 * np.tan(bank) / 13.0
    assert measured({"bank": bank, "heading_rate": rate})["turn_ratio"] == pytest.approx(0.93)


def test_what_a_plant_or_a_flight_does_not_have_is_none() -> None:
    judged = measured({})
    assert set(judged) == set(METRICS)
    missing = {name for name, value in judged.items() if value is None}
    assert missing == {
        "heading_rate_lag_s", "heading_rate_gain", "turn_ratio", "sideslip_rms_deg", "sideslip_peak_deg",
        "bank_peak_deg", "bank_reserve_deg", "lateral_acceleration_rms_mps2", "limit_cycle_hz",
    }  # fmt: skip


def test_a_flight_that_ended_before_its_first_row_has_no_metric() -> None:
    log = log_of({})
    judged = measure(FlightLog(log.flight, Outcome.INVALID, "", log.table[:0]))
    assert judged == dict.fromkeys(METRICS)
    assert window_in_words(judged) == ""


SUFFIXES = {"s": "_s", "m": "_m", "m/s": "_mps", "m/s2": "_mps2", "deg": "_deg", "deg/s": "_deg_s",
            "deg/s2": "_deg_s2", "Hz": "_hz", "1": "", YES_OR_NO: ""}  # fmt: skip


@pytest.mark.parametrize("name", METRICS)
def test_the_name_of_a_metric_ends_with_its_unit_and_is_that_of_no_setting(name: str) -> None:
    ends = [unit for unit, suffix in SUFFIXES.items() if suffix and name.endswith(suffix)]
    assert METRICS[name].unit in (ends or ["1", YES_OR_NO])
    assert not is_setting(name)


def test_angles_are_counted_on_with_the_bits_of_numpy() -> None:
    draws = np.random.default_rng(1)
    for size in (0, 1, 2, 500):
        for spread in (0.1, 3.0, 20.0):
            angle = draws.normal(0.0, spread, size)
            assert np.array_equal(unwrapped(angle), np.unwrap(angle))
    edges = np.array([0.0, math.pi, 0.0, -math.pi, math.pi, -0.0, math.nan, 1.0])
    assert np.array_equal(unwrapped(edges), np.unwrap(edges), equal_nan=True)
