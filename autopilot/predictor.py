"""What a law's own commands still do: the identified response run alongside, and the disturbance that it leaves.

A command u beyond the feed-forward reaches the heading error e through the identified response G^, whose static gain is
one: e' = G^ u + w, with a disturbance w. What u has commanded and the aircraft has not yet turned,

    d = integral of (u - G^ u) dt = -c A^-1 x + integral of u over the delay,

is a function of the response's states x alone, so it never drifts, and is zero on the circle, where u is.
"""

from collections import deque
from math import exp, expm1
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from autopilot.angles import wrap
from autopilot.linear import Array, Linear
from autopilot.response import Response, dot, held


class Predictor:
    """The response to commands held for `period`, s, started at rest: exact at the sampling instants, for any delay.

    Without a response the heading rate is its command. The disturbance is the rate of the heading error beyond the
    response, through a lag of `smoothing`, s. Call `seen` with every heading error, rad, then `commanded` with the
    command that it led to, rad/s.
    """

    def __init__(self, response: Response | None, period: float, smoothing: float) -> None:
        periods, self._rows, self._turn, self._due, self._late = _rows(response, period)
        self._period, self._share = period, -expm1(-period / smoothing) if smoothing else 1.0
        self._states: tuple[float, ...] = (0.0,) * len(self._rows)
        self._commands = deque([0.0] * (periods + 1), periods + 1)  # those that still wait, oldest first
        self._expected: float | None = None
        self.due = 0.0  # d, rad
        self.disturbance = 0.0  # w, rad/s

    @property
    def states(self) -> tuple[float, ...]:
        """The response's states, then the commands that still act, latest first: those of `model`."""
        return (*self._states, *reversed(self._commands))

    def seen(self, heading_error: float) -> None:
        """Takes the heading error of this moment."""
        if self._expected is not None:
            rate = wrap(heading_error - self._expected) / self._period
            self.disturbance += self._share * (rate - self.disturbance)
        self._expected = heading_error

    def commanded(self, u: float) -> None:
        """Takes the command of the coming period, and moves to its end."""
        commands = self._commands
        before = commands[0]
        commands.append(u)
        now = (*self._states, commands[0], before)
        if self._expected is not None:
            self._expected += dot(self._turn, now)
        self._states = tuple([dot(row, now) for row in self._rows])
        waiting = self._period * (sum(commands) - commands[0]) + self._late * commands[0]
        self.due = dot(self._due, self._states) + waiting


def _rows(
    response: Response | None, period: float
) -> tuple[int, tuple[tuple[float, ...], ...], tuple[float, ...], tuple[float, ...], float]:
    """The whole periods in the delay, and the rows that multiply (states, command that begins to act, one before it).

    They give the states after a period and the turn in it; then the row of d, and what is left of the delay, s. Without
    a response the heading rate is its command.
    """
    if response is None:
        return 0, (), (period, 0.0), (), 0.0
    periods, step, now, earlier = held(response, period)
    A, _, c = response.matrices()
    n = len(c)
    rows = np.column_stack([step[: n + 1, :n], now[: n + 1], earlier[: n + 1]])
    due = -np.linalg.solve(A.T, c)
    late = response.delay - periods * period
    return periods, tuple(map(_floats, rows[:n])), _floats(rows[n]), _floats(due), late


def _floats(row: NDArray[np.floating]) -> tuple[float, ...]:
    return tuple(float(value) for value in row)


def model(response: Response | None, period: float) -> Linear:
    """The same as matrices: from the command u to the turn in a period and to d; d before u acts. See `states`."""
    periods, rows, turn, due, late = _rows(response, period)
    n, m = len(rows), len(rows) + periods + 1
    A, B, C, D = np.zeros((m, m)), np.zeros((m, 1)), np.zeros((2, m)), np.zeros((2, 1))
    both = np.array([*rows, turn])
    A[:n, :n], C[0, :n], C[1, :n] = both[:n, :n], both[n, :n], due
    A[:n, m - 1], C[0, m - 1] = both[:n, n + 1], both[n, n + 1]  # the command that ends to act within the period
    if periods:
        A[:n, m - 2], C[0, m - 2] = both[:n, n], both[n, n]
    else:
        B[:n, 0], D[0, 0] = both[:n, n], both[n, n]
    B[n, 0] = 1.0
    A[range(n + 1, m), range(n, m - 1)] = 1.0
    C[1, n : m - 1], C[1, m - 1] = period, late
    return Linear(A, B, C, D)


def faded(time: float, correlation: float) -> tuple[float, float]:
    """What is left of a disturbance after `time`, s, and its integral until then, s: of an AR(1) of unit size."""
    left = exp(-time / correlation)
    return left, correlation * (1.0 - left)


class Feedback(NamedTuple):
    """u = -e e - r r - states . x - disturbance w: gains of heading error, range error, states of `model`, and w."""

    e: float
    r: float
    states: Array
    disturbance: float

    def linear(self, plant: Linear, period: float, smoothing: float) -> Linear:
        """The law from (e, r) to u as `Predictor` flies it behind `plant`, a `model`.

        Its states are those of the model, w, and the heading error that is expected next.
        """
        share = -expm1(-period / smoothing) if smoothing else 1.0
        m = len(plant.A)
        w = np.concatenate([np.zeros(m), [1.0 - share, -share / period]])  # now, of the states
        w_e = share / period  # and of e
        C = -self.disturbance * w
        C[:m] -= self.states
        D = np.array([[-self.e - self.disturbance * w_e, -self.r]])
        A, B = np.zeros((m + 2, m + 2)), np.zeros((m + 2, 2))
        A[:m, :m], A[m], A[m + 1, :m] = plant.A, w, plant.C[0]
        B[m, 0], B[m + 1, 0] = w_e, 1.0
        by_u = np.concatenate([plant.B[:, 0], [0.0, plant.D[0, 0]]])[:, np.newaxis]
        return Linear(A + by_u * C, B + by_u * D, C[np.newaxis], D)


def with_feed_forward(law: Linear, v_a: float, R_d: float) -> Linear:
    """A law from (e, r) to its command beyond the feed-forward, and with it: lam_dot changes by v_a / R_d^2 of r."""
    return law._replace(D=law.D + np.array([[0.0, v_a / R_d**2]]))
