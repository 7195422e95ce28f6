"""Laws of one's own, compiled: the rows of Python's, and what is left to Python, with the reason."""

import ast
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import harness
from autopilot.guidance import UNKNOWN, Guidance, Observation, Remembering, started
from autopilot.standoff import mirrored
from harness import loop
from harness.compiled import engine
from harness.compiled.closure import NotLiftedError, held
from harness.compiled.lifted import module_of
from harness.compiled.variables import mixed, unbound
from harness.flight import Flight
from harness.log import FlightLog
from tests.builders import FLIGHT, OwnLaw, digests, invoke, turning, write
from tests.test_compiled import compiled

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


def test_a_list_comprehension_is_compiled_with_the_bits_of_python(tmp_path: Path) -> None:
    own(tmp_path, "q = sum([0.1 * x for x in (o.north, o.east)])")
    text = (tmp_path / "own.py").read_text().replace("-self.gain * r", "-self.gain * r - 1e-5 * q")
    write(tmp_path / "own.py", text)
    flight = replace(FLIGHT, law=harness.law(f"{tmp_path / 'own.py'}:Own"))
    assert not engine.why_plain(flight)
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
    assert unbound(ast.parse(body).body, {"w", "x", "y", "z", "i"}, {"x"}) == variable


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
