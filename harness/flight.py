"""A flight as a value: all settings that decide it."""

from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated

from annotated_types import Ge, Gt, Le

import aircraft
from autopilot.estimator import Estimator
from autopilot.guidance import Context, Law, uses_response
from autopilot.quantities import About, Metres, OneOf, Seconds
from harness.flight_errors import Errors
from harness.plants.ladder import PLANTS, Setup
from harness.plants.plant import Plant, PlantError, Start
from harness.world.air import Air
from harness.world.target import Target
from harness.world.wind import Wind

if TYPE_CHECKING:
    from autopilot.response import Response


@dataclass(frozen=True, slots=True, kw_only=True)
class InnerLoop:
    """Settings of the 6-DOF plant's inner loop."""

    rate_trim: Annotated[bool, About("slow integrator that removes the turn-rate shortfall of a bank-only turn")] = True


@dataclass(frozen=True, slots=True, kw_only=True)
class MetricSettings:
    """Thresholds of the metrics, and the range beyond which the target is lost."""

    tolerance: Annotated[Metres, Gt(0), About("a flight has converged once |range error| stays below this")] = 1.0
    monitoring_range: Annotated[Metres | None, Gt(0), About("distance beyond which the target is lost")] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Flight:
    """One flight: a frozen value of all that decides it. SI, rad. Defaults are the paper's stationary case (Table 1).

    `harness.simulate` flies it and says what is wrong with it. A settings file names the same fields, with units in
    their keys.

    >>> flight = harness.Flight(plant="sixdof", law=harness.law("nftsm"), duration=150.0)
    >>> dataclasses.replace(flight, plant="kinematic")
    """

    plant: Annotated[str, OneOf(tuple(PLANTS)), About("everything below the heading-rate command")]
    law: Law
    aircraft: Annotated[str, About("an airframe by name, its folder, or a file of harness assess --fit")] = (
        "ultra_stick_25e"
    )
    duration: Annotated[Seconds, Gt(0), Le(1e6), About("length of the flight")] = 100.0
    guidance_period: Annotated[
        Seconds, Gt(0), Le(1e3), About("time between two commands of the law; a command is held until the next")
    ] = 0.05
    step: Annotated[
        Seconds, Ge(1e-5), Le(0.05), About("step of the 6-DOF simulation; all periods are whole multiples of it")
    ] = 0.005
    seed: Annotated[int, Ge(0), Le(10**15), About("seed of everything random")] = 0
    start: Start = field(default_factory=Start)
    target: Target = field(default_factory=Target)
    wind: Wind = field(default_factory=Wind)
    estimator: Estimator = field(default_factory=Estimator)
    inner_loop: InnerLoop = field(default_factory=InnerLoop)
    errors: Errors = field(default_factory=Errors)
    metrics: MetricSettings = field(default_factory=MetricSettings)

    @property
    def periods(self) -> int:
        """The number of guidance periods in the flight."""
        return round(self.duration / self.guidance_period)


def setup_of(flight: Flight) -> Setup:
    """The inputs from which the flight's plant is made. Raises FileNotFoundError for an unknown airframe."""
    airframe = aircraft.folder(flight.aircraft)
    return Setup(airframe, flight.start.airspeed, flight.step, flight.inner_loop.rate_trim, flight.errors)


def plant_of(flight: Flight) -> Plant:
    """The plant that the flight names. Raises `PlantError` when it cannot be made."""
    return PLANTS[flight.plant].make(setup_of(flight))


def command_delay(flight: Flight) -> tuple[int, float]:
    """The transport delay of the command: whole guidance periods, and a part of one, s."""
    whole, steps = divmod(round(flight.errors.command_delay / flight.step), round(flight.guidance_period / flight.step))
    return whole, steps * flight.step


def context_of(flight: Flight) -> Context:
    """The context of the flight's law; the response of an airframe that is not identified is None."""
    response = None
    if uses_response(flight.law):
        with suppress(PlantError, FileNotFoundError):
            response = told_response(flight)
    at_once = PLANTS[flight.plant].at_once
    return Context(flight.guidance_period, flight.start.airspeed, flight.seed, response, at_once)


def told_response(flight: Flight) -> "Response":
    """The response of the heading rate to its command, as used by law and gain rules: identified, with its error.

    Raises `IdentifiedError` where it is not known, FileNotFoundError for an unknown airframe.
    """
    from harness.plants.identified import identified  # imported when used: most laws need none

    response = identified(aircraft.folder(flight.aircraft), flight.start.airspeed).heading_rate
    speed = flight.errors.response_speed
    return response if speed == 1.0 else response.quicker(speed)


def air_of(flight: Flight) -> Air:
    """The air of the flight: the same for every plant, law and guidance period."""
    return flight.wind.start(
        airspeed=flight.start.airspeed,
        altitude=flight.start.altitude,
        step=flight.step,
        duration=flight.duration,
        seed=flight.seed,
    )
