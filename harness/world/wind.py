"""The settings of a flight's wind."""

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from types import MappingProxyType
from typing import Annotated

import numpy as np
from annotated_types import Ge, Le

from autopilot.quantities import About, MetresPerSecond, MetresPerSecondPerMetre, OneOf, Seconds
from harness.world.air import Air, Array

_SHARED = 1_000_000  # steps: longer air is not cached, since it takes hundreds of MB
_Gusty = Annotated[MetresPerSecond, Ge(-100), Le(100)]


KNOT = 0.514444  # m/s
# The severities of turbulence, weakest first, and the wind speed 20 ft above the ground that defines each, m/s.
SEVERITIES = MappingProxyType({"none": 0.0, "light": 15.0 * KNOT, "moderate": 30.0 * KNOT, "severe": 45.0 * KNOT})
LOWEST, HIGHEST = 3.048, 304.8  # m, 10 and 1000 ft above ground: where the turbulence's low-altitude model holds


@dataclass(frozen=True, slots=True, kw_only=True)
class Gust:
    """A discrete gust of the shape (1 - cos)/2: it rises and falls back to zero within its interval."""

    from_: Annotated[Seconds, Ge(0), Le(1e6), About("begin")]
    to: Annotated[Seconds, Ge(0), Le(1e6), About("end")]
    velocity: Annotated[tuple[_Gusty, _Gusty, _Gusty], About("peak velocity of the air: north, east, down")]

    def at(self, time: Array) -> Array:
        """The gust at these times, s: shape (len(time), 3), m/s towards north, east, down."""
        share = np.clip((time - self.from_) / (self.to - self.from_), 0.0, 1.0)
        return np.outer(0.5 - 0.5 * np.cos(2.0 * np.pi * share), self.velocity)


@dataclass(frozen=True, slots=True, kw_only=True)
class Wind:
    """The wind of a flight. A velocity is that of the air: the direction is where the air moves to."""

    steady: Annotated[
        tuple[MetresPerSecond, MetresPerSecond], About("steady wind: the air moves towards north, east")
    ] = (0.0, 0.0)
    shear: Annotated[
        tuple[MetresPerSecondPerMetre, MetresPerSecondPerMetre],
        About("change of the steady wind per metre above the start's altitude"),
    ] = (0.0, 0.0)
    gusts: Annotated[tuple[Gust, ...], About("discrete gusts, (1 - cos)/2; overlapping ones add up")] = ()
    turbulence: Annotated[str, OneOf(tuple(SEVERITIES)), About("MIL-F-8785C, low altitude")] = "none"
    rotation: Annotated[bool, About("include the rotational turbulence p_g, q_g, r_g on a 6-DOF aircraft")] = True

    def gust(self, time: Array) -> Array:
        """The sum of the discrete gusts at these times, s: shape (len(time), 3), m/s towards north, east, down."""
        return sum((gust.at(time) for gust in self.gusts), np.zeros((len(time), 3)))

    def start(self, *, airspeed: float, altitude: float, step: float, duration: float, seed: int) -> Air:
        """The air of a flight at this nominal airspeed and altitude, on its grid of steps. SI."""
        north, east = self.steady
        wind = replace(self, steady=(north + 0.0, east + 0.0))  # minus zero is zero: equal winds make the same air
        if wind == Wind(steady=wind.steady, rotation=wind.rotation):
            return Air(steady=wind.steady)
        steps = round(duration / step)
        try:
            hash(wind)
        except TypeError:  # a list stands in place of a tuple
            return _made.__wrapped__(wind, airspeed, altitude, step, steps, seed)
        made = _made if steps <= _SHARED else _made.__wrapped__
        return made(wind, airspeed, altitude, step, steps, seed)


@lru_cache(maxsize=1)
def _made(wind: Wind, airspeed: float, altitude: float, step: float, steps: int, seed: int) -> Air:
    """The air on its grid; of flights that differ in plant or law alone it is made once."""
    gusts = wind.gust(step * np.arange(steps + 1, dtype=np.float64))
    rotation = None
    if wind.turbulence != "none":
        from harness.world.turbulence import dryden, turbulence  # imported when used: only turbulence needs SciPy

        W_x, W_y = wind.steady
        model = dryden(wind.turbulence, airspeed, altitude)
        field = turbulence(model, math.atan2(W_y, W_x), seed, step, steps)
        gusts = gusts + field.velocity[field.lead :]
        rotation = field.rotation if wind.rotation else None
    gusts.setflags(write=False)
    return Air(steady=wind.steady, shear=wind.shear, altitude=altitude, step=step, gusts=gusts, turbulence=rotation)
