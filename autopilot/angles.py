"""Arithmetic of angles, on plain floats."""

import math


def wrap(angle: float) -> float:
    """The same direction in [-pi, pi), rad. An angle already inside is returned unchanged."""
    if -math.pi <= angle < math.pi:
        return angle
    wrapped = math.remainder(angle, math.tau)
    return wrapped if wrapped < math.pi else -math.pi
