"""The interface of a guidance law: its observation and its guidance."""

from collections.abc import Callable, Mapping
from inspect import signature
from typing import TYPE_CHECKING, Any, Generic, Literal, NamedTuple, Protocol, TypeVar

if TYPE_CHECKING:
    from autopilot.response import Response


class Observation(NamedTuple):
    """All that a law may know. SI, rad, world frame north-east from the flight's origin; headings clockwise from north.

    `heading` is psi_a, the direction of (ground velocity - estimated steady wind), and `heading_rate` its rate; not the
    nose. Velocities are over the ground; `airspeed` is measured, `nominal_airspeed` is commanded; `wind_north` and
    `wind_east` are the estimated steady wind: where the air moves to. The target is as estimated; its acceleration (of
    its speed) and turn rate are zero when unknown.
    """

    north: float
    east: float
    velocity_north: float  # over the ground
    velocity_east: float
    airspeed: float  # measured v_a
    heading: float
    heading_rate: float
    bank: float
    roll_rate: float
    nominal_airspeed: float  # commanded v_a
    wind_north: float  # estimated steady wind: where the air moves to
    wind_east: float
    target_north: float
    target_east: float
    target_velocity_north: float
    target_velocity_east: float
    target_acceleration: float  # rate of the target's speed
    target_turn_rate: float
    time: float = 0.0  # since the start of the flight


class Guidance(NamedTuple):
    """A law's answer: `heading_rate` is the command, rad/s, clockwise and limited; the rest is telemetry. SI, rad.

    `range_error` is r = L - R_d, `sliding_variable` s, `heading_error` psi_a against its desired value, `feed_forward`
    the part of the command that neither s nor the manifold makes. A law that has no such thing gives NaN or zero.
    """

    heading_rate: float  # the command omega_psi
    range_error: float  # r = L - R_d
    sliding_variable: float  # s
    heading_error: float  # psi_a against its desired value, in [-pi, pi)
    feed_forward: float  # the part of the command that depends on neither s nor the manifold
    unlimited_command: float


class Telling(Guidance):
    """An answer with channels of the law's own."""

    channels: Mapping[str, float]


def telling(guidance: Guidance, **channels: float) -> Guidance:
    """The answer with numbers of the law's own by name: the flight's log keeps them as its columns `law_NAME`."""
    told = Telling._make(guidance)
    told.channels = {name: float(channels[name]) for name in channels}
    return told


LawStep = Callable[[Observation], Guidance]
Memory = TypeVar("Memory", bound=tuple[Any, ...])
Recalling = Callable[[Observation, Memory], tuple[Guidance, Memory]]
"""A pure step of a law with memory: from what it sees and remembers to its answer and what it remembers next."""


class Remembering(Generic[Memory]):
    """A law with memory in flight: a `LawStep` that keeps for its pure step what that remembers.

    The memory is a tuple of numbers, or of such tuples, and keeps its shape; so the step can be compiled.
    """

    def __init__(self, step: Recalling[Memory], memory: Memory) -> None:
        """`memory` is that at the start."""
        self.step, self.memory = step, memory

    def __call__(self, o: Observation) -> Guidance:
        guidance, self.memory = self.step(o, self.memory)
        return guidance


class Context(NamedTuple):
    """What a law knows before it flies. SI, rad."""

    period: float = 0.05  # between two commands
    nominal_airspeed: float = 13.0  # commanded
    seed: int = 0  # of the flight, for a law that draws
    response: "Response | None" = None  # identified, of the heading rate to its command; None when unknown
    at_once: bool = False  # whether the plant follows the command at once: there is nothing to predict


UNKNOWN = Context()  # for a law that asks for nothing


class Law(Protocol):
    """A guidance law: a frozen value of parameters. Any memory belongs to the function that `start` returns.

    A law that computes with `Context.response` says so by `uses_response = True` in its class; to others it is None,
    so that their flights do not depend on the identification.
    """

    @property
    def standoff(self) -> float: ...
    @property
    def max_heading_rate(self) -> float: ...
    @property
    def command(self) -> Literal["heading_rate", "course_rate"]:
        """The quantity to which the limit applies."""
        ...

    def start(self, context: Context) -> LawStep:
        """The law in flight, without memory of any other flight."""
        ...

    def broken_conditions(self, speed_ratio: float) -> list[str]:
        """Sentences on the conditions of its theory that the gains violate; `speed_ratio` is (v_t + v_w) / v_a."""
        ...


def started(law: Law, context: Context) -> LawStep:
    """The law in flight; one whose `start` takes nothing is started without the context."""
    return law.start(context) if signature(law.start).parameters else law.start()  # type: ignore[call-arg]


def uses_response(law: Law) -> bool:
    """Whether the law computes with the identified response of its airframe."""
    return bool(getattr(law, "uses_response", False))
