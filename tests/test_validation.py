"""Recorded surfaces replayed on a model: it explains its own flight, the planted is found, the X8 rolls as flown."""

import json
from pathlib import Path

import numpy as np
import pytest

import aircraft
from harness.plants.replay import REPLAYED, Moment, replay
from harness.recorded.frames import to_earth
from harness.recorded.read import read_log
from harness.recorded.recorded_flight import Array, Basis, Channel, RecordedFlight
from harness.recorded.validation import ALTITUDE, STEP, Adjusted, explained, validated
from tests.builders import EXPERIMENTS, invoke

X8 = aircraft.folder("skywalker_x8")
MANOEUVRES = [EXPERIMENTS / "flights" / f"lateral_{name}.csv" for name in ("doublet_4", "121_4")]
PLANTED = Adjusted(aileron=np.radians(2.0), elevator=np.radians(-1.5), delay=0.06)


def flown_by_the_model(hidden: Adjusted) -> RecordedFlight:
    """What the model does with surfaces that move, in a log whose commands lack `hidden`."""
    time: Array = STEP * np.arange(1000.0)
    commands = np.zeros((len(time), 7))
    commands[:, 0] = np.radians(8.0) * np.sign(np.sin(4.0 * time))
    commands[:, 1] = np.radians(-2.0) + np.radians(2.0) * np.sin(3.0 * time)
    commands[:, 3], commands[:, 4], commands[:, 6] = 0.5, 3.0, 0.5
    late = commands.copy()
    for k in (0, 1):
        late[:, k] = np.interp(time - hidden.delay, time, commands[:, k]) + hidden[k]
    start = Moment(ALTITUDE, 0.1, 0.08, 1.0, 3.0 + 18.0 * np.cos(1.0), 18.0 * np.sin(1.0), 0.0, 0.0, 0.0, 0.0)
    flown = dict(zip(REPLAYED, replay(X8, STEP, start, late).T, strict=True))
    air = {"wind_north": commands[:, 4], "wind_east": commands[:, 5], "wind_down": commands[:, 6]}
    velocity = velocity_of(flown, air)
    surfaces = {"aileron": commands[:, 0], "elevator": commands[:, 1], "throttle": commands[:, 3]}
    values = {**flown, **air, **velocity, **surfaces}
    channels = {name: Channel(time, value, Basis.MEASURED, "model", len(time)) for name, value in values.items()}
    return RecordedFlight("model", ("model",), "s", channels)


def velocity_of(flown: dict[str, Array], air: dict[str, Array]) -> dict[str, Array]:
    """Over the ground, from airspeed, angles and attitude."""
    V, alpha, beta = flown["airspeed"], flown["angle_of_attack"], flown["sideslip"]
    along = V * np.cos(alpha) * np.cos(beta), V * np.sin(beta), V * np.sin(alpha) * np.cos(beta)
    over = to_earth(*along, flown["bank"], flown["pitch"], flown["yaw"])
    return {
        f"velocity_{axis}": v + air[f"wind_{axis}"] for axis, v in zip(("north", "east", "down"), over, strict=True)
    }


def test_the_model_explains_its_own_flight_and_what_is_planted_in_its_log_is_found() -> None:
    found = validated(X8, [flown_by_the_model(PLANTED)])
    assert min(found.adjusted.explained["roll_rate"]) > 99.0
    assert min(found.adjusted.explained["pitch"]) > 95.0
    assert found.adjusted.adjusted.delay == pytest.approx(PLANTED.delay, abs=0.005)
    assert found.adjusted.adjusted[:2] == pytest.approx(PLANTED[:2], abs=np.radians(0.1))
    assert max(found.as_recorded.explained["roll_rate"]) < 95.0


def test_the_x8_rolls_as_flown_and_does_not_yaw_so(tmp_path: Path) -> None:
    save = tmp_path / "curves.svg"
    flights = [word for path in MANOEUVRES for word in ("--with", path)]
    result = invoke("validate", "skywalker_x8", *flights, "--save", save, "--json")
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert 60.0 < found["as_recorded"]["explained_percent"]["roll_rate"][-1] < 75.0
    assert found["adjusted"]["explained_percent"]["roll_rate"][-1] > 80.0
    assert found["adjusted"]["explained_percent"]["yaw_rate"][-1] < 50.0
    assert 0.05 < found["adjusted"]["delay"] < 0.08  # the article identifies 0.07 s
    assert save.read_text(encoding="utf-8").count("<path") > 20


def test_the_lateral_coefficients_of_2025_explain_more_of_the_yaw() -> None:
    flights = [read_log([path]) for path in MANOEUVRES]
    later = EXPERIMENTS / "airframes" / "skywalker_x8_2025"
    before, after = (explained(airframe, flights, Adjusted(), 1.0) for airframe in (X8, later))
    assert after["yaw_rate"] > before["yaw_rate"] + 10.0
    assert after["roll_rate"] >= before["roll_rate"] - 1.0


def test_a_flight_that_cannot_be_replayed_is_one_line(tmp_path: Path) -> None:
    def refused(*words: object) -> str:
        result = invoke("validate", *words)
        assert result.exit_code == 2, result.output
        (line,) = result.stderr.splitlines()
        return line

    assert "has no rudder" in refused("aerosonde", "--with", MANOEUVRES[0])
    assert "must end in .png" in refused("skywalker_x8", "--with", MANOEUVRES[0], "--save", tmp_path / "a.txt")
    assert "must be one of" in refused("skywalker", "--with", MANOEUVRES[0])
    flight = flown_by_the_model(Adjusted())
    slow = flight.with_channel(
        "aileron", Channel(flight.end * np.arange(3.0) / 2.0, np.arange(3.0), Basis.COMMANDED, "a", 3)
    )
    with pytest.raises(ValueError, match=r"aileron changes 0\.4 times a second, at least 10 are needed"):
        validated(X8, [slow])
