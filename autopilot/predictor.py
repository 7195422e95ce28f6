"""What a law's own commands still do: the identified response run alongside, and the disturbance that it leaves.

A command u beyond the feed-forward reaches the heading error e through the identified response G^, whose static gain is
one: e' = G^ u + w, with a disturbance w. What u has commanded and the aircraft has not yet turned,

    d = integral of (u - G^ u) dt = -c A^-1 x + integral of u over the delay,

is a function of the response's states x alone, so it never drifts, and is zero on the circle, where u is.
"""

from collections.abc import Callable
from math import exp, expm1, isnan, nan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from autopilot.angles import wrap
from autopilot.linear import Array, Linear
from autopilot.response import Response, Rows, dot, held, moved_on

Predicted = tuple[tuple[float, ...], tuple[float, ...], float, float, float]
"""The response's states x; the commands that still act, oldest first, rad/s; d, rad; w, rad/s; the heading error that
is expected now, rad, NaN before the first."""


class Predictor(NamedTuple):
    """The response to commands held for a period, as pure functions: exact at the sampling instants, for any delay."""

    start: Predicted  # at rest
    seen: Callable[[Predicted, float], Predicted]  # with the heading error of this moment, rad
    commanded: Callable[[Predicted, float], Predicted]  # a period later, with its command u, rad/s


def predictor(response: Response | None, period: float, smoothing: float) -> Predictor:
    """The predictor for commands held for `period`, s.

    Without a response the heading rate is its command. The disturbance is the rate of the heading error beyond the
    response, through a lag of `smoothing`, s.
    """
    periods, rows, turn, due, late = _rows(response, period)
    after, share = _after(rows, due), -expm1(-period / smoothing) if smoothing else 1.0

    def seen(now: Predicted, heading_error: float) -> Predicted:
        x, commands, d, w, expected = now
        if not isnan(expected):
            w += share * (wrap(heading_error - expected) / period - w)
        return x, commands, d, w, heading_error

    def commanded(now: Predicted, u: float) -> Predicted:
        x, commands, _, w, expected = now
        before, commands = commands[0], (*commands[1:], u)
        vector = (*x, commands[0], before)
        x, d = after(vector)
        waiting = period * (sum(commands) - commands[0]) + late * commands[0]
        return x, commands, d + waiting, w, expected + dot(turn, vector)

    return Predictor(((0.0,) * len(rows), (0.0,) * (periods + 1), 0.0, 0.0, nan), seen, commanded)


def _after(rows: Rows, due: tuple[float, ...]) -> Callable[[tuple[float, ...]], tuple[tuple[float, ...], float]]:
    """From what the rows multiply to the states after a period and d of them alone: see `_rows`."""

    def after(vector: tuple[float, ...]) -> tuple[tuple[float, ...], float]:
        x = moved_on(rows, vector)
        return x, dot(due, x)

    def without_response(vector: tuple[float, ...]) -> tuple[tuple[float, ...], float]:
        return (), 0.0

    return after if rows else without_response


def states(now: Predicted) -> tuple[float, ...]:
    """The response's states, then the commands that still act, latest first: those of `model`."""
    x, commands, _, _, _ = now
    return (*x, *commands[::-1])


def _rows(response: Response | None, period: float) -> tuple[int, Rows, tuple[float, ...], tuple[float, ...], float]:
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
        """The law from (e, r) to u as a `Predictor` flies it behind `plant`, a `model`.

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
