"""Whether a loop has fallen into a limit cycle, told from what was commanded and what was flown alone.

The test: a command that swings by less than `VISIBLE` is in none. One that swings by more is in a limit cycle when the
flown heading rate keeps its phase for `REMEMBERED` cycles. Gusts and noise also set a loop swinging at the frequency it
is inclined to, but such a swing forgets its phase within a cycle or two: after five its correlation with itself is near
zero, a limit cycle's in still air is near one. Where the phase is not kept, gusts or noise may hide a cycle: the record
cannot tell. Error rates of the test, measured on flights: `docs/answers/chatter.md`.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

VISIBLE = math.radians(0.5)  # rad/s, half of peak to peak: a command that swings by less is not called a limit cycle
REMEMBERED = 5  # cycles
LEAST_CORRELATION = 0.6  # with itself, so many cycles later
SLOWEST = 0.2  # Hz: what is slower may be the wind's, round a lap, or the way to the circle
FEWEST_CYCLES = 12  # in a record: a slower oscillation is not looked for
SHORTEST = 30.0  # s: a shorter record tells nothing
_FINER = 8  # times: the spectrum's grid
_FEWEST_ROWS = 32  # of a record that has a spectrum
_BINS = 30  # of a spectrum, per decade
_FEWEST_CROSSINGS = 4  # of the mean


class Oscillation(NamedTuple):
    """The strongest oscillation in a record of heading rate. SI, rad; amplitudes are half of peak to peak."""

    chatters: bool | None  # whether it is a limit cycle; None when gusts or noise may hide one
    frequency: float  # Hz
    heading_rate: float  # amplitude of the flown heading rate, rad/s
    command: float  # amplitude of its command, rad/s
    correlation: float  # of the flown heading rate with itself `REMEMBERED` cycles later


def oscillation(command: Array, flown: Array, period: float) -> Oscillation | None:
    """The strongest oscillation of a settled record: commanded and flown heading rate, rad/s, a value per `period` s.

    None where the record cannot tell: shorter than `SHORTEST`, not finite, or sampled too slowly for `SLOWEST`.
    """
    slowest = _slowest(command, flown, period)
    if slowest is None:
        return None
    u, y = (_without_slow(x, 1.0 / (slowest * period)) for x in (command, flown))
    frequency = _strongest(y, period, slowest)
    cycle = 1.0 / (frequency * period)  # samples
    amplitude, swing = _amplitude(y, cycle), _amplitude(u, cycle)
    lags = range(math.floor((REMEMBERED - 0.5) * cycle), math.ceil((REMEMBERED + 0.5) * cycle) + 1)
    correlation = max(_correlation(y, lag) for lag in lags)
    chatters = False if swing < VISIBLE else True if correlation >= LEAST_CORRELATION else None
    return Oscillation(chatters, frequency, amplitude, swing, correlation)


def rests(command: Array, flown: Array, period: float) -> bool:
    """Whether `oscillation` finds no limit cycle for this alone, that the command nowhere swings by `VISIBLE`."""
    slowest, still = _slowest(command, flown, period), 2.0 * VISIBLE * (1.0 - 1e-9)  # less is rounding
    if slowest is None:
        return False
    if 2.0 * np.ptp(command) < still:  # what is left beside an average reaches no farther
        return True
    return bool(np.ptp(_without_slow(command, 1.0 / (slowest * period))) < still)


def _slowest(command: Array, flown: Array, period: float) -> float | None:
    """The lowest frequency that is looked for, Hz; None where the record cannot tell."""
    lasted = len(flown) * period
    if lasted < SHORTEST or not (np.isfinite(command).all() and np.isfinite(flown).all()):
        return None
    slowest = max(SLOWEST, FEWEST_CYCLES / lasted)
    return slowest if slowest <= 0.5 / period else None


def spectrum(command: Array, period: float) -> tuple[Array, Array]:
    """Frequency, Hz, and amplitude of a record, in its unit; empty of a short one.

    A sinusoid has its own amplitude at its frequency (Hann's window); of each thirtieth of a decade the highest.
    """
    if len(command) < _FEWEST_ROWS:
        return np.empty(0), np.empty(0)
    window = np.hanning(len(command))
    amplitude = 2.0 * np.abs(np.fft.rfft((command - command.mean()) * window))[1:] / window.sum()
    frequency = np.fft.rfftfreq(len(command), period)[1:]
    begins = np.unique(np.floor(_BINS * np.log10(frequency / frequency[0]) + 1e-9), return_index=True)[1]
    return np.asarray(frequency[begins], np.float64), np.asarray(np.maximum.reduceat(amplitude, begins), np.float64)


def swinging(command: Array, period: float) -> NDArray[np.bool_]:
    """Row by row, whether the command, rad/s, swings by `VISIBLE`: twice up and down in the 5 s around it, or more."""
    around = max(2, min(round(1.0 / (SLOWEST * period)), len(command)))
    padded = np.pad(command, (around // 2, around - 1 - around // 2), mode="edge")
    parts = np.lib.stride_tricks.sliding_window_view(padded, around)
    fast = np.sign(parts - parts.mean(axis=1, keepdims=True))
    crossings = (fast[:, 1:] != fast[:, :-1]).sum(axis=1)
    return np.asarray((np.ptp(parts, axis=1) >= 2.0 * VISIBLE) & (crossings >= _FEWEST_CROSSINGS), np.bool_)


def _without_slow(x: Array, samples: float) -> Array:
    """What is left beside the average over so many samples, taken twice, which leaves a cycle within it as it was."""
    half = round(0.5 * samples)
    window = np.full(2 * half + 1, 1.0 / (2 * half + 1))
    average = np.convolve(np.convolve(x, window, "valid"), window, "valid")
    return x[2 * half : len(x) - 2 * half] - average


def _strongest(x: Array, period: float, slowest: float) -> float:
    """The frequency, Hz, at which the spectrum is highest, not below `slowest`."""
    count = _FINER * len(x)
    power = np.abs(np.fft.rfft(x * np.hanning(len(x)), count))
    frequency = np.fft.rfftfreq(count, period)
    return float(frequency[np.argmax(np.where(frequency >= slowest, power, -1.0))])


def _amplitude(x: Array, cycle: float) -> float:
    """Half of peak to peak, the mean over the cycles of so many samples."""
    count = max(2, round(cycle))
    whole = x[: len(x) // count * count].reshape(-1, count)
    return float(np.ptp(whole, axis=1).mean()) / 2.0


def _correlation(x: Array, lag: int) -> float:
    """Of a record with itself so many samples later."""
    before, after = x[: len(x) - lag], x[lag:]
    size = math.sqrt(float(before @ before) * float(after @ after))
    return float(before @ after) / size if size > 0.0 else 0.0
