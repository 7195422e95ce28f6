"""Errors of measurement, command and aircraft in a flight: the settings `[flight.errors]`, neutral by default."""

import math
from dataclasses import dataclass, fields
from typing import Annotated

from annotated_types import Ge, Le

from autopilot.quantities import About, Degrees, MetresPerSecond, Seconds


@dataclass(frozen=True, slots=True, kw_only=True)
class Errors:
    """The errors of a flight, the same for every law. SI, rad. With the defaults a flight is bit-identical."""

    wind: Annotated[MetresPerSecond, Ge(0), Le(100), About("magnitude of the error of the law's wind estimate")] = 0.0
    wind_heading: Annotated[
        Degrees, About("direction of this error, clockwise from north: the estimate is the steady wind plus the error")
    ] = 0.0
    course_noise: Annotated[
        Degrees,
        Ge(0),
        Le(math.pi),
        About("standard deviation of the measured course, white noise sampled at the guidance period"),
    ] = 0.0
    airspeed_scale: Annotated[float, Ge(0.1), Le(10), About("the airspeed that the law measures over the true one")] = (
        1.0
    )
    response_speed: Annotated[
        float,
        Ge(0.01),
        Le(100),
        About("bandwidth of the model that laws and gain rules use, over the identified bandwidth"),
    ] = 1.0
    command_delay: Annotated[
        Seconds,
        Ge(0),
        Le(10),
        About("transport delay of the command, a whole multiple of `step_s`; zero until the first command arrives"),
    ] = 0.0
    mass_scale: Annotated[
        float, Ge(0.5), Le(2), About("the aircraft's mass over its airframe's; moments of inertia are unchanged")
    ] = 1.0
    cg_aft: Annotated[float, Ge(-1), Le(1), About("shift of the centre of gravity aft, in mean chords")] = 0.0
    actuator_lag: Annotated[
        Seconds, Ge(0), Le(1), About("time constant of an additional first-order lag at elevator, aileron and rudder")
    ] = 0.0

    @property
    def of_loop(self) -> list[str]:
        """Names of the active errors that affect the inner loop."""
        return [*(["command_delay"] if self.command_delay else []), *self.of_aircraft]

    @property
    def of_aircraft(self) -> list[str]:
        """Names of the active errors that affect the airframe."""
        return [name for name in ("mass_scale", "cg_aft", "actuator_lag") if getattr(self, name) != _NONE[name]]

    def estimated(self, wind: tuple[float, float]) -> tuple[float, float]:
        """The law's estimate of this steady wind, m/s, north and east."""
        if not self.wind:
            return wind
        W_x, W_y = wind
        return W_x + self.wind * math.cos(self.wind_heading), W_y + self.wind * math.sin(self.wind_heading)


_NONE = {field.name: field.default for field in fields(Errors)}
