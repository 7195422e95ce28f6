"""The margin of a law with memory, from the linearisation that it gives."""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from autopilot.guidance import Remembering, started
from autopilot.linear import Linear
from harness.chatter import VISIBLE
from harness.limit_cycle.march import matrices
from harness.limit_cycle.prediction import Crossover, LawFailed, Loop

NO_LINEARISATION = "the law has memory, and no method `linearised` that says what it does to a small oscillation"
_TRIED = 7  # points at which a law is asked twice
_UNSTABLE = 1.0 + 1e-9  # times a period: a free range error, which no law corrects, stays as it is but for rounding


def linearised(loop: Loop) -> Linear | None:
    """The loop's law from (heading error, range error) to its command, as it gives it; None where it gives none."""
    own: Callable[[Any, float], Linear] | None = getattr(loop.law, "linearised", None)
    try:
        return own(loop.context, VISIBLE) if own else None
    except Exception as error:
        raise LawFailed(f"the law's linearised raised {type(error).__name__}: {error}") from error


def has_memory(loop: Loop) -> bool:
    """Whether the loop's law declares a memory, or answers otherwise when it was asked before. Raises `LawFailed`."""
    e = np.linspace(-0.01, 0.02, _TRIED)
    r = np.linspace(0.3, -0.2, _TRIED)
    alone = [loop.commands(e[i : i + 1], r[i : i + 1])[0] for i in range(_TRIED)]
    answers_otherwise = loop.commands(e, r).tolist() != alone
    return bool(answers_otherwise or isinstance(started(loop.law, loop.context), Remembering))


def crossing_and_margin(loop: Loop, law: Linear) -> tuple[Crossover | None, float]:
    """Crossover and margin of the loop with a law that gives this linearisation.

    A gain can be the border only where the loop, opened at the command, has the phase of a sustained oscillation; of
    those the margin is the next above 1 of a stable loop, and below 1 that of an unstable one: inf and 0 where there is
    none, as an unstable loop is then unstable with less gain, too. NaN where it diverges without an oscillation.
    """
    omega = math.pi / loop.period * np.append(np.geomspace(1e-4, 1.0, 6000, endpoint=False), 1.0)
    z = np.exp(1j * omega * loop.period)
    H, J = loop.response.sampled(loop.period, z).T
    of_e, of_r = law.at(z)[:, 0, :].T
    by_error = of_e + of_r * loop.airspeed * J / H  # the law's command over the heading error
    once_round = loop.gain * by_error * H  # 1 where an oscillation sustains itself
    above = np.flatnonzero((np.abs(once_round[:-1]) >= 1.0) & (np.abs(once_round[1:]) < 1.0))
    crossover = None
    if above.size:
        i = int(above[-1])
        crossover = Crossover(float(omega[i]), float(np.angle(once_round[i])), float(abs(by_error[i])))

    turned = np.sign(once_round.imag[1:]) != np.sign(once_round.imag[:-1])
    turned[-1] = True  # at half the sampling frequency it is real
    at = np.flatnonzero(turned & (once_round.real[1:] > 0.0)) + 1
    borders = sorted(1.0 / once_round.real[at])
    if _is_stable(loop, law, 1.0):
        return crossover, float(next((border for border in borders if border > 1.0), math.inf))
    below = [0.0, *(border for border in borders if border <= 1.0)]
    for lower, border in reversed(list(pairwise(below))):
        if _is_stable(loop, law, 0.5 * (lower + border)):
            return crossover, float(border)
    poles = _poles(loop, law, 1.0)
    unstable = poles[np.abs(poles) >= _UNSTABLE]
    oscillates = np.any((np.abs(unstable.imag) > 1e-9) | (unstable.real < 0.0))
    return crossover, 0.0 if oscillates else math.nan


def _is_stable(loop: Loop, law: Linear, times: float) -> bool:
    """Whether the closed loop does not diverge, with so many times the gain of the law."""
    return bool(np.abs(_poles(loop, law, times)).max() < _UNSTABLE)


def _poles(loop: Loop, law: Linear, times: float) -> NDArray[np.complex128]:
    """The poles of the sampled closed loop, with so many times the gain of the law."""
    F, g, H = matrices(loop)
    D, C = times * loop.gain * law.D @ H, times * loop.gain * law.C
    closed = np.block([[F + np.outer(g, D), np.outer(g, C)], [law.B @ H, law.A]])
    return np.asarray(np.linalg.eigvals(closed), np.complex128)
