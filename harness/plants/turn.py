"""The coordinated turn: heading rate = g tan(bank) / V (Beard & McLain, Eq. 5.1.3-15; level, no sideslip)."""

import math

import numpy as np
from numpy.typing import NDArray

GRAVITY = 9.80665  # m/s^2, standard


def bank_of_turn(airspeed: float, heading_rate: float) -> float:
    """The bank, rad, of a coordinated turn at this airspeed, m/s, and heading rate, rad/s: positive to the right."""
    return math.atan(airspeed * heading_rate / GRAVITY)


def banks_of_turns(airspeed: NDArray[np.float64], heading_rate: NDArray[np.float64]) -> NDArray[np.float64]:
    """`bank_of_turn` of arrays, element by element; bit for bit the same numbers."""
    banks: NDArray[np.float64] = np.vectorize(bank_of_turn, otypes=[np.float64])(airspeed, heading_rate)
    return banks


def rate_of_turn(airspeed: NDArray[np.float64], bank: NDArray[np.float64]) -> NDArray[np.float64]:
    """The heading rate, rad/s, of a coordinated turn at this airspeed, m/s, and bank, rad."""
    rate: NDArray[np.float64] = GRAVITY * np.tan(bank) / airspeed
    return rate
