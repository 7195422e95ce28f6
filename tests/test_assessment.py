"""What a recorded flight says of the assumption, and what is refused: logs of the harness's own flights, and none."""

import json
import math
import shutil
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial
from pathlib import Path

import numpy as np
import pytest

import aircraft
import harness
from autopilot.response import plain
from benchmarks.blind_flights import BlindLog, blind_log
from benchmarks.blind_logs import SCALE, TURN, WIND, Gains, compared, gains_of
from harness.flight import Flight
from harness.key import flight_key
from harness.plants.identified import identified
from harness.plants.lagged import Lagged
from harness.plants.plant import Start
from harness.recorded.assessment import LATERAL, Assessment, assess
from harness.recorded.beside import beside
from harness.recorded.fitted_plant import document
from harness.recorded.following import BANK, HEADING_RATE, Commanded
from harness.recorded.panels import panels
from harness.recorded.part_finding import CANNOT
from harness.recorded.recorded_flight import Array, Basis, Channel, LogError, LoggedEvent, RecordedFlight, sampled
from harness.recorded.said import as_json, beside_lines, lines
from harness.verdict.parts import PARTS
from harness.vocabulary import Verdict
from harness.world.air import Air
from tests.builders import EXPERIMENTS, invoke, write

LEVEL, AIRSPEED, SIDESLIP = (
    PARTS[column].title for column in ("altitude_deviation_peak_m", "airspeed_deviation", "sideslip_rms_deg")
)
RELATION = PARTS["turn_ratio"].title
STILL = 3  # circles without turbulence: the turn relation holds
ON_BOARD = 5  # a log of circles, on board: a limit cycle that tells the response


@lru_cache(maxsize=8)
def log(seed: int) -> BlindLog:
    return blind_log(seed)


def without(flight: RecordedFlight, *names: str) -> RecordedFlight:
    return replace(flight, channels={n: c for n, c in flight.channels.items() if n not in names})


def every(flight: RecordedFlight, name: str, step: int) -> RecordedFlight:
    channel = flight[name]
    return flight.with_channel(name, replace(channel, time=channel.time[::step], values=channel.values[::step]))


def words(found: Assessment) -> set[str]:
    return {finding.word for finding in found.findings}


@pytest.mark.parametrize("seed", [1, ON_BOARD, 14], ids=["CSV", "DataFlash", "ULog"])
def test_what_is_hidden_in_a_log_is_recovered(seed: int) -> None:
    hidden = log(seed).hidden
    answer = compared(seed, hidden, assess(log(seed).recorded()))
    assert answer.signs_right
    assert [name for name, told in answer.told.items() if told.covered is False or told.wrong] == []
    assert {TURN, WIND, SCALE} <= {name for name, told in answer.told.items() if told.covered}


def test_another_way_round_of_bank_and_wind_is_found_and_said() -> None:
    flight = log(1).recorded()
    turned = flight.changed(np.negative, "bank", "bank_command", "wind_north", "wind_east")
    before, after = assess(flight), assess(turned)
    assert before[RELATION].value == pytest.approx(after[RELATION].value, rel=1e-9)
    said = [any(note.startswith("bank: the sign") for note in found.notes) for found in (before, after)]
    assert said[0] is not said[1]
    assert before.estimated
    assert after.estimated
    assert before.estimated.is_reversed is not after.estimated.is_reversed


def test_an_airspeed_scale_moves_the_scale_and_no_turn_relation() -> None:
    flight = log(2).recorded()
    scaled = flight.changed(lambda airspeed: airspeed / 1.07, "airspeed")
    before, after = assess(flight), assess(scaled)
    assert before[RELATION].value == pytest.approx(after[RELATION].value, rel=1e-6)
    assert before.wind
    assert after.wind
    assert before.wind.scale
    assert after.wind.scale
    assert after.wind.scale[0] == pytest.approx(1.07 * before.wind.scale[0], rel=1e-6)


@pytest.mark.parametrize(
    ("gone", "part", "reason"),
    [
        (("airspeed", "wind_north", "wind_east"), RELATION, "no airspeed and no wind"),
        (("airspeed",), AIRSPEED, "no measured airspeed"),
        (("bank",), RELATION, "the log has no bank"),
        (("velocity_north",), RELATION, "no velocity over the ground"),
        (("bank_command",), BANK.lag.title, "no bank command"),
        (("lateral_acceleration",), LATERAL.title, "no lateral specific force"),
        (("altitude",), LEVEL, "no altitude"),
        ((), SIDESLIP, "no vane"),
    ],
)
def test_what_the_log_lacks_is_refused_without_a_number(gone: tuple[str, ...], part: str, reason: str) -> None:
    finding = assess(without(log(1).recorded(), *gone))[part]
    assert finding.word == CANNOT
    assert reason in finding.reason
    assert math.isnan(finding.value)


def test_without_a_command_level_flight_can_hold_but_a_climb_is_no_failure_of_it() -> None:
    flight = without(log(1).recorded(), "altitude_command", "altitude_error")
    climbed = flight.changed(lambda altitude: 30.0 * np.sin(np.arange(len(altitude)) / 300.0), "altitude")
    still = flight.changed(lambda altitude: 0.01 * np.sin(np.arange(len(altitude))), "altitude")
    assert assess(still)[LEVEL].word == "holds"
    assert assess(climbed)[LEVEL].word == CANNOT
    assert math.isnan(assess(climbed)[LEVEL].value)


def test_a_sideslip_of_an_estimated_wind_is_circular_and_one_of_a_vane_is_judged() -> None:
    flight = log(1).recorded()
    time = flight["bank"].time
    angle = np.radians(1.0 + 0.2 * np.sin(7.0 * time))
    for basis, judged in ((Basis.ESTIMATED, False), (Basis.DERIVED, False), (Basis.MEASURED, True)):
        finding = assess(flight.with_channel("sideslip", sampled(time, angle, basis, "")))[SIDESLIP]
        assert (finding.word != CANNOT) is judged
        assert judged or "circular" in finding.reason


def test_numbers_that_no_aircraft_has_are_no_samples() -> None:
    time, values = np.arange(4.0), np.array([1.0, 1e300, -np.inf, 2.0])
    assert sampled(time, values, Basis.MEASURED, "").values.tolist() == [1.0, 2.0]


def test_channels_that_do_not_overlap_or_hold_next_to_nothing_are_refused_and_break_nothing() -> None:
    flight = log(1).recorded()

    def moved(*names: str) -> RecordedFlight:
        later = {name: replace(flight[name], time=flight[name].time + 1e4) for name in names}
        return replace(flight, channels={**flight.channels, **later})

    damaged = [
        *(
            moved(name)
            for name in (
                "airspeed",
                "wind_east",
                "velocity_east",
                "bank",
                "bank_command",
                "heading_rate_command",
                "yaw",
            )
        ),
        *(every(flight, name, 10**5) for name in ("bank", "airspeed", "velocity_north", "bank_command", "yaw")),
        flight.changed(np.zeros_like, "airspeed"),
    ]
    for each in damaged:
        assert [line for line in lines(assess(each, 0.0, 200.0)) if "nan" in line] == []


def test_too_few_turns_are_refused_with_the_number_that_is_needed() -> None:
    flight = log(1).recorded()
    finding = assess(flight, flight.begin, flight.begin + 30.0)[RELATION]
    assert finding.word == CANNOT
    assert "5 are needed" in finding.reason


def test_nothing_is_decided_in_a_wind_of_the_autopilot_whose_error_is_unknown() -> None:
    flight = log(STILL).recorded()
    north, east = log(STILL).hidden.wind
    known = {"wind_north": north, "wind_east": east}
    for name, value in known.items():
        flight = flight.changed(partial(np.full_like, fill_value=value), name)
    assert assess(flight)[RELATION].word == Verdict.HOLDS
    found = assess(without(flight, "airspeed"))[RELATION]
    assert found.word == Verdict.UNDECIDED
    assert "the wind is the autopilot's" in found.reason
    assert found.low < found.value < found.high


def test_after_a_failure_nothing_is_judged_and_before_it_all_that_is_before() -> None:
    flight = replace(log(1).recorded(), failure=LoggedEvent(60.0, "engine"))
    after = assess(flight, 70.0)
    assert words(after) == {CANNOT}
    assert all("after a failure at 60.0 s (engine)" in finding.reason for finding in after.findings)
    assert assess(flight).end == 60.0


def test_an_aircraft_on_the_ground_is_never_airborne() -> None:
    flight = log(1).recorded().changed(lambda v: 0.01 * v, "velocity_north", "velocity_east", "airspeed")
    found = assess(flight)
    assert words(found) == {CANNOT}
    assert all("never airborne" in finding.reason for finding in found.findings)


def test_a_bank_beyond_60_deg_is_no_turn() -> None:
    flight = log(1).recorded()
    steep = flight.changed(lambda bank: np.sign(bank) * math.radians(65.0), "bank")
    assert "beyond 60 deg" in assess(steep)[RELATION].reason


def test_a_clock_that_goes_back_is_refused() -> None:
    flight = log(1).recorded()
    bank = flight["bank"]
    time = np.where(bank.time > 50.0, bank.time - 20.0, bank.time)
    found = assess(flight.with_channel("bank", replace(bank, time=time)))
    assert words(found) == {CANNOT}
    assert all("goes back at" in finding.reason for finding in found.findings)


def test_a_wind_that_changes_has_not_settled() -> None:
    flight = log(2).recorded()
    track = flight["velocity_north"]
    later = track.time > 0.5 * (flight.begin + flight.end)
    moved = flight.with_channel("velocity_north", replace(track, values=track.values + 5.0 * later))
    assert "wind not settled" in assess(moved)[RELATION].reason


def test_a_lag_of_telemetry_is_a_bound_and_one_on_board_an_interval() -> None:
    logs = map(log, range(20))
    flight = next(each for each in logs if not each.hidden.of_receipt and each.hidden.lags[BANK.noun] > 0.1)
    on_board = flight.recorded()
    assert assess(on_board)[BANK.lag.title].word == Verdict.FAILS
    bound = assess(replace(on_board, of_receipt=True))[BANK.lag.title]
    assert bound.word == Verdict.UNDECIDED
    assert bound.low == 0.0
    assert "latency of the telemetry" in bound.reason


def test_a_command_at_rest_does_not_tell_the_lag() -> None:
    flight = log(1).recorded().changed(np.zeros_like, "bank_command")
    assert "not excited" in assess(flight)[BANK.lag.title].reason


def turned(rate: float, gain: float, drift: float) -> RecordedFlight:
    """A log of an aircraft that follows heading rates by a known response, with errors of both; and flies on board."""
    of, period = np.random.default_rng(7), 0.05
    plant = Lagged(RESPONSE).start(Start(heading=0.0, airspeed=15.0), Air())
    commands = np.repeat(of.uniform(-0.25, 0.25, 90), 40)  # rad/s, for 2 s each
    headings = [0.0]
    for command in commands.tolist():
        plant.advance(command, period)
        headings.append(headings[-1] + math.remainder(plant.state.heading - headings[-1], math.tau))
    time: Array = period * np.arange(len(headings), dtype=np.float64)
    seen = np.arange(0.0, time[-1], 1.0 / rate)
    yaw = gain * np.interp(seen, time, headings) + drift * seen + of.normal(0.0, math.radians(0.2), len(seen))
    channels = {
        "yaw": sampled(seen, yaw, Basis.ESTIMATED, ""),
        "airspeed": sampled(seen, 15.0 + of.normal(0.0, 0.1, len(seen)), Basis.MEASURED, ""),
        "heading_rate_command": Channel(time[:-1] + 0.5 * period, commands, Basis.COMMANDED, "", len(commands)),
    }
    return RecordedFlight(name="turned", sources=(), clock="", channels=channels)


RESPONSE = plain(0.15, 5.0, 0.7)


@pytest.mark.parametrize("gain", [1.0, 0.8])
@pytest.mark.parametrize("drift", [0.0, 0.02])
def test_how_a_commanded_heading_rate_is_followed_is_recovered(gain: float, drift: float) -> None:
    found = assess(turned(20.0, gain, drift))
    followed, late = found[HEADING_RATE.gain.title], found[HEADING_RATE.lag.title]
    assert followed.word == (Verdict.HOLDS if gain == 1.0 else Verdict.FAILS)
    assert followed.low - 0.005 <= gain <= followed.high + 0.005
    assert followed.high - followed.low < 0.05
    assert late.word == Verdict.FAILS
    assert late.low <= RESPONSE.lag <= late.high
    assert late.high - late.low < 0.1
    assert found[BANK.lag.title].reason == "the log has no bank"


@pytest.mark.parametrize("of", [BANK, HEADING_RATE], ids=["bank", "heading rate"])
def test_a_command_the_wrong_way_round_is_turned_and_said(of: Commanded) -> None:
    flight = log(STILL).recorded()
    right, found = assess(flight), assess(flight.changed(np.negative, of.command))
    assert right[of.lag.title].word == Verdict.FAILS
    assert [found[part.title] for part in (of.gain, of.lag)] == [right[part.title] for part in (of.gain, of.lag)]
    said = f"{of.noun} command: the sign is opposite to the {of.flown}'s; inverted"
    assert said in found.notes
    assert said not in right.notes


def test_the_page_shows_the_commanded_heading_rate_beside_that_of_the_yaw() -> None:
    found = assess(turned(20.0, 1.0, 0.0))
    (panel,) = (panel for panel in panels(found.flight, found) if panel.title == "Heading rate")
    assert panel.unit == "deg/s"
    commanded, flown = panel.lines
    assert np.abs(commanded.values).max() == pytest.approx(math.degrees(0.25), rel=0.05)
    settled = np.interp(commanded.time[35::40], flown.time, flown.values)  # before the next command
    assert settled == pytest.approx(commanded.values[35::40], abs=2.0)


def test_an_aircraft_that_only_heading_rates_tell_flies_on_lagged_alone(tmp_path: Path) -> None:
    file = write(tmp_path / "turned.toml", document(assess(turned(20.0, 1.0, 0.0))))
    assert identified(file, 15.0).heading_rate.lag == pytest.approx(RESPONSE.lag, abs=0.03)
    words = ("fly", "experiments/stationary.toml", "--set", f"aircraft={file}", "--set", "start.airspeed_mps=15")
    assert invoke(*words, "--set", "plant=lagged").exit_code == 0
    refused = invoke(*words, "--set", "plant=coordinated")
    assert refused.exit_code == 2
    assert "use lagged" in refused.output


def test_a_log_too_short_to_judge_is_one_sentence_and_a_longer_one_a_table() -> None:
    said = invoke("assess", "experiments/flights/lateral_doublet_4.csv").output
    assert "- airborne for 6.5 s at most; 10 s are needed: level flight" in said
    assert "circular" in said
    ground = log(2).recorded().changed(lambda v: 0.01 * v, "velocity_north", "velocity_east", "airspeed")
    assert next(lines(assess(ground))).startswith("The assumption cannot be judged from this log: never airborne")
    found = assess(log(2).recorded())
    table = "\n".join(lines(found))
    assert all(name in table for name in ("turn relation", "no vane", "wind, by the track"))
    json.dumps(as_json(found), allow_nan=False)


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The aircraft of a log, as a file."""
    file = tmp_path_factory.mktemp("fitted") / "my_flight.toml"
    file.write_text(document(assess(log(ON_BOARD).recorded())), encoding="utf-8")
    return file


def test_the_aircraft_of_a_log_flies_and_is_predicted_on_the_plants_that_were_fitted(fitted: Path) -> None:
    experiment = "experiments/stationary.toml"
    of_it = ["--set", f"aircraft={fitted}"]
    speed = ["--set", f"start.airspeed_mps={aircraft.limits(fitted).design_airspeed}"]
    for plant in ("lagged", "coordinated"):
        flown = invoke("fly", experiment, *of_it, *speed, "--set", f"plant={plant}")
        assert flown.exit_code == 0, flown.output
    told = invoke("predict", experiment, *of_it, *speed, "--set", "plant=lagged", "--json").stdout
    assert json.loads(told)["limit_cycle"] != "unknown"
    refused = invoke("fly", experiment, *of_it, *speed, "--set", "plant=sixdof")
    assert refused.exit_code == 2
    assert "it flies on lagged and coordinated" in refused.output
    elsewhere = invoke("fly", experiment, *of_it, "--set", "plant=lagged", "--set", "start.airspeed_mps=40")
    assert "was recorded at" in elsewhere.output


def test_the_gains_that_follow_end_the_limit_cycle_of_the_aircraft_that_wrote_the_log() -> None:
    flown = gains_of(log(ON_BOARD).flight, assess(log(ON_BOARD).recorded()))
    assert flown == Gains("", before=True, after=False)


def test_the_flight_of_a_fitted_aircraft_is_known_by_the_files_content_and_flown_again_from_the_store(
    fitted: Path, tmp_path: Path
) -> None:
    file = shutil.copy(fitted, tmp_path / "of_the_log.toml")
    speed = aircraft.limits(fitted).design_airspeed
    flight = Flight(
        plant="lagged",
        law=harness.law("nftsm", "fitted"),
        aircraft=str(file),
        duration=5.0,
        start=Start(airspeed=speed),
    )
    key = flight_key(flight)
    assert flight_key(replace(flight, aircraft=str(fitted))) != key  # another name
    experiment = write(
        tmp_path / "one.toml",
        f'title = "one"\n[flight]\nplant = "lagged"\naircraft = "of_the_log.toml"\nduration_s = 5.0\n'
        f'[flight.law]\nname = "nftsm"\ngains = "fitted"\n[flight.start]\nairspeed_mps = {speed}\n',
    )
    assert invoke("run", experiment, "--out", tmp_path / "run").exit_code == 0
    Path(file).write_text(
        fitted.read_text().replace("damping", "damping ", 1).replace("bank_limit = ", "bank_limit = 0")
    )
    again = invoke("fly", f"{tmp_path / 'run'}:{key[:8]}")
    assert again.exit_code == 0, again.output


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda flight: flight.changed(np.zeros_like, "bank_command"), "not excited"),
        (lambda flight: without(flight, "bank_command"), "neither a bank command"),
        (lambda flight: without(flight, "airspeed"), "no measured airspeed"),
        (lambda flight: every(flight, "bank", 8), "too few samples"),
    ],
)
def test_no_aircraft_is_fitted_to_a_log_that_does_not_tell_it(
    change: Callable[[RecordedFlight], RecordedFlight], reason: str
) -> None:
    with pytest.raises(LogError, match=reason):
        document(assess(change(log(ON_BOARD).recorded())))


def test_a_fit_that_is_refused_costs_neither_page_nor_tables(tmp_path: Path) -> None:
    short = EXPERIMENTS / "flights" / "lateral_doublet_4.csv"
    done = invoke("assess", short, "--fit", tmp_path / "a.toml", "--out", tmp_path / "page.html")
    assert done.exit_code == 2
    assert "turn relation" in done.stdout
    assert (tmp_path / "page.html").is_file()
    assert not (tmp_path / "a.toml").exists()


def test_fit_replaces_no_file_but_its_own(fitted: Path, tmp_path: Path) -> None:
    short, law = EXPERIMENTS / "flights" / "lateral_doublet_4.csv", write(tmp_path / "law.py", "x = 1\n")
    kept = write(tmp_path / "kept.toml", "[flight]\n")
    for words, why in (
        (("--fit", law), "must end with .toml"),
        (("--fit", kept), "exists and is not a file of --fit"),
        (("--fit", tmp_path / "a.toml", "--out", tmp_path / "a.toml"), "must be different files"),
    ):
        done = invoke("assess", short, *words)
        assert (done.exit_code, why in done.stderr) == (2, True), done.output
    assert (law.read_text(), kept.read_text()) == ("x = 1\n", "[flight]\n")
    again = invoke("assess", short, "--fit", shutil.copy(fitted, tmp_path / "again.toml"))
    assert "no aircraft can be fitted" in again.stderr


def test_beside_a_flight_of_the_model_itself_the_model_says_the_same() -> None:
    found = assess(log(ON_BOARD).recorded())
    model = beside(found, aircraft.folder(log(ON_BOARD).flight.aircraft))
    assert model.ended == ""
    assert model.assessment[RELATION].value == pytest.approx(found[RELATION].value, abs=0.01)
    assert model.assessment[LATERAL.title].value == pytest.approx(found[LATERAL.title].value, abs=0.02)
    table = "\n".join(beside_lines(found, model))
    assert "turn relation" in table


def test_no_model_flies_beside_a_log_that_does_not_tell_how(fitted: Path) -> None:
    found = assess(log(ON_BOARD).recorded())
    with pytest.raises(LogError, match="flies from"):
        beside(found, aircraft.folder("aerosonde"))
    with pytest.raises(LogError, match="was fitted to a flight"):
        beside(found, fitted)
    short = invoke("assess", "experiments/flights/lateral_doublet_4.csv", "--airframe", "skywalker_x8")
    assert short.exit_code == 2
    assert "it gives no bank and wind" in str(short.exception) + short.output
