"""A limit cycle observed in flight: the loop is flown from near its circle, and its steady oscillation measured."""

import math

import numpy as np

from harness.flight import Flight
from harness.limit_cycle.cycle import measured
from harness.limit_cycle.prediction import LimitCycle, Loop
from harness.loop import simulate
from harness.plants.ladder import BASELINE
from harness.plants.plant import Plant, Start
from harness.world.target import Target

_DURATION, _SETTLED = 120.0, 60.0  # s: of the flight, and of its transient


def fly(loop: Loop, plant: Plant, duration: float = _DURATION) -> LimitCycle:
    """The limit cycle of the loop on `plant`, started 1 m outside its circle; the first 60 s, at most half, are cut."""
    R_d, period = loop.law.standoff, loop.period
    flight = Flight(
        plant=BASELINE,  # `plant` flies in its place
        law=loop.law,
        duration=duration,
        guidance_period=period,
        start=Start(position=(R_d + 1.0, 0.0), heading=-0.5 * math.pi, airspeed=loop.airspeed),
        target=Target(position=(0.0, 0.0)),
    )
    log = simulate(flight, plant=plant, context=loop.context)
    settled = slice(round(min(_SETTLED, 0.5 * duration) / period), -1)
    rate = np.diff(np.unwrap(log["heading"][settled])) / period
    return measured(rate, log["range_error"][settled], log["heading_rate_command"][settled], period)
