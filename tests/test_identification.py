"""What `harness identify` measures and fits: on responses that are known, and on the airframes."""

import itertools
import math
import re
from dataclasses import astuple, replace
from pathlib import Path

import numpy as np
import pytest

import aircraft
from autopilot.response import Response, plain
from harness.cli import _progress
from harness.identification.fit import (
    Training,
    airspeed_change,
    error,
    fit,
    fit_airspeed,
    followed,
    response_of,
)  # fmt: skip
from harness.identification.identify import (
    frequency_response,
    of_airspeed,
    of_bank,
    of_heading_rate,
    step_response,
)  # fmt: skip
from harness.identification.manoeuvres import (
    CHATTER,
    HELD_OUT,
    STEP,
    TRAINING,
    WHOLE,
    Programme,
    Record,
    begins,
    flown,
    held,
    lines,
    quick,
    sweep,
)
from harness.plants.coordinated import AirspeedHold
from harness.plants.identified import document, identified, is_stale, read
from harness.plants.lagged import Lagged
from harness.plants.plant import Start
from harness.plants.state import State
from harness.world.air import Air
from tests.builders import copied_airframe, invoke

KNOWN = Response(
    delay=0.033, frequency=9.0, damping=0.7, lead=-0.02, sideslip_frequency=3.0, sideslip_damping=0.4,
    zero_frequency=3.6, zero_damping=0.3, tail_rate=0.4, tail_share=0.08,
)  # fmt: skip
AIRFRAMES = [(name, aircraft.limits(aircraft.folder(name)).design_airspeed) for name in aircraft.names()]


def record_of(response: Response, command: np.ndarray) -> Record:
    """What an aircraft with this response does, as if it had been flown."""
    states = np.full((len(command) + 1, len(State._fields)), math.nan)
    turned = np.cumsum(np.append(0.0, STEP * followed(response, command)))
    states[:, State._fields.index("heading")] = np.remainder(turned + math.pi, math.tau) - math.pi
    states[:, State._fields.index("bank")] = 0.1
    states[:, State._fields.index("airspeed")] = 13.0
    return Record(command, states, 13.0)


@pytest.mark.parametrize("delay", [0.0, 0.005, 0.033])
def test_the_fit_simulates_what_the_lagged_plant_flies(delay: float) -> None:
    response, command = replace(KNOWN, delay=delay), HELD_OUT["turns, changed every second"]
    flying = Lagged(response).start(Start(heading=0.0), Air())
    headings = [0.0]
    for rate in command.tolist():
        flying.advance(rate, STEP)
        headings.append(flying.state.heading)
    assert STEP * np.cumsum(followed(response, command)) == pytest.approx(np.unwrap(headings)[1:], abs=1e-11)


def test_a_fit_recovers_the_response_that_made_the_records() -> None:
    commands = [TRAINING["step of 5 deg/s"], TRAINING["sweep of 2 deg/s rms"][:8000]]
    found = fit([of_heading_rate(record_of(KNOWN, command)) for command in commands])
    assert astuple(found) == pytest.approx(astuple(KNOWN), rel=1e-3)


def test_a_fit_recovers_the_response_of_a_slow_aircraft_at_its_pace() -> None:
    pace = 0.1
    slow = replace(
        KNOWN, delay=KNOWN.delay / pace, frequency=KNOWN.frequency * pace, lead=KNOWN.lead / pace,
        sideslip_frequency=KNOWN.sideslip_frequency * pace, zero_frequency=KNOWN.zero_frequency * pace,
        tail_rate=KNOWN.tail_rate * pace,
    )  # fmt: skip
    commands = [np.repeat(TRAINING["step of 5 deg/s"], 5), TRAINING["sweep of 2 deg/s rms"]]
    found = fit([of_heading_rate(record_of(slow, command)) for command in commands], pace)
    assert astuple(found) == pytest.approx(astuple(slow), rel=1e-3)


def test_a_fit_recovers_the_airspeed_hold() -> None:
    hold = AirspeedHold(gain=-0.7, frequency=0.6, damping=0.8)
    excess = np.repeat([0.0, 0.3, 0.0], 2000)
    found = fit_airspeed([Training(excess, airspeed_change(hold, excess))])
    assert astuple(found) == pytest.approx(astuple(hold), rel=1e-4)


def test_an_airframe_is_flown_from_a_relative_folder_as_from_an_absolute_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(aircraft.FOLDER)
    here, there = (
        flown(folder, 18.0, held([5], 0.1)) for folder in (Path("skywalker_x8"), aircraft.folder("skywalker_x8"))
    )
    assert np.array_equal(here.states, there.states)


@pytest.mark.parametrize("programme", [WHOLE, quick(3)])
def test_no_flight_of_a_programme_repeats_another_and_all_that_is_asked_is_flown(programme: Programme) -> None:
    flights = programme.flights()
    for (command, rate_trim), (other, trimmed) in itertools.permutations(flights, 2):
        assert rate_trim != trimmed or not begins(command, other)
    for command in (*programme.steps, *programme.entries, *programme.training.values(), *programme.held_out.values()):
        assert any(begins(command, flown) for flown, rate_trim in flights if rate_trim)
    assert sum(not rate_trim for _, rate_trim in flights) == len(programme.training)


def test_a_sweep_measures_the_frequency_response() -> None:
    measured = frequency_response(record_of(KNOWN, sweep(2.0, periods=2)))
    assert measured.ratio == pytest.approx(KNOWN.at(lines()), abs=3e-3)


def test_the_bandwidth_of_a_butterworth_response_is_its_frequency() -> None:
    measured = frequency_response(record_of(plain(0.0, 4.0, math.sqrt(0.5)), sweep(2.0, periods=2)))
    assert measured.bandwidth == pytest.approx(4.0, rel=0.01)


def test_a_step_measures_lag_gain_and_overshoot() -> None:
    step = step_response(record_of(plain(0.1, 5.0, 0.5), held([5], 10.0)))
    assert step.overshoot == pytest.approx(math.exp(-math.pi * 0.5 / math.sqrt(0.75)), rel=1e-3)
    assert step.gain == pytest.approx(1.0, abs=1e-4)
    assert math.isnan(step_response(record_of(plain(0.1, 0.05, 0.8), held([5], 10.0))).lag)
    first_order = replace(plain(0.1, 1e3, 1.0), tail_rate=2.0, tail_share=1.0)
    assert step_response(record_of(first_order, held([5], 10.0))).lag == pytest.approx(0.1 + 0.5, abs=0.003)


@pytest.mark.parametrize(("name", "airspeed"), AIRFRAMES)
def test_what_is_kept_beside_an_airframe_is_what_it_does(name: str, airspeed: float) -> None:
    """A cheap part of `make identify`: one step of those measured, and the held-out manoeuvres that take longest."""
    airframe = aircraft.folder(name)
    kept = identified(airframe, airspeed)
    assert not is_stale(airframe), "the model or its inner loop has changed: make identify"
    step = step_response(flown(airframe, airspeed, held([5], 10.0)))
    assert (step.lag, step.gain, step.turn_ratio) == pytest.approx(
        tuple(kept.measured[key] for key in ("lag_s", "gain", "turn_ratio")), rel=1e-3
    )
    turns = HELD_OUT["turns, changed every second"]
    wrong = error(kept.heading_rate, of_heading_rate(flown(airframe, airspeed, turns)))
    assert wrong == pytest.approx(kept.errors["turns, changed every second"][0], abs=5e-4)
    assert kept.bank
    assert error(kept.bank, of_bank(flown(airframe, airspeed, turns, rate_trim=False), kept.bank_limit)) < 0.05


@pytest.mark.parametrize(("name", "airspeed"), AIRFRAMES)
def test_lagged_follows_held_out_steps_and_turns_within_5_percent(name: str, airspeed: float) -> None:
    errors = identified(aircraft.folder(name), airspeed).errors
    assert errors.keys() == {*HELD_OUT, *CHATTER}
    assert max(errors[manoeuvre][0] for manoeuvre in HELD_OUT) < 0.05


def test_the_airspeed_hold_follows_the_flown_airspeed_of_a_turn_entry() -> None:
    """On the airframe whose turns move it most: within a sixth of what the turn does, 0.1 m/s."""
    airframe = aircraft.folder("aerosonde")
    turn = of_airspeed(flown(airframe, 25.0, held([-15.0, 0.0], 10.0)))
    wrong = airspeed_change(identified(airframe, 25.0).hold, turn.input) - turn.output
    assert np.sqrt(np.mean(wrong**2)) < np.sqrt(np.mean(turn.output**2)) / 6.0


def test_an_identification_is_read_as_it_was_written(tmp_path: Path) -> None:
    airframe = copied_airframe("aerosonde", tmp_path / "aerosonde")
    one = identified(airframe, 25.0)
    other = replace(one, airspeed=20.0, heading_rate=response_of(np.array(astuple(KNOWN))))
    aircraft.identified(airframe).write_text(document(airframe, [one, other]), encoding="utf-8")
    assert read(airframe) == [other, one]


def test_the_command_identifies_draws_keeps_and_says_how_long_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The whole of `harness identify`, on a folder of the user's own: as `make identify` left the airframe itself."""
    airframe = copied_airframe("skywalker_x8", tmp_path / "skywalker_x8")
    aircraft.identified(airframe).write_text("damaged", encoding="utf-8")
    monkeypatch.setattr(_progress, "_EVERY", 0.0)  # a line after each part
    result = invoke("identify", airframe, "--keep", "--out", tmp_path / "plots")
    assert result.exit_code == 0, result.output
    told = [line for line in result.stderr.splitlines() if line.startswith("identifying skywalker_x8: ")]
    assert len(told) == 28  # 26 flights and two fits
    assert all(re.search(r": \d+ % done, \d+ (s|min) left$", line) for line in told)
    assert "100 % done" in told[-1]
    for words in ("63 %", "bandwidth", "turn ratio", "delay", "damping", "lagged  coordinated"):
        assert words in result.output
    assert sorted(path.name for path in (tmp_path / "plots").iterdir()) == [
        "skywalker_x8_bode.svg", "skywalker_x8_identified.toml", "skywalker_x8_step.svg",
    ]  # fmt: skip
    written = (tmp_path / "plots" / "skywalker_x8_identified.toml").read_bytes()
    assert written == aircraft.identified(airframe).read_bytes()
    (found,), (kept,) = read(airframe), read(aircraft.folder("skywalker_x8"))
    assert found.measured == pytest.approx(dict(kept.measured), rel=1e-3)
    for name, pair in kept.errors.items():
        assert found.errors[name] == pytest.approx(pair, abs=1e-3), name


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["ultra_stick"], 'AIRCRAFT: is "ultra_stick", must be one of aerosonde, skywalker_x8, ultra_stick_25e'),
        (
            ["aerosonde", "--airspeed", "5"],
            "--airspeed: no level trim at 5 m/s, 150 m high; aerosonde flies from 18 to 35 m/s",
        ),
        (["aerosonde", "--airspeed", "nan"], "--airspeed"),
        (["aerosonde", "--out", "/dev/null/x"], "cannot be written to"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(arguments: list[str], said: str, tmp_path: Path) -> None:
    before = aircraft.identified(aircraft.folder("aerosonde")).read_bytes()
    result = invoke("identify", "--out", tmp_path / "out", *arguments)
    assert result.exit_code == 2
    assert said in result.output
    assert aircraft.identified(aircraft.folder("aerosonde")).read_bytes() == before
