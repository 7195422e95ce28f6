"""The axis beside a plot: its range, and the numbers that Rerun writes along it."""

import math
from typing import NamedTuple

from harness.review.plots import Plot, extent

_DIGIT, _MINUS, _POINT, _BESIDE_DIGITS = 7.3, 7.0, 2.2, 8.5  # points: widths beside a plot
_AROUND_PLOT = 43.0  # points: height of the title above a plot and of the labels below it
_APART, _CLEAR = 20.0, 9.0  # points: between numbers beside a plot, and from a number to the end of its axis
_MOST_WIDENED = 1.7  # times: the most by which the axis of a plot grows, so that a second number stands beside it
ENOUGH = 2  # numbers beside a plot: with fewer, its title says its range


class Size(NamedTuple):
    """The margins of a view, points."""

    width: float
    height: float

    @property
    def plot(self) -> float:
        """The height of the plot in it."""
        return max(self.height - _AROUND_PLOT, 1.0)


def scale(plot: Plot, size: Size) -> tuple[float, float]:
    """The range of a plot in a view of this size: with two numbers beside it, if it grows little, and none of them cut.

    Rerun labels multiples of powers of ten.
    """
    low, high = plot.span
    step = _step(low, high, size)
    below, above = step * math.floor(low / step), step * math.ceil(high / step)
    wider = sorted(((low, above), (below, high), (below, above)), key=lambda ends: ends[1] - ends[0])
    for ends in ((low, high), *wider):
        begin, end = _clear_of_numbers(*ends, size)
        if len(numbers(begin, end, size)) >= ENOUGH and end - begin <= _MOST_WIDENED * (high - low):
            return begin, end
    return _clear_of_numbers(low, high, size)


def _clear_of_numbers(low: float, high: float, size: Size) -> tuple[float, float]:
    """The range, grown where a number would stand so close to its end that it is cut."""
    written = numbers(low, high, size)
    if not written:
        return low, high
    clear = _CLEAR * (high - low) / size.plot
    return min(low, written[0] - clear), max(high, written[-1] + clear)


def numbers(low: float, high: float, size: Size) -> list[float]:
    """The numbers that Rerun writes beside a plot."""
    step = _step(low, high, size)
    return [n * step for n in range(math.ceil(low / step), math.floor(high / step) + 1)]


def _step(low: float, high: float, size: Size) -> float:
    """The smallest power of ten whose multiples are far enough from each other to be written beside a plot."""
    return float(10.0 ** (math.floor(math.log10(_APART * (high - low) / size.plot)) + 1))


def width(plot: Plot, size: Size) -> float:
    """The width of the numbers beside a plot, points."""
    return _written_width(*scale(plot, size), size)


def settled_width(plot: Plot, size: Size) -> float:
    """The same where the axis follows the values in view, of the second half of the flight: it ends at the values."""
    halves = [series._replace(values=series.values[len(series.values) // 2 :]) for series in plot.series]
    low, high = extent(halves)
    flat = 0.5 if high == low else 0.0  # to either side, as Rerun does
    return _written_width(low - flat, high + flat, size)


def _written_width(low: float, high: float, size: Size) -> float:
    """The width of the numbers that Rerun writes beside an axis, points."""
    decimals = max(0, -round(math.log10(_step(low, high, size))))
    texts = [f"{number:.{decimals}f}" for number in numbers(low, high, size)]
    widths = [_DIGIT * sum(map(str.isdigit, text)) + _MINUS * ("-" in text) + _POINT * ("." in text) for text in texts]
    return _BESIDE_DIGITS + max(widths, default=_DIGIT)
