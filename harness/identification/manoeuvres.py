"""The manoeuvres that identify an airframe: their commands, and the records of flying them."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

import aircraft
from harness.plants.plant import Start
from harness.plants.sixdof import SixDof
from harness.plants.state import State
from harness.world.air import Air
from harness.world.randomness import stream

Array = NDArray[np.float64]

STEP = 0.005  # s: step of the simulation and of every command here
SLOWEST, FASTEST = 0.05, 20.0  # rad/s: range of the sweep
SWEEP_PERIOD = 2.0 * math.pi / SLOWEST  # s
SWEPT = MappingProxyType({"small": 0.5, "medium": 2.0, "large": 4.0})  # deg/s rms
STEPS_DEG_S = (1.0, 2.0, 5.0, 10.0, 20.0)
STEP_LENGTH = 10.0  # s: length of each step


def held(levels_deg_s: Sequence[float], each: float) -> Array:
    """A command, rad/s, one value per step: each level, deg/s, held for `each` seconds."""
    return np.repeat(np.radians(levels_deg_s), round(each / STEP))


def lines() -> Array:
    """The frequencies of the sweep, rad/s: whole multiples of the slowest, evenly spread on a logarithmic scale."""
    return SLOWEST * np.unique(np.round(np.geomspace(1.0, FASTEST / SLOWEST, 50)))


def sweep(rms_deg_s: float, periods: int = 1) -> Array:
    """A command, rad/s, one value per step: all frequencies of `lines()`, of equal amplitude and random phase."""
    time = STEP * np.arange(round(SWEEP_PERIOD / STEP))
    omega = lines() * SWEEP_PERIOD / (STEP * len(time))  # the period is a whole number of steps
    phases = stream(0, "sweep").uniform(0.0, 2.0 * math.pi, len(omega))
    x = np.sin(np.outer(time, omega) + phases).sum(axis=1)
    return np.tile(math.radians(rms_deg_s) * x / np.sqrt(np.mean(x * x)), periods)


TRAINING: Mapping[str, Array] = MappingProxyType(
    {
        "step of 5 deg/s": held([5], 10.0),
        "step of -2 deg/s": held([-2], 10.0),
        "reversals between 10 and -10 deg/s": held([10, -10, 0], 4.0),
        "reversals between 5 and -5 deg/s every 0.3 s": held([5, -5] * 15, 0.3),
        "sweep of 2 deg/s rms": sweep(SWEPT["medium"]),
        "sweep of 4 deg/s rms": sweep(SWEPT["large"]),
    }
)
HELD_OUT: Mapping[str, Array] = MappingProxyType(
    {
        "step of 3 deg/s": held([3], 10.0),
        "step of -8 deg/s": held([-8], 10.0),
        "step of 15 deg/s": held([15], 10.0),
        "turns, changed every 3 s": held([4, -4, 6, 0, -5, 2], 3.0),
        "turns, changed every second": held([3, 5, -1, 4, -3, -5, 0, 2], 1.0),
    }
)
CHATTER: Mapping[str, Array] = MappingProxyType(
    {
        f"reversals between {high:g} and {low:g} deg/s every {each:g} s": held([high, low] * round(12.0 / each), each)
        for high, low, each in ((5.0, -5.0, 0.4), (5.0, -5.0, 0.2), (1.0, -1.0, 0.2), (5.0, -2.0, 0.3))
    }
)


@dataclass(frozen=True, slots=True)
class Programme:
    """The manoeuvres of an identification; the rate trim is off only for the fit of the bank."""

    swept: Mapping[str, float]  # deg/s rms, of sweeps of two periods each; the smallest first
    steps: Sequence[Array]
    entries: Sequence[Array]  # into turns, which move the airspeed, and out again
    training: Mapping[str, Array]
    held_out: Mapping[str, Array]

    def flights(self) -> list[tuple[Array, bool]]:
        """The commands to be flown, and whether the rate trim is on; none is the beginning of another."""
        sweeps = (sweep(rms, periods=2) for rms in self.swept.values())
        training = self.training.values()
        trimmed = (*sweeps, *self.steps, *self.entries, *training, *self.held_out.values())
        return [*((command, True) for command in _longest(trimmed)), *((command, False) for command in training)]


def _longest(commands: Iterable[Array]) -> list[Array]:
    """Those that are not the beginning of another."""
    longest: list[Array] = []
    for command in sorted(commands, key=len, reverse=True):
        if not any(begins(command, other) for other in longest):
            longest.append(command)
    return longest


WHOLE = Programme(
    swept=SWEPT,
    steps=[held([rate], STEP_LENGTH) for rate in STEPS_DEG_S],
    entries=[held([rate, 0.0], STEP_LENGTH) for rate in STEPS_DEG_S[2:]],
    training=TRAINING,
    held_out=MappingProxyType({**HELD_OUT, **CHATTER}),
)


def quick(slower: int) -> Programme:
    """With one sweep alone, and all other commands so many times as slow."""

    def stretched(command: Array) -> Array:
        return np.repeat(command, slower)

    training = {name: command for name, command in TRAINING.items() if not name.startswith("sweep")}
    return Programme(
        swept={"medium": SWEPT["medium"]},
        steps=[stretched(command) for command in WHOLE.steps],
        entries=[stretched(command) for command in WHOLE.entries],
        training={
            **{name: stretched(command) for name, command in training.items()},
            "sweep of 2 deg/s rms": sweep(SWEPT["medium"]),
        },
        held_out={name: stretched(command) for name, command in WHOLE.held_out.items()},
    )


def begins(command: Array, other: Array) -> bool:
    """Whether `command` is the beginning of the other."""
    return len(command) <= len(other) and np.array_equal(command, other[: len(command)])


@dataclass(frozen=True, slots=True)
class Record:
    """A command and the states of the airframe that followed it. SI, rad."""

    command: Array  # rad/s, a value per step
    states: Array  # (steps + 1, fields of State); the first row precedes the first step
    airspeed: float  # nominal

    def __getitem__(self, field: str) -> Array:
        """A field of the state, by name, at the end of each step."""
        return self.states[1:, State._fields.index(field)]

    def beginning(self, steps: int) -> "Record":
        """The record of the first steps."""
        return replace(self, command=self.command[:steps], states=self.states[: steps + 1])

    @property
    def heading_rate(self) -> Array:
        """The mean heading rate over each step, rad/s."""
        return np.diff(np.unwrap(self.states[:, State._fields.index("heading")])) / STEP


def flown(airframe: Path, airspeed: float, command: Array, rate_trim: bool = True) -> Record:
    """Flies a command, rad/s per step, on the plant sixdof, from trim in still air. Raises `PlantError`, `End`."""
    start = Start(airspeed=airspeed, heading=0.0)
    if adopted := aircraft.adopted(airframe):
        start = replace(start, altitude=adopted["altitude"])
    flying = SixDof(airframe, STEP, rate_trim).start(start, Air())
    states = [flying.state]
    for rate in command.tolist():
        flying.advance(rate, STEP)
        states.append(flying.state)
    return Record(command, np.array(states), airspeed)
