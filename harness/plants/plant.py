"""The protocol of a plant: everything below the heading-rate command, from its start to its end."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType
from typing import Annotated, Protocol

from annotated_types import Ge

from autopilot.quantities import About, Degrees, Metres, MetresPerSecond
from harness.error import HarnessError
from harness.plants.state import State
from harness.world.air import Air


class Outcome(StrEnum):
    """How a flight ended. The first four are results, the last three are failures of the computation."""

    COMPLETED = "completed"
    GROUND = "ground"
    DEPARTED = "departed"
    TARGET_LOST = "target_lost"
    INVALID = "invalid"
    TIMEOUT = "timeout"
    WORKER_DIED = "worker_died"

    @property
    def lost(self) -> bool:
        """It ended early for a reason of the flight: a result, and never data of a flight that lasted."""
        return self in (Outcome.GROUND, Outcome.DEPARTED, Outcome.TARGET_LOST)

    @property
    def failed(self) -> bool:
        """Whether the computation failed, so that the flight says nothing about the aircraft or the law."""
        return self in (Outcome.INVALID, Outcome.TIMEOUT, Outcome.WORKER_DIED)

    @property
    def of_machine(self) -> bool:
        """Whether the machine may be to blame, so that the same flight may go well next time."""
        return self in (Outcome.TIMEOUT, Outcome.WORKER_DIED)

    @property
    def sentence(self) -> str:
        """The outcome as a sentence without its full stop: a reason may follow after a colon."""
        return _SENTENCES[self]


_SENTENCES: Mapping[Outcome, str] = MappingProxyType(
    {
        Outcome.COMPLETED: "The flight lasted its full duration",
        Outcome.GROUND: "The aircraft came too close to the ground",
        Outcome.DEPARTED: "The aircraft departed from controlled flight",
        Outcome.TARGET_LOST: "The aircraft lost the target",
        Outcome.INVALID: "The flight failed: a computed value is not valid",
        Outcome.TIMEOUT: "The flight failed: its computation hung",
        Outcome.WORKER_DIED: "The flight failed: the process that computed it died",
    }
)


class End(Exception):  # noqa: N818 - an end is not an error
    """The flight ends early: raised by plant, law or estimator, caught by `simulate`, which puts it into the log."""

    def __init__(self, outcome: Outcome, reason: str) -> None:
        super().__init__(reason)
        self.outcome = outcome

    def __reduce__(self) -> tuple[type["End"], tuple[Outcome, str]]:  # a process may send it to another
        return End, (self.outcome, str(self))


class PlantError(HarnessError, ValueError):
    """The plant cannot start with these settings; `key` is the dotted name of the setting to change."""

    def __init__(self, key: str, message: str) -> None:
        super().__init__(message)
        self.key = key

    def __reduce__(self) -> tuple[type["PlantError"], tuple[str, str]]:  # a process may send it to another
        return PlantError, (self.key, str(self))


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """Where and how a flight starts: level, in trim, at its nominal airspeed. SI, rad."""

    position: Annotated[tuple[Metres, Metres], About("north, east of the origin")] = (-200.0, 200.0)
    heading: Annotated[Degrees, About("direction of the air velocity, clockwise from north")] = math.radians(30.0)
    airspeed: Annotated[
        MetresPerSecond,
        Ge(0.1),
        About("nominal airspeed, held throughout; a file that leaves it out has the airframe's own"),
    ] = 13.0
    altitude: Annotated[Metres, About("above the ground, held throughout")] = 150.0


class Flying(Protocol):
    """A plant in flight."""

    @property
    def state(self) -> State:
        """The aircraft now."""
        ...

    def advance(self, heading_rate: float, period: float) -> None:
        """Flies on for `period` seconds with this heading-rate command, rad/s. Raises `End` when the flight ends."""
        ...


class Plant(Protocol):
    """A model of the aircraft with its inner loop: a frozen value, whose flights are started by `start`."""

    def __hash__(self) -> int: ...

    def start(self, start: Start, air: Air) -> Flying:
        """The aircraft in flight, at `start` in this air. Raises `PlantError` when it cannot fly there."""
        ...
