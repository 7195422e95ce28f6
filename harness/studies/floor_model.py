"""The floor in closed form: the least range error of any law on a circle in a disturbance.

On its circle an aircraft has the range error e, the heading error theta and the identified response x to a command u,
all small; V is its mean speed over the ground, d what the turbulence adds to the rate of the heading error:

    e' = V theta,   theta' = c x + d - (V / R_d^2) e,   x' = A x + b u(t - delay)

The command is held for a period, and d is an autoregression. A law that knows all of it, the present d too, and that
minimises E[e^2] + rho E[(u_k - u_k-1)^2] is linear; each rho gives a point of the floor, by a Riccati and a Lyapunov
equation. Activity is E|u_k - u_k-1| / T, of a Gaussian number sqrt(2 / pi) times its deviation.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm, solve_discrete_are, solve_discrete_lyapunov
from scipy.signal import freqz, lfilter

from autopilot.response import Response
from harness.world.randomness import stream

Array = NDArray[np.float64]

PERIOD = 0.05  # s, between two commands
ORDER = 40  # of the autoregression: 2 s; with 20 or 60 the floor moves by 3 % at most
# rho over V^2, s^2; with more the loop takes longer than 5 s: its floor would rest on what is below 0.03 Hz, of which
# the flights show too little
WEIGHTS = np.geomspace(1e-4, 1e4, 33)


class Autoregression(NamedTuple):
    """The rate of the heading error that turbulence adds: an autoregression, each value held for a period."""

    coefficients: Array  # of the values before, the latest first
    deviation: float  # rad/s, of what is new in a period
    residual: Array  # what was new, in the flights it was fitted to, rad/s

    def drawn(self, count: int, seed: int) -> Array:
        """A realisation, rad/s."""
        settled = 20 * len(self.coefficients) + 1000
        noise = self.deviation * stream(seed, "floor").standard_normal(settled + count)
        return np.asarray(lfilter([1.0], [1.0, *-self.coefficients], noise))[settled:]

    def spectrum(self, hertz: Array, period: float) -> Array:
        """One-sided, (rad/s)^2 per Hz."""
        _, shape = freqz([1.0], [1.0, *-self.coefficients], worN=hertz, fs=1.0 / period)
        return np.asarray(2.0 * period * self.deviation**2 * np.abs(shape) ** 2)


def fitted(series: Sequence[Array], order: int = ORDER) -> Autoregression:
    """The autoregression of these series, rad/s, by least squares; their common mean is left out."""
    mean = np.mean([x.mean() for x in series])
    centred = [x - mean for x in series]
    before = np.concatenate([np.lib.stride_tricks.sliding_window_view(x[:-1], order)[:, ::-1] for x in centred])
    now = np.concatenate([x[order:] for x in centred])
    coefficients = np.linalg.lstsq(before, now, rcond=None)[0]
    residual = now - before @ coefficients
    return Autoregression(coefficients, float(np.sqrt(np.mean(residual**2))), residual)


class Circle(NamedTuple):
    """What an aircraft on its circle answers to a command. SI."""

    response: Response
    speed: float  # over the ground
    standoff: float
    period: float = PERIOD


class CircleModel(NamedTuple):
    """z' = F z + g v + h (what is new of d), of a period, with the change v of the command.

    z is (range error, heading error, response, the latest commands, the present and former values of d).
    """

    F: Array
    g: Array
    h: Array
    known: int  # of z's numbers: all but the disturbance


def model(circle: Circle, disturbance: Autoregression) -> CircleModel:
    """The circle and its disturbance, exact between two commands."""
    A, b, c = circle.response.matrices()
    n, T, V = 2 + len(b), circle.period, circle.speed
    system = np.zeros((n + 2, n + 2))  # with command and disturbance as states at rest
    system[0, 1], system[1, 0], system[1, 2:n], system[1, n + 1] = V, -V / circle.standoff**2, c, 1.0
    system[2:n, 2:n], system[2:n, n] = A, b
    periods = math.floor(circle.response.delay / T)
    late = circle.response.delay - periods * T
    before, after = expm(system * late), expm(system * (T - late))
    step = (after @ before)[:n]

    kept, order = periods + 1, len(disturbance.coefficients)
    size = n + kept + order
    F, g, h = np.zeros((size, size)), np.zeros(size), np.zeros(size)
    F[:n, :n], F[:n, n + kept] = step[:, :n], step[:, n + 1]
    acting = np.zeros((n, kept + 1))  # of the command of this period, and of those before
    acting[:, periods], acting[:, periods + 1] = after[:n, n], after[:n, :n] @ before[:n, n]
    F[:n, n : n + kept] = acting[:, 1:]
    F[:n, n] += acting[:, 0]  # u = the latest command + v
    g[:n] = acting[:, 0]
    F[n, n] = g[n] = 1.0
    F[range(n + 1, n + kept), range(n, n + kept - 1)] = 1.0
    F[n + kept, n + kept :] = disturbance.coefficients
    F[range(n + kept + 1, size), range(n + kept, size - 1)] = 1.0
    h[n + kept] = disturbance.deviation
    return CircleModel(F, g, h, n + kept)


class Optimum(NamedTuple):
    """The optimal law of a weight rho, and what it comes to."""

    weight: float  # rho, m^2 s^2
    error: float  # m rms
    activity: float  # deg/s^2
    gains: Array  # v = -gains z


def optimal(of: CircleModel, weight: float, period: float = PERIOD) -> Optimum:
    """The law that knows everything, and its range error and activity, in closed form."""
    F, g, h, _ = of
    Q = np.zeros_like(F)
    Q[0, 0] = 1.0
    P = solve_discrete_are(F, g[:, np.newaxis], Q, np.array([[weight]]))
    gains = np.asarray(g @ P @ F / (weight + g @ P @ g))
    S = solve_discrete_lyapunov(F - np.outer(g, gains), np.outer(h, h))
    change = math.sqrt(gains @ S @ gains)
    return Optimum(weight, math.sqrt(S[0, 0]), math.degrees(math.sqrt(2.0 / math.pi) * change) / period, gains)


def front(circle: Circle, disturbance: Autoregression) -> list[Optimum]:
    """The floor, from the most active law to the least."""
    of = model(circle, disturbance)
    return [optimal(of, float(weight) * circle.speed**2, circle.period) for weight in WEIGHTS]


def between(x: float, known: Sequence[tuple[float, float]]) -> float:
    """Y at x on a curve of points (x, y), straight on logarithmic axes; level beyond its ends."""
    xs, ys = np.log(sorted(known)).T
    return math.exp(float(np.interp(math.log(x), xs, ys))) if x > 0.0 else math.inf


def error_at(points: Sequence[Optimum], activity: float) -> float:
    """The least range error, m rms, at this activity, deg/s^2."""
    return between(activity, [(point.activity, point.error) for point in points])
