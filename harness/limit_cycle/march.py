"""A loop simulated in time from beside its circle, until it comes to rest or oscillates steadily.

It is the same sampled loop whose limit cycle `prediction` balances. The march finds one where no balance is found, and
shows where to look for the balance.
"""

import math
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from autopilot.response import critical_gain, held
from harness.chatter import VISIBLE
from harness.limit_cycle.prediction import Loop

Array = NDArray[np.float64]

_START = 1.0  # m outside the circle
_SHORTEST = 60.0  # s: of a stretch of the march; it has `_CYCLES`, too
_CYCLES = 40.0  # at the frequency at which the inner loop first becomes unstable
_FEWEST, _MOST_PERIODS = 100, 20_000  # guidance periods of a stretch, whatever its time
_STRETCHES = 5  # at most
_ALIKE = 0.1  # largest relative difference of the command's range between two stretches of a steady motion
_FACTOR = 4.0  # on the gain, from one step to the next, until the limit cycle begins or ends
MOST = 1e3  # times more or less gain: there is no border then
_EXACT = 1.01  # a border is found to within this factor


class UnsettledError(ValueError):
    """A march ended without an answer; the message says why."""


class LoopMotion(NamedTuple):
    """The last stretch of a march, a value per guidance period. SI, rad."""

    e: Array  # heading error
    r: Array  # range error
    u: Array  # command

    @property
    def rests(self) -> bool:
        """Whether the command oscillates by less than `VISIBLE`: there is no limit cycle."""
        return bool(np.ptp(self.u) < 2.0 * VISIBLE)


@lru_cache(maxsize=64)
def settled(loop: Loop) -> LoopMotion:
    """How the loop moves in the end. Raises `UnsettledError` and `LawFailed`."""
    F, g, H = matrices(loop)
    command, n = loop.started(), _periods(loop)
    x = np.zeros(len(F))
    x[np.argmax(H[1])] = _START / loop.airspeed
    ranges = [0.0]
    while len(ranges) <= _STRETCHES:
        rows = np.empty((n, 3))
        for i in range(n):
            e, r = (H @ x).tolist()
            if abs(e) > math.pi:
                raise UnsettledError("simulated in time, the loop leaves its circle")
            u = command(e, r)
            rows[i] = e, r, u
            x = F @ x + g * (u - loop.turn)
        motion = LoopMotion(*rows.T)
        ranges.append(float(np.ptp(motion.u)))
        if motion.rests or abs(ranges[-1] - ranges[-2]) <= _ALIKE * ranges[-1]:
            return motion
    if all(later < earlier for earlier, later in pairwise(ranges[1:])):
        raise UnsettledError(f"simulated over {_STRETCHES * n * loop.period:.0f} s, the loop is still settling")
    return motion  # it oscillates irregularly


def marched_margin(loop: Loop) -> float:
    """The factor on the law's gain from which on the loop does not rest, to 1 %.

    0 where it does not rest with a thousandth of the gain either, inf where it rests with a thousand times the gain.
    Raises `UnsettledError` and `LawFailed`.
    """

    def rests(times: float) -> bool:
        return settled(replace(loop, gain=times * loop.gain)).rests

    calm, beyond = rests(1.0), 1.0
    step = _FACTOR if calm else 1.0 / _FACTOR
    while rests(beyond) is calm:
        beyond *= step
        if not 1.0 / MOST < beyond < MOST:
            return math.inf if calm else 0.0
    low, high = sorted((beyond / step, beyond))
    while high > _EXACT * low:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if rests(middle) else (low, middle)
    return high


def matrices(loop: Loop) -> tuple[Array, Array, Array]:
    """The sampled response as matrices: of the states, of the command, and from the states to (heading, range) error.

    Shapes (n, n), (n,), (2, n). The states are those of `held`, then the commands that still wait, latest first.
    """
    periods, step, now, earlier = held(loop.response, loop.period)
    n = len(step)
    m = n + periods + 1
    F, g, H = np.zeros((m, m)), np.zeros(m), np.zeros((2, m))
    F[:n, :n], F[:n, -1] = step, earlier
    if periods:
        F[:n, -2] = now
    else:
        g[:n] = now
    g[n] = 1.0
    F[range(n + 1, m), range(n, m - 1)] = 1.0
    H[0, n - 2], H[1, n - 1] = 1.0, loop.airspeed
    return F, g, H


def _periods(loop: Loop) -> int:
    """How many guidance periods a stretch of the march has."""
    omega = critical_gain(loop.response, loop.period)[1]
    lasts = max(_SHORTEST, _CYCLES * math.tau / omega)
    return min(max(_FEWEST, math.ceil(lasts / loop.period)), _MOST_PERIODS)
