"""Angles, on plain floats."""

import math


def wrap(angle: float) -> float:
    """The same direction in [-pi, pi). `angle` in rad; exact (returned as it is) when already inside."""
    if -math.pi <= angle < math.pi:
        return angle
    wrapped = math.remainder(angle, math.tau)
    return wrapped if wrapped < math.pi else -math.pi
