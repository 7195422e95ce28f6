"""The limit cycle of a loop: as a balance of harmonics, looked for where the loop settles; else as it was marched."""

import math

import numpy as np
from numpy.typing import NDArray

from harness.limit_cycle.march import LoopMotion, UnsettledError, settled
from harness.limit_cycle.prediction import CANNOT_HOLD, HARMONICS, LimitCycle, Loop, balanced, unknowns

Array = NDArray[np.float64]

UNSOLVED = LimitCycle(*(math.nan,) * 5)  # there is one, and its numbers are unknown


def limit_cycle(loop: Loop) -> LimitCycle | None:
    """The limit cycle of a loop; None where it comes to rest, `UNSOLVED` where it is not known what it comes to.

    Raises ValueError when the heading-rate limit is below the heading rate of the circle, and `LawFailed`.
    """
    if not loop.holds_circle:
        raise ValueError(CANNOT_HOLD)
    try:
        motion = settled(loop)
    except UnsettledError:
        return UNSOLVED
    if motion.rests:
        return None
    found = _measured(loop, motion)
    return _balance(loop, motion, found.frequency, HARMONICS) or found


def balance(loop: Loop, harmonics: int = HARMONICS) -> LimitCycle | None:
    """The oscillation of so many harmonics in balance, near what the loop settles to; None where none is found.

    Raises `UnsettledError` and `LawFailed`.
    """
    motion = settled(loop)
    return None if motion.rests else _balance(loop, motion, _measured(loop, motion).frequency, harmonics)


def _balance(loop: Loop, motion: LoopMotion, frequency: float, harmonics: int) -> LimitCycle | None:
    """The same of a motion at this frequency, Hz."""
    if frequency == 0.0:
        return None
    omega = math.tau * frequency
    starts = (_unknowns(loop, motion, omega, count) for count in sorted({harmonics, 1}, reverse=True))
    return balanced(loop, starts, harmonics)


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


def _measured(loop: Loop, motion: LoopMotion) -> LimitCycle:
    return measured(np.diff(motion.e) / loop.period, motion.r[:-1], motion.u[:-1], loop.period)


def _unknowns(loop: Loop, motion: LoopMotion, omega: float, harmonics: int) -> Array:
    """The oscillation of a motion, by least squares, as a start for the balance."""
    turns = np.exp(1j * omega * loop.period * np.outer(np.arange(len(motion.e)), np.arange(1, harmonics + 1)))
    waves = np.hstack([np.ones((len(turns), 1)), 2.0 * turns.real, -2.0 * turns.imag])
    found = np.linalg.lstsq(waves, motion.e, rcond=None)[0]
    E = found[1 : harmonics + 1] + 1j * found[harmonics + 1 :]
    return unknowns(omega, E, float(motion.r.mean()), loop.airspeed)
