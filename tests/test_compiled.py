"""Compiled flights: the same bits as Python's, the reasons for which a flight is left to Python, and the choice."""

import math
import os
import random
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from autopilot.laws import law
from harness import loop
from harness.compiled import engine
from harness.compiled import kernel as kernels
from harness.flight import Flight, MetricSettings
from harness.flight_errors import Errors
from harness.log import FlightLog
from harness.plants.plant import Outcome, Start
from harness.world.target import Segment, Target
from harness.world.wind import Gust, Wind
from tests.builders import EXPERIMENTS, FLIGHT, OwnLaw, copied_airframe, invoke, turning, write

# (plant, law, direction, airspeed, limited quantity): each is compiled once, which takes some seconds
KINDS = (
    ("kinematic", "nftsm", "paper", "ground"),
    ("kinematic", "orbit_field", "paper", "nominal"),
    ("kinematic", "npfg", "mirrored", "measured"),
    ("lagged", "nftsm", "paper", "ground"),
    ("coordinated", "smc", "mirrored", "ground"),
    ("kinematic", "nftsm_lead", "mirrored", "ground"),
    ("kinematic", "lq_orbit", "paper", "nominal"),
    ("lagged", "nftsm_lead", "paper", "ground"),
    ("lagged", "lq_orbit", "mirrored", "ground"),
    ("coordinated", "nftsm_lead", "mirrored", "measured"),
    ("coordinated", "lq_orbit", "paper", "ground"),
)
SIXDOF = (("sixdof", "lq_orbit", "mirrored", "ground"), ("sixdof", "nftsm_lead", "paper", "ground"))
AIRSPEEDS = {"ultra_stick_25e": 13.0, "skywalker_x8": 13.0, "aerosonde": 25.0}


def anywhere(seed: int, kind: tuple[str, str, str, str]) -> Flight:
    """A random flight of a kind: gains, start, wind, gusts, target, period, errors of what is known."""
    draw = random.Random(seed)
    plant, name, direction, airspeed = kind
    aircraft = draw.choice(list(AIRSPEEDS))
    v_a = AIRSPEEDS[aircraft]
    gains: dict[str, Any] = {"k2": draw.uniform(0.5, 15.0), "k3": draw.uniform(0.0, 8.0)} if name == "nftsm" else {}
    own = law(
        name, standoff=draw.uniform(80.0, 400.0), max_heading_rate=math.radians(draw.uniform(3.0, 20.0)),
        direction=direction, airspeed=airspeed, command=draw.choice(["heading_rate", "course_rate"]), **gains,
    )  # fmt: skip
    wind = Wind(steady=(draw.uniform(-5.0, 5.0), draw.uniform(-5.0, 5.0))) if draw.random() < 0.7 else Wind()
    if draw.random() < 0.2:
        wind = replace(wind, gusts=(Gust(from_=1.0, to=5.0, velocity=(2.0, -3.0, 1.0)),))
    if draw.random() < 0.1:
        wind = replace(wind, turbulence="moderate")
    target = Target(position=(draw.uniform(-50.0, 50.0), draw.uniform(-50.0, 50.0)))
    if draw.random() < 0.4:
        segment = Segment(from_=2.0, to=8.0, acceleration=draw.uniform(0.0, 0.3), turn_rate=draw.uniform(-0.1, 0.1))
        target = replace(target, speed=draw.uniform(0.0, 4.0), heading=draw.uniform(-3.0, 3.0), segments=(segment,))
    late = draw.choice([0.0, 0.0, 0.05, 0.1, 0.12, 0.5])  # whole periods, and parts of one
    noise = draw.choice([0.0, 0.01])
    errors = Errors(wind=draw.choice([0.0, 0.5]), course_noise=noise, airspeed_scale=1.0, command_delay=late)
    estimator = replace(FLIGHT.estimator, turn_rate=draw.choice(["known", "unknown"]))
    position = (draw.uniform(-600.0, 600.0), draw.uniform(-600.0, 600.0))
    estimator = replace(estimator, kind="ekf" if seed % 5 == 4 else "truth")
    return Flight(
        plant=plant, law=own, aircraft=aircraft, duration=draw.choice([5.0, 10.0, 20.0]), seed=seed,
        guidance_period=draw.choice([0.05, 0.1, 0.25]), wind=wind, target=target, errors=errors, estimator=estimator,
        start=Start(position=position, heading=draw.uniform(-3.1, 3.1), airspeed=v_a),
        metrics=MetricSettings(monitoring_range=draw.choice([None, None, 700.0])),
    )  # fmt: skip


def compiled(flight: Flight) -> FlightLog:
    """The flight by a kernel: not once by Python."""
    return engine._trusted(flight, None)


def test_500_random_flights_have_the_same_digests_and_tables_compiled_as_in_python() -> None:
    outcomes = set()
    for seed in range(500):
        flight = anywhere(seed, KINDS[seed % len(KINDS)])
        plain, quick = loop.simulate(flight), compiled(flight)
        assert quick.digest == plain.digest, flight
        assert quick.reason == plain.reason
        assert np.array_equal(quick.table, plain.table, equal_nan=True), flight
        outcomes.add(plain.outcome)
    assert outcomes >= {Outcome.COMPLETED, Outcome.TARGET_LOST}


def test_flights_on_sixdof_by_compiled_steps_have_the_tables_of_python_however_they_end() -> None:
    outcomes, stalled = set(), 0
    for seed in range(60):
        kind = KINDS[0] if seed < 40 else SIXDOF[seed % len(SIXDOF)]
        flight, draw = anywhere(seed, kind), random.Random(seed)
        gust = Gust(from_=1.0, to=4.0, velocity=(0.0, 10.0, draw.choice([0.0, 12.0, 25.0])))  # some stall
        flight = replace(
            flight, plant="sixdof", aircraft="ultra_stick_25e",
            wind=replace(flight.wind, gusts=(gust,), turbulence=draw.choice(["none", "moderate"])),
            start=replace(flight.start, airspeed=13.0, altitude=draw.choice([40.0, 120.0])),
            estimator=replace(flight.estimator, kind=draw.choice(["truth", "ekf"])),
        )  # fmt: skip
        plain, quick = loop.simulate(flight), compiled(flight)
        assert (quick.digest, quick.reason) == (plain.digest, plain.reason), flight
        assert np.array_equal(quick.table, plain.table, equal_nan=True), flight
        outcomes.add((plain.outcome, flight.errors.command_delay == 0.12))
        stalled += plain.outcome is Outcome.COMPLETED and bool((plain["angle_of_attack"] > 0.5).any())
    assert outcomes >= {(Outcome.TARGET_LOST, False), (Outcome.GROUND, False)}
    assert outcomes >= {(how, late) for how in (Outcome.COMPLETED, Outcome.DEPARTED) for late in (False, True)}
    assert stalled


def test_estimates_are_made_once_for_flights_of_all_laws_and_plants_and_anew_for_another_seed() -> None:
    flight = replace(FLIGHT, duration=2.0, estimator=replace(FLIGHT.estimator, kind="ekf"), seed=12345)
    before = engine._estimated.cache_info().misses
    for plant in ("kinematic", "lagged"):
        for name in ("nftsm", "orbit_field"):
            one = replace(flight, plant=plant, law=law(name))
            assert compiled(one).digest == loop.simulate(one).digest
    assert engine._estimated.cache_info().misses == before + 1
    other = replace(flight, seed=54321)
    assert compiled(other).digest == loop.simulate(other).digest
    assert engine._estimated.cache_info().misses == before + 2


@pytest.mark.parametrize("kind", ["truth", "ekf"])
def test_a_track_that_has_changed_on_the_disk_is_flown_as_it_is_now(tmp_path: Path, kind: str) -> None:
    track, digests = tmp_path / "track.csv", set()
    target, estimator = Target(track=str(track)), replace(FLIGHT.estimator, kind=kind)
    flight = replace(FLIGHT, duration=2.0, target=target, estimator=estimator)
    for north in (10.0, 30.0):
        track.write_text(f"time_s,north_m,east_m\n0,0,0\n1,{north},0\n2,{north},5\n3,0,9\n")
        digests.add(compiled(flight).digest)
        assert compiled(flight).digest == loop.simulate(flight).digest
    assert len(digests) == 2


def test_a_flight_by_compiled_steps_is_watched_row_by_row() -> None:
    flight = replace(FLIGHT, plant="sixdof", duration=1.0)
    rows: list[tuple[float, int]] = []
    engine._trusted(flight, lambda time, so_far: rows.append((time, len(so_far()))))
    assert rows == [(k * flight.guidance_period, k + 1) for k in range(flight.periods + 1)]


def test_the_parent_of_a_run_flies_no_model_of_somebody_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(flight: Flight) -> str:
        raise AssertionError("flown in the parent")

    monkeypatch.setattr("harness.runs.engine.why_plain", refused)
    mine = copied_airframe("ultra_stick_25e", tmp_path / "mine")
    settings = ("--set", "plant=sixdof", "--set", "duration_s=1", "--set", f"aircraft={mine}", "--set", "law.k2=[2,3]")
    words = ("--out", tmp_path / "out", "--log", "none", "--engine", "compiled", *settings)
    assert "2 flown, 0 earlier, 0 failed" in invoke("run", EXPERIMENTS / "stationary.toml", *words).output


def test_kernels_that_were_not_used_for_long_give_way_to_new_ones(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for number in range(5):
        (tmp_path / f"kernel_{number}.py").touch()
        os.utime(tmp_path / f"kernel_{number}.py", (2e9 + number, 0.0))
    kernels._clear(tmp_path)
    assert len(list(tmp_path.iterdir())) == 5
    monkeypatch.setattr(kernels, "_KEPT", 2)
    kernels._clear(tmp_path)
    assert len(list(tmp_path.iterdir())) == 5  # another process may be about to load them
    monkeypatch.setattr(kernels, "_YOUNG", -1e9)
    kernels._clear(tmp_path)
    assert {file.name for file in tmp_path.iterdir()} == {"kernel_3.py", "kernel_4.py"}


def test_a_watched_flight_tells_its_time_before_and_after_its_blocks_of_rows() -> None:
    times: list[float] = []
    engine._trusted(FLIGHT, lambda time, so_far: times.append(time))
    assert times == [0.0, FLIGHT.duration]


def test_a_law_whose_numbers_differ_compiled_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "_TRUSTED", set())
    draws = random.Random(1)
    flight = replace(FLIGHT, law=OwnLaw(lambda: lambda o: turning(draws.random())))
    assert engine.why_plain(flight)
    assert engine.simulate(flight).outcome is Outcome.COMPLETED


def test_kernels_go_to_the_temporary_files_where_the_cache_cannot_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from harness.compiled import kernel

    write(tmp_path / "file", "")
    monkeypatch.setenv(kernel.FOLDER, str(tmp_path / "file" / "cache"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    found = kernel.folder.__wrapped__()
    assert found.parent == tmp_path
    assert found.stat().st_mode & 0o77 == 0


def test_a_flight_is_flown_by_python_where_no_kernel_can_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from harness.compiled import kernel

    nowhere = write(tmp_path / "file", "") / "cache"
    monkeypatch.setenv(kernel.FOLDER, str(nowhere))
    monkeypatch.setattr("tempfile.tempdir", str(nowhere))
    monkeypatch.setattr(kernel, "folder", kernel.folder.__wrapped__)
    monkeypatch.setattr(kernel, "_KERNELS", {})
    assert engine.why_plain(FLIGHT).startswith("no kernel can be made: NotADirectoryError")
    assert engine.simulate(FLIGHT).digest == loop.simulate(FLIGHT).digest


@pytest.mark.parametrize(
    "words",
    [("falsify", "--requirement", "range_error_peak_m<5"), ("tune", "--minimise", "range_error_peak_m")],
)
def test_a_search_finds_the_same_with_either_engine(tmp_path: Path, words: tuple[str, ...]) -> None:
    name, *options = words
    found = []
    for kind in ("python", "compiled"):
        settings = ("--set", "plant=kinematic", "--set", "duration_s=10", "--workers", 0, "--engine", kind)
        searched = ("--over", "law.k2=1:9", "--flights", 12, *options)
        ran = invoke(name, EXPERIMENTS / "stationary.toml", "--out", tmp_path / kind, *settings, *searched)
        assert ", 0 failed" in ran.output
        found.append((tmp_path / kind / "trials.csv").read_text())
    assert found[0] == found[1]
