"""Conversion of a number from SI to the unit of its key in a file."""

import math

from autopilot.quantities import Unit


def in_file(value: float, unit: Unit) -> float:
    """The shortest number in `unit` that converts back to exactly this SI value; the quotient if there is none."""
    if unit.si == 1.0:
        return value
    quotient = value / unit.si
    below, above = math.nextafter(quotient, -math.inf), math.nextafter(quotient, math.inf)
    near = [float(f"{quotient:.15g}"), float(f"{quotient:.16g}"), quotient, below, above]
    near += [math.nextafter(below, -math.inf), math.nextafter(above, math.inf)]
    return next((number for number in near if number * unit.si == value), quotient)
