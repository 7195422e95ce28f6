"""Recorded flights: rows that repeat are no samples, a command is held, and gaps stay unknown."""

import numpy as np
import pytest

from harness.recorded.recorded_flight import Basis, RecordedFlight, sampled


def test_rows_that_repeat_a_value_are_no_samples() -> None:
    row = np.arange(0.0, 60.0, 1 / 19)
    bank = np.sin(np.floor(row / 0.4) * 0.4)  # 19 rows a second of 2.5 values
    channel = sampled(row, bank, Basis.ESTIMATED, "roll.csv: measured")
    assert channel.rows == len(row)
    assert channel.rate == pytest.approx(2.5, rel=0.06)
    middle = (channel.time[:-1] + channel.time[1:]) / 2
    assert np.abs(channel.at(middle) - np.sin(middle - 0.03)).max() < 0.06


def test_what_stays_the_same_is_known_all_along() -> None:
    row = np.arange(0.0, 60.0, 0.1)
    throttle = np.where(row < 20.0, np.sin(row), 0.5)
    channel = sampled(row, throttle, Basis.MEASURED, "throttle")
    assert channel.rate == pytest.approx(10.0)
    assert channel.at(np.array([20.05, 33.3, 59.9])) == pytest.approx(0.5, abs=0.3)
    assert channel.at(np.array([33.3, 59.9])) == pytest.approx(0.5)


def test_a_command_is_held_and_a_measured_value_interpolated_but_not_across_a_gap() -> None:
    row = np.concatenate([np.arange(0.0, 10.0), np.arange(30.0, 40.0)])
    command, measured = (sampled(row, row * 2.0, basis, "x") for basis in (Basis.COMMANDED, Basis.MEASURED))
    assert command.at(np.array([-1.0, 3.5, 20.0, 39.0, 50.0])) == pytest.approx(
        [np.nan, 6, 18, 78, np.nan], nan_ok=True
    )
    assert measured.at(np.array([-1.0, 3.5, 9.0, 20.0, 30.0, 40.0])) == pytest.approx(
        [np.nan, 7, 18, np.nan, 60, np.nan], nan_ok=True
    )


def test_a_part_of_a_flight_keeps_the_command_that_was_given_before_it() -> None:
    channel = sampled(np.array([0.0, 10.0]), np.array([15.0, 16.0]), Basis.COMMANDED, "x")
    speed = sampled(np.arange(0.0, 10.0), np.sin(np.arange(10.0)), Basis.MEASURED, "y")
    flight = RecordedFlight("f", ("f.csv",), "s", {"airspeed_command": channel, "airspeed": speed})
    part = flight.between(5.0, 8.0)
    assert part["airspeed_command"].at(np.array([5.0])) == pytest.approx(15.0)
    assert (part.begin, part.end) == (5.0, 8.0)
