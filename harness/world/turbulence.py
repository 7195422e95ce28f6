"""Turbulence: the Dryden model of MIL-F-8785C at low altitude, as velocities and rotations of the air met in flight.

The gust field is frozen and met at the nominal airspeed V: a wave number W (rad/m) is the frequency w = V W (rad/s).
Spectra are one-sided, per rad/s: their integral from 0 to infinity is the variance. Feet are those of the standard's
empirical formulas alone.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from scipy.linalg import cholesky, expm, solve_continuous_lyapunov
from scipy.signal import lfilter

from harness.world.air import Array
from harness.world.randomness import stream

KNOT = 0.514444  # m/s
FOOT = 0.3048  # m
# The wind 20 ft above the ground that stands for each severity.
W20 = MappingProxyType({"light": 15.0 * KNOT, "moderate": 30.0 * KNOT, "severe": 45.0 * KNOT})
LEAD = 2.0  # s that the field is begun before the flight, for filters of the rotation to forget their start


@dataclass(frozen=True, slots=True)
class Dryden:
    """The model at one airspeed and altitude: intensities in m/s, scale lengths in m."""

    V: float
    sigma_w: float
    sigma_u: float  # of u and v alike
    L_w: float
    L_u: float  # of u and v alike

    def along(self, omega: Array) -> Array:
        """Spectrum of u, along the mean wind."""
        T = self.L_u / self.V
        return np.asarray(2.0 * self.sigma_u**2 * T / np.pi / (1.0 + (T * omega) ** 2))

    def across(self, omega: Array) -> Array:
        """Spectrum of v, across the mean wind, horizontal."""
        return _transverse(self.sigma_u, self.L_u / self.V, omega)

    def vertical(self, omega: Array) -> Array:
        """Spectrum of w."""
        return _transverse(self.sigma_w, self.L_w / self.V, omega)

    def roll(self, omega: Array, span: float) -> Array:
        """Spectrum of p."""
        low = self.sigma_w**2 / (self.V * self.L_w) * 0.8 * (math.pi * self.L_w / (4.0 * span)) ** (1.0 / 3.0)
        return np.asarray(low / (1.0 + (self.lag(4, span) * omega) ** 2))

    def pitch(self, omega: Array, span: float) -> Array:
        """Spectrum of q."""
        return (omega / self.V) ** 2 / (1.0 + (self.lag(4, span) * omega) ** 2) * self.vertical(omega)

    def yaw(self, omega: Array, span: float) -> Array:
        """Spectrum of r, of flight along the mean wind."""
        return (omega / self.V) ** 2 / (1.0 + (self.lag(3, span) * omega) ** 2) * self.across(omega)

    def lag(self, n: int, span: float) -> float:
        """What the wing averages over, n b / pi, as a time constant."""
        return n * span / (math.pi * self.V)


def _transverse(sigma: float, T: float, omega: Array) -> Array:
    x = (T * omega) ** 2
    return sigma**2 * T / np.pi * (1.0 + 3.0 * x) / (1.0 + x) ** 2


def dryden(severity: str, airspeed: float, altitude: float) -> Dryden:
    """MIL-F-8785C, 3.7.3.4, low altitude: scale lengths and intensities from the height above ground."""
    h = altitude / FOOT
    shape = 0.177 + 0.000823 * h
    sigma_w = 0.1 * W20[severity]
    return Dryden(airspeed, sigma_w, sigma_w / shape**0.4, altitude, altitude / shape**1.2)


@dataclass(frozen=True, slots=True, eq=False)
class Turbulence:
    """One realisation of the model on a grid of steps; begun `lead` rows before the flight."""

    model: Dryden
    seed: int
    step: float
    lead: int
    velocity: Array  # (lead + steps + 1, 3): north, east, down, m/s

    def rotation(self, span: float) -> Array:
        """The air's rotation as a wing of this span (m) meets it, rad/s: (steps + 1, 4).

        Its columns: roll rate p; pitch rate q; and the gradients along the path of the velocities north and east,
        which make the yaw rate r = east cos(yaw) - north sin(yaw). In a rotation, -q = dw/dx and r = dv/dx (x ahead,
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
    """The turbulence that a seed makes, its axes along the mean wind's direction `towards` (rad, from north).

    The same for whatever flies in it; a longer flight's begins as a shorter one's does.
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
    """White noise of unit intensity through 1 / (1 + T s) once, twice and so on: exact, stationary from the first step.

    `noise` is standard normal; a row per step, a column per lag.
    """
    lags = lag_chain(T, noise.shape[1], step)
    x = np.asfortranarray(noise @ lags.added.T)
    x[0] = lags.stationary @ noise[0]
    for i, row in enumerate(lags.transition):
        x[1:, i] += x[:-1, :i] @ row[:i]
        x[:, i] = lfilter([1.0], [1.0, -row[i]], x[:, i])
    return x


class LagChain(NamedTuple):
    """Equal lags in a row behind white noise, over one step: lower triangular all."""

    transition: Array
    added: Array  # Cholesky factor of the covariance that the noise adds in the step
    stationary: Array  # Cholesky factor of the covariance that remains as it is


@lru_cache(maxsize=64)
def lag_chain(T: float, order: int, step: float) -> LagChain:
    """X' = A x + B (white noise of unit intensity), discretised exactly (Van Loan, 1978)."""
    A, B = (np.eye(order, k=-1) - np.eye(order)) / T, np.eye(order, 1) / T
    both = expm(np.block([[-A, B @ B.T], [np.zeros_like(A), A.T]]) * step)
    transition = both[order:, order:].T
    stationary = solve_continuous_lyapunov(A, -B @ B.T)
    return LagChain(
        transition, cholesky(transition @ both[:order, order:], lower=True), cholesky(stationary, lower=True)
    )


def _gradient(velocity: Array, V: float, lag: float, step: float) -> Array:
    """The velocities' slope along the path through 1 / (1 + lag s): exact for straight lines between steps."""
    share = -math.expm1(-step / lag)
    weight = share / (step * V)
    return np.asarray(lfilter([weight, -weight], [1.0, share - 1.0], velocity - velocity[0], axis=0))
