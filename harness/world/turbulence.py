"""Turbulence: the Dryden model of MIL-F-8785C at low altitude, as velocities and rotations of the air.

The gust field is frozen and traversed at the nominal airspeed V: a wave number W (rad/m) is met as the frequency
w = V W (rad/s). Spectra are one-sided, per rad/s: their integral from 0 to infinity is the variance. The standard's
empirical formulas take the height in feet; that conversion is the only one here.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.linalg import cholesky, expm, solve_continuous_lyapunov
from scipy.signal import lfilter

from harness.world.air import Array
from harness.world.randomness import stream
from harness.world.wind import SEVERITIES

FOOT = 0.3048  # m, for the standard's formulas
LEAD = 2.0  # s: the field begins this long before the flight, so that the filters of the rotation have settled


@dataclass(frozen=True, slots=True)
class Dryden:
    """The Dryden model at one airspeed V, m/s, and altitude: intensities sigma in m/s, scale lengths L in m."""

    V: float
    sigma_w: float
    sigma_u: float  # of u and v alike
    L_w: float
    L_u: float  # of u and v alike

    def along(self, omega: Array) -> Array:
        """Spectrum of u, along the mean wind, (m/s)^2 per rad/s; `omega` in rad/s."""
        T = self.L_u / self.V
        return np.asarray(2.0 * self.sigma_u**2 * T / np.pi / (1.0 + (T * omega) ** 2))

    def across(self, omega: Array) -> Array:
        """Spectrum of v, across the mean wind, horizontal."""
        return _transverse(self.sigma_u, self.L_u / self.V, omega)

    def vertical(self, omega: Array) -> Array:
        """Spectrum of w."""
        return _transverse(self.sigma_w, self.L_w / self.V, omega)

    def roll(self, omega: Array, span: float) -> Array:
        """Spectrum of the roll rate p, (rad/s)^2 per rad/s, over a wing of this span, m."""
        low = self.sigma_w**2 / (self.V * self.L_w) * 0.8 * (math.pi * self.L_w / (4.0 * span)) ** (1.0 / 3.0)
        return np.asarray(low / (1.0 + (self.lag(4, span) * omega) ** 2))

    def pitch(self, omega: Array, span: float) -> Array:
        """Spectrum of the pitch rate q."""
        return (omega / self.V) ** 2 / (1.0 + (self.lag(4, span) * omega) ** 2) * self.vertical(omega)

    def yaw(self, omega: Array, span: float) -> Array:
        """Spectrum of the yaw rate r, in flight along the mean wind."""
        return (omega / self.V) ** 2 / (1.0 + (self.lag(3, span) * omega) ** 2) * self.across(omega)

    def lag(self, n: int, span: float) -> float:
        """The time constant, s, of the wing's averaging over n b / pi metres."""
        return n * span / (math.pi * self.V)


def _transverse(sigma: float, T: float, omega: Array) -> Array:
    x = (T * omega) ** 2
    return sigma**2 * T / np.pi * (1.0 + 3.0 * x) / (1.0 + x) ** 2


def dryden(severity: str, airspeed: float, altitude: float) -> Dryden:
    """MIL-F-8785C, 3.7.3.4, low altitude: scale lengths and intensities from the height above ground, m."""
    h = altitude / FOOT
    shape = 0.177 + 0.000823 * h
    sigma_w = 0.1 * SEVERITIES[severity]
    return Dryden(airspeed, sigma_w, sigma_w / shape**0.4, altitude, altitude / shape**1.2)


@dataclass(frozen=True, slots=True, eq=False)
class Turbulence:
    """One realisation of the model on a grid of steps of `step` seconds; its first `lead` rows precede the flight."""

    model: Dryden
    seed: int
    step: float
    lead: int
    velocity: Array  # (lead + steps + 1, 3): north, east, down, m/s

    def rotation(self, span: float) -> Array:
        """The rotation of the air over a wing of this span, m, at each step of the flight: (steps + 1, 4), rad/s.

        The columns are roll rate p, pitch rate q, and the gradients along the path of the velocities north and east,
        from which the yaw rate is r = east cos(yaw) - north sin(yaw). In a rotation -q = dw/dx and r = dv/dx (x ahead,
        y right, z down); in a frozen field d/dx is d/dt over V.
        """
        model, rows = self.model, len(self.velocity)
        horizontal = _gradient(self.velocity[:, :2], model.V, model.lag(3, span), self.step)
        pitch = -_gradient(self.velocity[:, 2:], model.V, model.lag(4, span), self.step)
        T_p = model.lag(4, span)
        sigma_p = math.sqrt(math.pi / 2.0 / T_p * model.roll(np.zeros(1), span)[0])
        noise = stream(self.seed, "turbulence, roll").standard_normal((rows, 1))
        roll = sigma_p * _first_order(T_p, self.step, noise)
        return np.column_stack([roll, pitch, horizontal])[self.lead :]


def turbulence(model: Dryden, towards: float, seed: int, step: float, steps: int) -> Turbulence:
    """The turbulence of a seed; u is along the direction `towards` of the mean wind, rad, clockwise from north.

    It depends on neither plant nor law. A longer flight begins with the turbulence of a shorter one.
    """
    lead = math.ceil(LEAD / step)
    noise = stream(seed, "turbulence").standard_normal((lead + steps + 1, 5))
    u = model.sigma_u * _first_order(model.L_u / model.V, step, noise[:, :1])
    v = model.sigma_u * _second_order(model.L_u / model.V, step, noise[:, 1:3])
    w = model.sigma_w * _second_order(model.L_w / model.V, step, noise[:, 3:])
    c, s = math.cos(towards), math.sin(towards)
    return Turbulence(model, seed, step, lead, np.column_stack([c * u - s * v, s * u + c * v, w]))


def _first_order(T: float, step: float, noise: Array) -> Array:
    """White noise of unit intensity through sqrt(2 T) / (1 + T s): variance 1."""
    return math.sqrt(2.0 * T) * _lagged(T, step, noise)[:, 0]


def _second_order(T: float, step: float, noise: Array) -> Array:
    """White noise of unit intensity through sqrt(T) (1 + sqrt(3) T s) / (1 + T s)^2: variance 1."""
    once, twice = _lagged(T, step, noise).T
    return np.asarray(math.sqrt(T) * (math.sqrt(3.0) * once + (1.0 - math.sqrt(3.0)) * twice))


def _lagged(T: float, step: float, noise: Array) -> Array:
    """White noise of unit intensity through 1 / (1 + T s) once, twice, and so on; stationary from the first step.

    `noise` is standard normal, one row per step and one column per lag; the result has the same shape. Exact.
    """
    lags = lag_chain(T, noise.shape[1], step)
    x = np.asfortranarray(noise @ lags.added.T)
    x[0] = lags.stationary @ noise[0]
    for i, row in enumerate(lags.transition):
        x[1:, i] += x[:-1, :i] @ row[:i]
        x[:, i] = lfilter([1.0], [1.0, -row[i]], x[:, i])
    return x


class LagChain(NamedTuple):
    """One step of equal first-order lags in series, driven by white noise. All three are lower triangular."""

    transition: Array
    added: Array  # Cholesky factor of the covariance that the noise adds in one step
    stationary: Array  # Cholesky factor of the stationary covariance


@lru_cache(maxsize=64)
def lag_chain(T: float, order: int, step: float) -> LagChain:
    """The system x' = A x + B (white noise of unit intensity), discretised exactly (Van Loan, 1978). T, step in s."""
    A, B = (np.eye(order, k=-1) - np.eye(order)) / T, np.eye(order, 1) / T
    both = expm(np.block([[-A, B @ B.T], [np.zeros_like(A), A.T]]) * step)
    transition = both[order:, order:].T
    stationary = solve_continuous_lyapunov(A, -B @ B.T)
    return LagChain(
        transition, cholesky(transition @ both[:order, order:], lower=True), cholesky(stationary, lower=True)
    )


def _gradient(velocity: Array, V: float, lag: float, step: float) -> Array:
    """The gradient of velocities along the path, 1/s, through 1 / (1 + lag s). Exact: they are linear in a step."""
    share = -math.expm1(-step / lag)
    weight = share / (step * V)
    return np.asarray(lfilter([weight, -weight], [1.0, share - 1.0], velocity - velocity[0], axis=0))
