"""Compiled flights: the same bits as Python's, the reasons for which a flight is left to Python, and the choice."""

import ast
import math
import os
import random
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import harness
from autopilot.guidance import UNKNOWN, Guidance, Observation, Remembering, started
from autopilot.laws import law
from autopilot.response import dot
from autopilot.standoff import mirrored
from harness import loop
from harness.compiled import arithmetic, engine
from harness.compiled import kernel as kernels
from harness.compiled.closure import NotLiftedError, held
from harness.compiled.lifted import module_of
from harness.compiled.variables import mixed, unbound
from harness.flight import Flight, MetricSettings
from harness.flight_errors import Errors
from harness.log import FlightLog
from harness.plants.plant import Outcome, Start
from harness.world.target import Segment, Target
from harness.world.wind import Gust, Wind
from tests.builders import EXPERIMENTS, FLIGHT, OwnLaw, copied_airframe, digests, invoke, turning, write

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


TWO = ("atan2", "copysign", "remainder", "fmod", "hypot", "power")
ONE = ("sin", "cos", "tan", "asin", "atan", "exp", "log", "log1p", "sqrt", "radians")


@pytest.mark.parametrize("name", [*ONE, *TWO])
def test_compiled_arithmetic_has_the_bits_of_python_and_raises_where_python_does(name: str) -> None:
    draw = random.Random(name)
    python: Callable[..., Any] = pow if name == "power" else getattr(math, name)

    def number() -> float:
        return draw.choice([1.0, -1.0, 0.0]) * math.exp(draw.uniform(-14.0, 14.0))

    def outcome(function: Callable[..., Any], *arguments: float) -> object:
        try:
            made = function(*arguments)
        except (ValueError, ArithmeticError):
            return "raises"
        return "raises" if isinstance(made, complex) else made

    for _ in range(5000):
        arguments = [number() for _ in range(2 if name in TWO else 1)]
        if name == "power" and draw.random() < 0.5:
            arguments[1] = 2.0  # which a compiler knows as a product
        made = outcome(getattr(arithmetic, name), *arguments)
        assert made == outcome(python, *arguments), arguments
    others = () if name in ("remainder", "fmod") else (math.inf, -math.inf, math.nan)  # those are left to Python
    for special in product((0.0, -0.0, 1.0, -1.0, *others), repeat=len(arguments)):
        made, of_python = (outcome(function, *special) for function in (getattr(arithmetic, name), python))
        assert made == of_python or (made != made and of_python != of_python), special


def test_compiled_sums_have_the_bits_of_python() -> None:
    draw = random.Random(0)
    for _ in range(2000):
        row, values = ([draw.choice([-1.0, 1.0]) * math.exp(draw.uniform(-9.0, 9.0)) for _ in range(9)] for _ in "ab")
        assert arithmetic.added(np.array(values)) == sum(values)
        assert arithmetic.dot(np.array(row), np.array(values)) == dot(row, values)


OWN = '''
from dataclasses import dataclass
from math import hypot

from autopilot.guidance import Guidance, telling


@dataclass(frozen=True)
class Own:
    """Turns left when it is too far from the target."""

    standoff: float = 200.0
    max_heading_rate: float = 0.1
    command = "heading_rate"
    gain: float = 0.001
    broken: bool = False

    def start(self):
        turns = 0

        def step(o):
            {memory}
            r = hypot(o.north - o.target_north, o.east - o.target_east) - self.standoff
            if self.broken and o.time > 1.0:
                raise ValueError("it is broken")
            rate = max(-self.max_heading_rate, min(self.max_heading_rate, -self.gain * r))
            return telling(Guidance(rate, r, 0, 0, 0, rate), far=abs(r))

        return step

    def broken_conditions(self, speed_ratio):
        return []
'''
MATRIX = """
[flight]
plant = "kinematic"
duration_s = 20.0
law.name = "own.py:Own"
[matrix]
"law.gain" = [0.001, 0.002]
"law.broken" = [false, true]
"""


def own(folder: Path, memory: str = "") -> Path:
    """A matrix of flights of a law of one's own."""
    write(folder / "own.py", OWN.replace("{memory}", memory))
    return write(folder / "own.toml", MATRIX)


def test_both_engines_make_the_same_rows_with_a_law_of_ones_own_whatever_it_raises(tmp_path: Path) -> None:
    tables, file = [], own(tmp_path, "sides = [-1.0, 1.0]; turns = sides[0]")
    for name in ("python", "compiled"):
        ran = invoke("run", file, "--out", tmp_path / name, "--workers", 2, "--log", "none", "--engine", name)
        assert "4 flown, 0 earlier, 2 failed" in ran.output
        tables.append(harness.load_results(tmp_path / name).set_index("key").drop(columns="seconds").sort_index())
    assert tables[0].equals(tables[1])
    assert {"", "the law raised ValueError: it is broken"} == set(tables[0]["reason"])
    flight = replace(FLIGHT, law=harness.law(f"{tmp_path / 'own.py'}:Own"))
    assert np.array_equal(compiled(flight)["law_far"], loop.simulate(flight)["law_far"])


def test_a_flight_that_cannot_be_compiled_is_refused_where_that_is_asked(tmp_path: Path) -> None:
    file = own(tmp_path, "nonlocal turns; turns += 1")
    ran = invoke("run", file, "--out", tmp_path / "out", "--engine", "compiled")
    assert ran.exit_code == 2
    why = "on kinematic: step: it keeps a variable from one call to the next"
    assert why in ran.output.splitlines()[-1], ran.output


def remembering(after: Callable[[Any], Any], memory: Any) -> Flight:
    """A flight of a law that turns the faster the more it has answered; `after` makes of its memory the next one."""

    def step(o: Observation, memory: Any) -> tuple[Guidance, Any]:
        return turning(1e-4 * memory[0]), after(memory)

    return replace(FLIGHT, law=OwnLaw(lambda: Remembering(step, memory)))


@pytest.mark.parametrize(
    ("after", "memory"),
    [
        (lambda memory: (memory[0] + 1.0,), (0.0,)),
        (lambda memory: (memory[0] + 1, not memory[1]), (0, False)),
        (lambda memory: (sum(memory[1]), (*memory[1][1:], memory[0] + 0.1)), (0.3, (0.1, 0.7))),
    ],
)
def test_a_law_that_declares_its_memory_flies_compiled_as_in_python(after: Any, memory: Any) -> None:
    flight = remembering(after, memory)
    for flown in (flight, replace(flight, law=OwnLaw(lambda: mirrored(flight.law.start(UNKNOWN))))):
        plain, watched = (
            loop.simulate(flown),
            engine._trusted(flown, lambda time, so_far: None),
        )  # in two blocks of rows
        for quick in (compiled(flown), watched):
            assert np.array_equal(quick.table, plain.table, equal_nan=True)
        assert abs(plain["heading_rate_command"][-1]) > 0.0


@pytest.mark.parametrize(
    ("after", "memory", "why"),
    [
        (lambda memory: memory, (1.0, [1.0]), "its memory holds list"),
        (lambda memory: memory, (1.0, None), "its memory holds NoneType"),
        (lambda memory: (*memory, 1.0), (1.0,), "Numba does not compile it"),
    ],
)
def test_a_memory_of_other_things_or_of_growing_length_is_flown_by_python(after: Any, memory: Any, why: str) -> None:
    flight = remembering(after, memory)
    assert engine.why_plain(flight).startswith(why)
    assert engine.simulate(flight).digest == loop.simulate(flight).digest


def test_the_parent_of_a_run_flies_no_model_of_somebody_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(flight: Flight) -> str:
        raise AssertionError("flown in the parent")

    monkeypatch.setattr("harness.runs.engine.why_plain", refused)
    mine = copied_airframe("ultra_stick_25e", tmp_path / "mine")
    settings = ("--set", "plant=sixdof", "--set", "duration_s=1", "--set", f"aircraft={mine}", "--set", "law.k2=[2,3]")
    words = ("--out", tmp_path / "out", "--log", "none", "--engine", "compiled", *settings)
    assert "2 flown, 0 earlier, 0 failed" in invoke("run", EXPERIMENTS / "stationary.toml", *words).output


def test_a_law_that_keeps_a_variable_is_flown_by_python_which_is_said_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("harness.runs.engine.WORTH", 0.0)
    file = own(tmp_path, "nonlocal turns; turns += 1")
    ran = invoke("run", file, "--out", tmp_path / "out", "--workers", 0, "--log", "none", "--set", "law.broken=false")
    assert ran.exit_code == 0, ran.output
    assert ran.output.count("it keeps a variable from one call to the next") == 1


def test_a_short_run_and_an_installation_without_numba_are_flown_by_python(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(flight: Flight, watch: object) -> FlightLog:
        raise AssertionError("compiled")

    monkeypatch.setattr(engine, "_trusted", refused)
    assert invoke("run", own(tmp_path), "--out", tmp_path / "short", "--workers", 0, "--log", "none").exit_code == 1
    monkeypatch.setattr("harness.runs.engine.WORTH", 0.0)
    monkeypatch.setattr("harness.runs.engine.is_installed", lambda: False)
    assert invoke("run", own(tmp_path), "--out", tmp_path / "none", "--workers", 0, "--log", "none").exit_code == 1
    assert digests(tmp_path / "short") == digests(tmp_path / "none")


def test_a_law_whose_file_has_changed_since_it_was_loaded_is_not_lifted(tmp_path: Path) -> None:
    own(tmp_path)
    step = started(harness.law(f"{tmp_path / 'own.py'}:Own"), UNKNOWN)
    write(tmp_path / "own.py", OWN.replace("{memory}", "").replace("max(-self", "max(-2 * self"))
    with pytest.raises(NotLiftedError, match=r"own\.py has changed since it was loaded"):
        module_of(step)


@dataclass
class Turner:
    """A function that has no hash, as every value that can change."""

    def __call__(self) -> float:
        return 0.01


def test_a_law_that_holds_what_has_no_hash_is_flown_by_python() -> None:
    turner = Turner()
    flight = replace(FLIGHT, law=OwnLaw(lambda: lambda o: turning(turner())))
    assert engine.why_plain(flight).startswith("what it holds cannot be compared")
    assert engine.simulate(flight).digest == loop.simulate(flight).digest


def test_a_power_in_place_is_compiled_with_the_bits_of_python(tmp_path: Path) -> None:
    own(tmp_path, "q = abs(o.north) + 1.0\n            q **= 0.3")
    text = (tmp_path / "own.py").read_text().replace("-self.gain * r", "-self.gain * r * q")
    write(tmp_path / "own.py", text)
    flight = replace(FLIGHT, law=harness.law(f"{tmp_path / 'own.py'}:Own"))
    assert compiled(flight).digest == loop.simulate(flight).digest


def test_whole_numbers_that_python_lets_grow_without_limit_are_not_compiled(tmp_path: Path) -> None:
    own(tmp_path, "turns = int(o.north)")
    flight = replace(FLIGHT, law=harness.law(f"{tmp_path / 'own.py'}:Own"))
    assert engine.why_plain(flight).endswith("uses 'int'")


@pytest.mark.parametrize(
    ("body", "variable"),
    [
        ("if x > 0.0:\n    y = x\nreturn y", "y"),
        ("if x > 0.0:\n    y = x\nelse:\n    y = -x\nreturn y", ""),
        ("if x > 0.0:\n    return x\nelse:\n    y = x\nreturn y", ""),
        ("if (y := x) > 0.0:\n    return x\nreturn y", ""),
        ("for i in range(3):\n    y = i\nreturn x", ""),
        ("for i in range(3):\n    y = i\nreturn i", "i"),
        ("while x < 3.0:\n    x += 1.0\n    y = x\nreturn y", "y"),
        ("y += x\nreturn y", "y"),
        ("y: float\nreturn y", "y"),
        ("z = [y for y in (x, x)]\nreturn y", "y"),
        ("z = [w for w in (x, x)]\nreturn z[0]", ""),
    ],
)
def test_a_variable_that_may_be_read_without_a_value_is_found(body: str, variable: str) -> None:
    assert unbound(ast.parse(body).body, {"x", "y", "z", "i"}, {"x"}) == variable


@pytest.mark.parametrize(
    ("body", "variable"),
    [
        ("y = 0\nif x > 0.0:\n    y = x", "y"),
        ("y = 0\ny += 0.5 * x", "y"),
        ("y = 0.0\ny += 1", ""),
        ("y = x\ny = -y + 2", ""),
        ("y = 0\nfor i in range(3):\n    y = y + 2 * i", ""),
        ("y = 0 if x > 0.0 else 1.5", "0 if x > 0.0 else 1.5"),
        ("y = 0 if x > 0.0 else len(x)\nz = -y", ""),
        ("y, z = 0, x\nz = y", "z"),
        ("y = z = x", ""),
    ],
)
def test_a_variable_that_is_a_whole_number_here_and_a_float_there_is_found(body: str, variable: str) -> None:
    assert mixed(ast.parse(body).body) == variable


def test_a_law_that_may_read_a_variable_without_a_value_is_flown_by_python(tmp_path: Path) -> None:
    """Late in the flight, when Python flies no more beside it."""
    own(tmp_path, "if o.time < 150.0:\n                q = 1.0\n            q = q + 1.0")
    flight = replace(FLIGHT, law=harness.law(f"{tmp_path / 'own.py'}:Own"), duration=160.0)
    assert engine.why_plain(flight) == "step: q may be without a value"
    assert engine.simulate(flight).reason.startswith("the law raised UnboundLocalError")


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


def test_laws_with_the_same_step_and_other_constants_share_no_kernel(tmp_path: Path) -> None:
    shapes = []
    for constant in (1.0, 2.0):
        own(tmp_path, "pass")
        text = (tmp_path / "own.py").read_text().replace("@dataclass", f"FACTOR = {constant}\n\n\n@dataclass")
        write(tmp_path / "own.py", text.replace("-self.gain * r", "-FACTOR * self.gain * r"))
        step = started(harness.law(f"{tmp_path / 'own.py'}:Own"), UNKNOWN)
        shapes.append(held(step)[0])
        assert f"-{constant}" in module_of(step).text
    assert shapes[0] != shapes[1]


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
