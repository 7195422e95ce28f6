"""Errors of a flight: what law, command and aircraft have wrong. The settings `[flight.errors]`, neutral by default."""

import math
from dataclasses import dataclass, fields
from typing import Annotated

from annotated_types import Ge, Le

from autopilot.quantities import About, Degrees, MetresPerSecond, Seconds


@dataclass(frozen=True, slots=True, kw_only=True)
class Errors:
    """What is wrong in a flight, for every law alike. SI, rad. The defaults change no bit of a flight."""

    wind: Annotated[MetresPerSecond, Ge(0), Le(100), About("size of the error of the law's wind estimate")] = 0.0
    wind_heading: Annotated[
        Degrees, About("where this error points, clockwise from north: the estimate is the steady wind plus the error")
    ] = 0.0
    course_noise: Annotated[
        Degrees,
        Ge(0),
        Le(math.pi),
        About("deviation of the course that the law measures, white from one guidance period to the next"),
    ] = 0.0
    airspeed_scale: Annotated[float, Ge(0.1), Le(10), About("the airspeed that the law measures over the true one")] = (
        1.0
    )
    response_speed: Annotated[
        float,
        Ge(0.01),
        Le(100),
        About("how many times as quick as identified law and gains by rule take the response to be"),
    ] = 1.0
    command_delay: Annotated[
        Seconds,
        Ge(0),
        Le(10),
        About("from the law to the plant, a whole multiple of `step_s`; until the first command arrives it is zero"),
    ] = 0.0
    mass_scale: Annotated[
        float, Ge(0.5), Le(2), About("the aircraft's mass over its airframe's; its moments of inertia stay")
    ] = 1.0
    cg_aft: Annotated[
        float, Ge(-1), Le(1), About("the centre of gravity lies so many mean chords behind its airframe's")
    ] = 0.0
    actuator_lag: Annotated[
        Seconds, Ge(0), Le(1), About("time constant of one more first-order lag before elevator, aileron and rudder")
    ] = 0.0

    @property
    def of_loop(self) -> list[str]:
        """The names of the errors that are there and change how the aircraft answers a command."""
        return [*(["command_delay"] if self.command_delay else []), *self.of_aircraft]

    @property
    def of_aircraft(self) -> list[str]:
        """The names of the errors that are there and change the aircraft itself."""
        return [name for name in ("mass_scale", "cg_aft", "actuator_lag") if getattr(self, name) != _NONE[name]]

    def estimated(self, wind: tuple[float, float]) -> tuple[float, float]:
        """The law's estimate of this steady wind, m/s, north and east."""
        if not self.wind:
            return wind
        W_x, W_y = wind
        return W_x + self.wind * math.cos(self.wind_heading), W_y + self.wind * math.sin(self.wind_heading)


_NONE = {field.name: field.default for field in fields(Errors)}
