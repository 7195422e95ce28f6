"""A limit cycle observed in flight: the loop is flown from near its circle, and its steady oscillation measured."""

import math

import numpy as np
from numpy.typing import NDArray

from harness.flight import Flight
from harness.limit_cycle.prediction import LimitCycle, Loop
from harness.loop import simulate
from harness.plants.ladder import BASELINE
from harness.plants.plant import Plant, Start
from harness.world.target import Target

Array = NDArray[np.float64]

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


def measured(rate: Array, error: Array, commanded: Array, period: float) -> LimitCycle:
    """The limit cycle in records of a steady state, SI, rad, one value per `period` seconds.

    The frequency is that of the peak of the spectrum; amplitudes are means over the cycles.
    """
    finer = 16 * len(rate)
    spectrum = np.abs(np.fft.rfft((rate - rate.mean()) * np.hanning(len(rate)), finer))
    frequency = float(np.argmax(spectrum)) / (finer * period)
    count = min(len(rate), max(2, round(1.0 / max(frequency, 1e-9) / period)))
    cycles = range(0, len(rate) - count + 1, count)

    def amplitude(values: Array) -> float:
        return float(np.mean([np.ptp(values[i : i + count]) for i in cycles])) / 2.0

    return LimitCycle(frequency, amplitude(rate), amplitude(commanded), float(error.mean()), amplitude(error))
