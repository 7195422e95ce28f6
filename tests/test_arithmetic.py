"""Compiled arithmetic: the bits and the errors of Python's."""

import math
import random
from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np
import pytest

from autopilot.response import dot
from harness.compiled import arithmetic

TWO = ("atan2", "copysign", "remainder", "fmod", "hypot", "power")


ONE = ("sin", "cos", "tan", "asin", "atan", "exp", "log", "log1p", "sqrt", "radians")


@pytest.mark.parametrize("name", [*ONE, *TWO])
def test_compiled_arithmetic_has_the_bits_of_python_and_raises_where_python_does(name: str) -> None:
    draw = random.Random(name)
    python: Callable[..., Any] = pow if name == "power" else getattr(math, name)

    def number() -> float:
        return draw.choice([1.0, -1.0, 0.0]) * math.exp(draw.uniform(-14.0, 14.0))

    def outcome(function: Callable[..., Any], *arguments: float) -> object:
        try:
            made = function(*arguments)
        except (ValueError, ArithmeticError):
            return "raises"
        return "raises" if isinstance(made, complex) else made

    for _ in range(5000):
        arguments = [number() for _ in range(2 if name in TWO else 1)]
        if name == "power" and draw.random() < 0.5:
            arguments[1] = 2.0  # which a compiler knows as a product
        made = outcome(getattr(arithmetic, name), *arguments)
        assert made == outcome(python, *arguments), arguments
    others = () if name in ("remainder", "fmod") else (math.inf, -math.inf, math.nan)  # those are left to Python
    for special in product((0.0, -0.0, 1.0, -1.0, *others), repeat=len(arguments)):
        made, of_python = (outcome(function, *special) for function in (getattr(arithmetic, name), python))
        assert made == of_python or (made != made and of_python != of_python), special


def test_compiled_sums_have_the_bits_of_python() -> None:
    draw = random.Random(0)
    for _ in range(2000):
        row, values = ([draw.choice([-1.0, 1.0]) * math.exp(draw.uniform(-9.0, 9.0)) for _ in range(9)] for _ in "ab")
        assert arithmetic.added(np.array(values)) == sum(values)
        assert arithmetic.dot(np.array(row), np.array(values)) == dot(row, values)
