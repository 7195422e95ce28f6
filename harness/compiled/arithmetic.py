"""Python's arithmetic for compiled functions: the bits and the errors of `math`, `**`, `min`, `max` and `sum`.

Mathematical functions are those of the C library that this Python calls, under names of their own: by its name `pow`
the compiler would know it and put a product in its place. What is not a number raises, as in Python.
"""

import ctypes
import math
import sys
from collections.abc import Callable
from typing import Any, TypeVar

import llvmlite.binding
import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic

Function = TypeVar("Function", bound=Callable[..., Any])

nan, inf, minus_inf = math.nan, math.inf, -math.inf
_PREFIX = "standoff_harness_"
_DOUBLE = ir.DoubleType()
_PURE = ("nounwind", "readnone")  # of a function: equal calls are one


def jit(function: Function) -> Function:
    """The function compiled: when it is first called, or called by a compiled one."""
    made: Function = njit(function)
    return made


def _known_to_the_compiler(name: str) -> str:
    """The name in compiled code of the C library's function of this name."""
    address = ctypes.cast(getattr(ctypes.CDLL(None), name), ctypes.c_void_p).value
    llvmlite.binding.add_symbol(_PREFIX + name, address)
    return _PREFIX + name


def _of_library(name: str, arguments: int) -> Any:
    """The C library's function of this name, of so many floats, to be called in compiled code."""
    symbol = _known_to_the_compiler(name)
    signature = types.float64(*[types.float64] * arguments)

    def generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        kind = ir.FunctionType(_DOUBLE, [_DOUBLE] * arguments)
        function = cgutils.get_or_insert_function(builder.module, kind, symbol)
        for attribute in _PURE:
            function.attributes.add(attribute)
        return builder.call(function, values)

    if arguments == 1:

        @intrinsic
        def one(typing: Any, x: Any) -> Any:
            return signature, generate

        return one

    @intrinsic
    def two(typing: Any, x: Any, y: Any) -> Any:
        return signature, generate

    return two


def _one(name: str) -> Any:
    """A function of one number that raises where `math` does."""
    of_library = _of_library(name, 1)

    @jit
    def checked(x: float) -> float:
        y: float = of_library(x)
        if not math.isfinite(y) and math.isfinite(x):
            raise ValueError("math domain error")
        if math.isnan(y) and not math.isnan(x):
            raise ValueError("math domain error")
        return y

    return checked


def _of_finite(name: str) -> Any:
    """The same of a function that is finite for every number that is."""
    of_library = _of_library(name, 1)

    @jit
    def checked(x: float) -> float:
        if math.isinf(x):
            raise ValueError("math domain error")
        y: float = of_library(x)
        return y

    return checked


@jit
def sqrt(x: float) -> float:
    """`math.sqrt`: every processor rounds a root correctly."""
    if x < 0.0:
        raise ValueError("math domain error")
    return math.sqrt(x)


sin, cos = _of_finite("sin"), _of_finite("cos")
tan = _one("tan")
asin, acos, atan = _one("asin"), _one("acos"), _one("atan")
sinh, cosh, tanh = _one("sinh"), _one("cosh"), _one("tanh")
exp, expm1, log, log1p = _one("exp"), _one("expm1"), _one("log"), _one("log1p")
_atan2, _pow = _of_library("atan2", 2), _of_library("pow", 2)
_remainder, _fmod = _of_library("remainder", 2), _of_library("fmod", 2)


@jit
def atan2(y: float, x: float) -> float:
    """`math.atan2`."""
    angle: float = _atan2(y, x)
    return angle


@jit
def copysign(x: float, y: float) -> float:
    """`math.copysign`."""
    return math.copysign(x, y)


@jit
def remainder(x: float, y: float) -> float:
    """`math.remainder` of finite numbers."""
    if y == 0.0 or not (math.isfinite(x) and math.isfinite(y)):
        raise ValueError("math domain error")
    rest: float = _remainder(x, y)
    return rest


@jit
def fmod(x: float, y: float) -> float:
    """`math.fmod` of finite numbers."""
    if y == 0.0 or not (math.isfinite(x) and math.isfinite(y)):
        raise ValueError("math domain error")
    rest: float = _fmod(x, y)
    return rest


@jit
def power(x: float, y: float) -> float:
    """`x ** y` of floats; raises where that is complex or infinite."""
    z: float = _pow(float(x), float(y))
    if not math.isfinite(z) and math.isfinite(x) and math.isfinite(y):
        raise ValueError("math domain error")
    return z


@jit
def smaller(x: float, y: float) -> float:
    """`min` of two: the first of two that are equal or not comparable."""
    return y if y < x else x


@jit
def larger(x: float, y: float) -> float:
    """`max` of two: the first of two that are equal or not comparable."""
    return y if y > x else x


@jit
def isfinite(x: float) -> bool:
    """`math.isfinite`."""
    return math.isfinite(x)


@jit
def isnan(x: float) -> bool:
    """`math.isnan`."""
    return math.isnan(x)


@jit
def radians(x: float) -> float:
    """`math.radians`."""
    return x * (math.pi / 180.0)


@jit
def degrees(x: float) -> float:
    """`math.degrees`."""
    return x * (180.0 / math.pi)


_SPLIT = 134217729.0  # 2^27 + 1


@jit
def _square(x: float) -> tuple[float, float, float]:
    """The square of x as a sum of three numbers without a rounding error."""
    t = x * _SPLIT
    high = t - (t - x)
    low = x - high
    return high * high, 2.0 * high * low, low * low


@jit
def _root_of_three_parts(x: float, y: float) -> float:
    """The root of the sum of squares, of numbers below 1, of which one is 0.5 or more, as Python 3.11 has it.

    The squares are added to 1 in three parts, and what is lost is kept.
    """
    total, lost_1, lost_2, lost_3 = 1.0, 0.0, 0.0, 0.0
    for value in (x, y):
        first, second, third = _square(value)
        before = total
        total += first
        lost_1 += (before - total) + first
        before = total
        total += second
        lost_2 += (before - total) + second
        lost_3 += third
    h = math.sqrt(total - 1.0 + (lost_1 + lost_2 + lost_3))
    first, second, third = _square(h)
    before = total
    total -= first
    lost_1 += (before - total) - first
    before = total
    total -= second
    lost_2 += (before - total) - second
    before = total
    total -= third
    lost_3 += (before - total) - third
    return h + (total - 1.0 + (lost_1 + lost_2 + lost_3)) / (2.0 * h)


@jit
def _product(x: float, y: float) -> tuple[float, float]:
    """The product and its rounding error."""
    t = x * _SPLIT
    x_high = t - (t - x)
    x_low = x - x_high
    t = y * _SPLIT
    y_high = t - (t - y)
    y_low = y - y_high
    z = x * y
    return z, ((x_high * y_high - z) + x_high * y_low + x_low * y_high) + x_low * y_low


@jit
def _root_of_two_parts(x: float, y: float) -> float:
    """The same since Python 3.12: with products of two parts."""
    total, lost_1, lost_2 = 1.0, 0.0, 0.0
    for value in (x, y):
        high, low = _product(value, value)
        before = total
        total += high
        lost_1 += low
        lost_2 += high - (total - before)
    h = math.sqrt(total - 1.0 + (lost_1 + lost_2))
    high, low = _product(-h, h)
    before = total
    total += high
    lost_1 += low
    lost_2 += high - (total - before)
    return h + (total - 1.0 + (lost_1 + lost_2)) / (2.0 * h)


_root = _root_of_two_parts if sys.version_info >= (3, 12) else _root_of_three_parts


@jit
def hypot(x: float, y: float) -> float:
    """`math.hypot`."""
    x, y = abs(x), abs(y)
    if math.isinf(x) or math.isinf(y):  # also beside what is no number
        return math.inf
    most = larger(x, y)
    if math.isnan(x) or math.isnan(y):
        return math.nan
    if most == 0.0:
        return 0.0
    exponent = np.float64(most).view(np.int64) >> 52  # biased by 1023; 0 of a subnormal number
    if not 0 < exponent < 2045:
        raise ValueError("too small or too large")
    scale = np.int64((2045 - exponent) << 52).view(np.float64)  # so that the larger is in [0.5, 1)
    return _root(x * scale, y * scale) / scale


@jit
def _rounded(total: float, lost: float, x: float) -> tuple[float, float]:
    """The sum and what is lost of it, with x added as Python 3.11 does: nothing is kept."""
    return total + x, lost


@jit
def _compensated(total: float, lost: float, x: float) -> tuple[float, float]:
    """The same since Python 3.12: what is lost is kept and added in the end."""
    t = total + x
    if abs(total) >= abs(x):
        return t, lost + ((total - t) + x)
    return t, lost + ((x - t) + total)


_added = _compensated if sys.version_info >= (3, 12) else _rounded


@jit
def _ended(total: float, lost: float) -> float:
    return total + lost if lost != 0.0 and math.isfinite(lost) else total


@jit
def dot(row: Any, values: Any) -> float:
    """`sum` of the products."""
    total, lost = 0.0, 0.0
    for i in range(len(values)):
        total, lost = _added(total, lost, row[i] * values[i])
    return _ended(total, lost)


@jit
def added(values: Any) -> float:
    """`sum` of floats."""
    total, lost = 0.0, 0.0
    for i in range(len(values)):
        total, lost = _added(total, lost, values[i])
    return _ended(total, lost)
