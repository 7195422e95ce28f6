"""The plants between the kinematic and the 6-DOF one: closed forms, and each the one below it in the limit."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import aircraft
from autopilot.laws import law
from autopilot.response import Response, plain
from harness.checks import problems
from harness.feasibility import warnings
from harness.flight import Flight, plant_of
from harness.key import flight_key
from harness.log.metric import measure
from harness.loop import simulate
from harness.plants.coordinated import AirspeedHold, Coordinated
from harness.plants.identified import identified
from harness.plants.kinematic import Kinematic
from harness.plants.lagged import Lagged
from harness.plants.plant import Flying, Plant, Start
from harness.world.air import Air
from tests.builders import copied_airframe

START = Start(position=(5.0, -7.0), heading=0.3, airspeed=13.0)
STILL = Air()
NO_CHANGE = AirspeedHold(gain=0.0, frequency=1.0, damping=1.0)
WHOLE = Response(
    delay=0.022, frequency=9.0, damping=0.8, lead=0.02, sideslip_frequency=2.6, sideslip_damping=0.33,
    zero_frequency=2.85, zero_damping=0.27, tail_rate=0.3, tail_share=0.06,
)  # fmt: skip


def zigzag(plant: Plant, period: float = 0.05, duration: float = 100.0, air: Air = STILL) -> Flying:
    """Turns to both sides, each command a whole number of half seconds long."""
    flying = plant.start(START, air)
    for k in range(round(duration / period)):
        flying.advance(0.2 * math.copysign(1.0, math.sin(3.0 * math.floor(k * period / 0.5 + 1e-9))), period)
    return flying


def apart(a: Flying, b: Flying) -> float:
    return math.dist(a.state[:2], b.state[:2])


@settings(deadline=None, max_examples=40)
@given(
    delay=st.floats(0.0, 0.2), frequency=st.floats(2.0, 20.0), damping=st.floats(0.2, 0.95), periods=st.integers(1, 60)
)
def test_a_step_is_answered_by_the_delayed_second_order_step_response(
    delay: float, frequency: float, damping: float, periods: int
) -> None:
    flying = Lagged(plain(delay, frequency, damping)).start(START, STILL)
    for _ in range(periods):
        flying.advance(0.1, 0.05)
    t = 0.05 * periods - round(delay * 1e9) / 1e9
    w = frequency * math.sqrt(1.0 - damping**2)
    swing = math.cos(w * t) + damping * frequency / w * math.sin(w * t)
    share = 1.0 - math.exp(-damping * frequency * t) * swing if t > 0.0 else 0.0
    assert flying.state.heading_rate == pytest.approx(0.1 * share, abs=1e-12)


def test_a_first_order_lag_trails_the_ramp_by_its_time_constant() -> None:
    """All of the response in the slow end, the rest too fast to see: heading = rate (t - tau (1 - exp(-t / tau)))."""
    flying = Lagged(replace(plain(0.0, 1e6, 1.0), tail_rate=2.0, tail_share=1.0)).start(START, STILL)
    for k in range(1, 41):
        flying.advance(0.1, 0.05)
        t = 0.05 * k
        turned = 0.1 * (t - 0.5 * (1.0 - math.exp(-t / 0.5)))
        assert flying.state.heading == pytest.approx(START.heading + turned, abs=1e-6)


def test_nothing_happens_before_the_delay() -> None:
    flying = Lagged(plain(0.12, 8.0, 0.8)).start(START, STILL)
    for _ in range(12):
        flying.advance(0.3, 0.01)
    assert flying.state.heading == START.heading
    flying.advance(0.3, 0.01)
    assert flying.state.heading > START.heading


@pytest.mark.parametrize("plant", [Lagged(WHOLE), Coordinated(WHOLE, replace(NO_CHANGE, gain=-0.5), 0.8)])
def test_a_command_in_pieces_flies_as_the_command_whole(plant: Plant) -> None:
    """To 1e-8 m after 400 m: the bound of the quadrature of the position, five and twenty times finer in the pieces."""
    coarse, fine, finest = (zigzag(plant, period, 30.0) for period in (0.05, 0.01, 0.0025))
    assert apart(coarse, finest) < 1e-8
    assert apart(fine, finest) < 1e-9
    assert coarse.state.heading == pytest.approx(finest.state.heading, abs=1e-10)


@pytest.mark.parametrize(
    "plant_with",
    [lambda w: Lagged(plain(1.0 / w, w, 0.8)), lambda w: Coordinated(plain(1.0 / w, w, 0.8), NO_CHANGE, 0.8)],
)
def test_without_lag_and_delay_it_is_the_kinematic_plant(plant_with: Callable[[float], Plant]) -> None:
    kinematic = zigzag(Kinematic())
    slow, quick, quickest = (apart(zigzag(plant_with(w)), kinematic) for w in (50.0, 1e3, 1e5))
    assert 1e-3 < slow < 0.1
    assert quick < 1e-4
    assert quickest < 1e-7


@pytest.mark.parametrize("plant", [Kinematic(), Lagged(WHOLE), Coordinated(WHOLE, NO_CHANGE, 0.8)])
def test_the_air_carries_every_level_plant_alike(plant: Plant) -> None:
    gusts = np.cumsum(np.full((401, 3), 0.01), axis=0)
    still, moved = zigzag(plant, 0.05, 20.0), zigzag(plant, 0.05, 20.0, Air(steady=(1.5, -2.5), step=0.05, gusts=gusts))
    drift = float(np.trapezoid(gusts[:, 0], dx=0.05))
    assert moved.state.north - still.state.north == pytest.approx(1.5 * 20.0 + drift)
    assert moved.state.east - still.state.east == pytest.approx(-2.5 * 20.0 + drift)
    assert moved.state.velocity_north - still.state.velocity_north == pytest.approx(1.5 + gusts[-1, 0])


def test_turn_rate_is_g_tan_bank_over_airspeed() -> None:
    flying = Coordinated(WHOLE, replace(NO_CHANGE, gain=-2.0), 0.8).start(START, STILL)
    for _ in range(60):
        flying.advance(0.4, 0.05)
        state = flying.state
        assert state.heading_rate == pytest.approx(9.80665 * math.tan(state.bank) / state.airspeed)
    assert state.airspeed < 12.97


def test_the_bank_is_limited_at_the_inner_loops_limit() -> None:
    flying = Coordinated(plain(0.0, 8.0, 1.0), NO_CHANGE, 0.8).start(START, STILL)
    for _ in range(100):
        flying.advance(3.0, 0.05)
    assert flying.state.bank_command == 0.8
    assert flying.state.bank == pytest.approx(0.8)


def test_a_turn_entry_moves_the_airspeed_as_the_hold_lets_it() -> None:
    """The bank at once: v = gain e exp(-d w t) sin(w' t) / w', e = 1/cos(bank) - 1."""
    hold = AirspeedHold(gain=-0.4, frequency=0.8, damping=0.6)
    flying = Coordinated(plain(0.0, 1e6, 1.0), hold, 0.8).start(START, STILL)
    excess = math.hypot(1.0, 13.0 * 0.3 / 9.80665) - 1.0
    w = 0.8 * math.sqrt(1.0 - 0.6**2)
    for k in range(1, 100):
        flying.advance(0.3, 0.05)
        t = 0.05 * k
        change = -0.4 * excess * math.exp(-0.6 * 0.8 * t) * math.sin(w * t) / w
        assert flying.state.airspeed - 13.0 == pytest.approx(change, abs=1e-6)


FLIGHT = Flight(plant="lagged", law=law("nftsm", "paper_1"), duration=40.0)


def test_each_rung_has_the_metrics_of_what_it_has() -> None:
    lagged, coordinated = (measure(simulate(replace(FLIGHT, plant=plant))) for plant in ("lagged", "coordinated"))
    assert lagged["heading_rate_gain"] == pytest.approx(1.0, abs=0.05)
    assert lagged["heading_rate_lag_s"] == pytest.approx(0.2, abs=0.1)
    assert lagged["turn_ratio"] is lagged["bank_peak_deg"] is lagged["sideslip_peak_deg"] is None
    assert coordinated["turn_ratio"] == pytest.approx(1.0)
    assert coordinated["bank_peak_deg"] is not None
    assert coordinated["sideslip_peak_deg"] is None


@pytest.fixture
def copied(tmp_path: Path) -> Path:
    return copied_airframe("ultra_stick_25e", tmp_path / "ultra_stick_25e")


def test_what_was_identified_counts_in_the_key(copied: Path) -> None:
    flights = [replace(FLIGHT, aircraft=str(copied), plant=plant) for plant in ("kinematic", "lagged", "coordinated")]
    before = [flight_key(flight) for flight in flights]
    file = aircraft.identified(copied)
    file.write_text(file.read_text(encoding="utf-8").replace("frequency = ", "frequency = 1", 1), encoding="utf-8")
    assert [flight_key(flight) == key for flight, key in zip(flights, before, strict=True)] == [True, False, False]


def test_an_airspeed_or_airframe_not_identified_is_named_with_what_to_do(copied: Path) -> None:
    (fast,) = problems(replace(FLIGHT, start=Start(airspeed=17.0)))
    assert fast.name == "start.airspeed"
    assert "run harness identify ultra_stick_25e --airspeed 17" in fast.message
    aircraft.identified(copied).unlink()
    (unknown,) = problems(replace(FLIGHT, aircraft=str(copied)))
    assert f"run harness identify {copied} --airspeed 13" in unknown.message
    assert problems(replace(FLIGHT, aircraft=str(copied), plant="kinematic")) == []


def test_a_damaged_identification_is_one_line(copied: Path) -> None:
    for text in ("at = 3", "not toml", "[[at]]\nairspeed = 13", "\udcff"):
        aircraft.identified(copied).write_bytes(text.encode("utf-8", "surrogateescape"))
        (problem,) = problems(replace(FLIGHT, aircraft=str(copied)))
        assert "identified.toml: is damaged" in problem.message
        assert "\n" not in problem.message


def test_a_changed_model_is_a_warning(copied: Path) -> None:
    flight = replace(FLIGHT, aircraft=str(copied), law=law("smc"))
    assert warnings(flight) == []
    with aircraft.model(copied).open("a", encoding="utf-8") as model:
        model.write("<!-- changed -->")
    assert ["has changed since it was identified" in said for said in warnings(flight)] == [True]


def test_the_plants_fly_by_the_file_beside_the_airframe() -> None:
    one = identified(aircraft.folder("aerosonde"), 25.2)
    flight = replace(FLIGHT, aircraft="aerosonde", start=Start(airspeed=25.2))
    assert plant_of(flight) == Lagged(one.heading_rate)
    assert one.bank
    assert plant_of(replace(flight, plant="coordinated")) == Coordinated(one.bank, one.hold, one.bank_limit)
