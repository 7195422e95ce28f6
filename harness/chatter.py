"""Detection of a limit cycle from the commanded and the flown heading rate.

A command that oscillates by less than `VISIBLE` is not in a limit cycle. One that oscillates by more is in a limit
cycle if the flown heading rate keeps its phase for `REMEMBERED` cycles. Gusts and noise also excite a lightly damped
loop at its resonance, but a noise-driven oscillation loses phase coherence within a few cycles: its autocorrelation
after five is near zero, that of a limit cycle in still air near one. Without phase coherence gusts or noise may mask a
cycle: the record does not decide. Error rates of the test, measured on flights: `docs/answers/chatter.md`.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

VISIBLE = math.radians(0.5)  # rad/s: least amplitude (half of peak to peak) of the command in a limit cycle
REMEMBERED = 5  # cycles of lag at which the autocorrelation is evaluated
LEAST_CORRELATION = 0.6  # least autocorrelation of a limit cycle at that lag
SLOWEST = 0.2  # Hz: lowest frequency of a limit cycle; below it wind around a lap and the approach dominate
FEWEST_CYCLES = 12  # least number of cycles in a record; slower oscillations are not searched
SHORTEST = 30.0  # s: shortest record that is judged
_FINER = 8  # zero-padding factor of the spectrum
_FEWEST_ROWS = 32  # shortest record that has a spectrum
_BINS = 30  # bins of a spectrum per decade
_FEWEST_CROSSINGS = 4  # least number of crossings of the mean


class Oscillation(NamedTuple):
    """The strongest oscillation in a record of heading rate. SI, rad; amplitudes are half of peak to peak."""

    chatters: bool | None  # whether it is a limit cycle; None if gusts or noise may mask one
    frequency: float  # Hz
    heading_rate: float  # amplitude of the flown heading rate, rad/s
    command: float  # amplitude of its command, rad/s


def oscillation(command: Array, flown: Array, period: float) -> Oscillation | None:
    """The strongest oscillation of a settled record: commanded and flown heading rate, rad/s, a value per `period` s.

    None if the record does not decide: shorter than `SHORTEST`, not finite, or sampled too slowly for `SLOWEST`.
    """
    slowest = _slowest(command, flown, period)
    if slowest is None:
        return None
    u, y = (_without_slow(x, 1.0 / (slowest * period)) for x in (command, flown))
    frequency = _strongest(y, period, slowest)
    cycle = 1.0 / (frequency * period)  # samples
    amplitude, swing = _amplitude(y, cycle), _amplitude(u, cycle)
    chatters = False if swing < VISIBLE else True if _keeps_phase(y, cycle) else None
    return Oscillation(chatters, frequency, amplitude, swing)


def rests(command: Array, flown: Array, period: float) -> bool:
    """Whether `oscillation` finds no limit cycle because the command never oscillates by `VISIBLE`."""
    slowest, still = _slowest(command, flown, period), 2.0 * VISIBLE * (1.0 - 1e-9)  # less is rounding
    if slowest is None:
        return False
    if 2.0 * np.ptp(command) < still:  # bounds the range after subtraction of an average
        return True
    return bool(np.ptp(_without_slow(command, 1.0 / (slowest * period))) < still)


def _slowest(command: Array, flown: Array, period: float) -> float | None:
    """The lowest frequency that is searched, Hz; None if the record does not decide."""
    lasted = len(flown) * period
    if lasted < SHORTEST or not (np.isfinite(command).all() and np.isfinite(flown).all()):
        return None
    slowest = max(SLOWEST, FEWEST_CYCLES / lasted)
    return slowest if slowest <= 0.5 / period else None


def spectrum(command: Array, period: float) -> tuple[Array, Array]:
    """Frequency, Hz, and amplitude of a record, in its unit; empty for a short one.

    A sinusoid has its own amplitude at its frequency (Hann window); each bin, a thirtieth of a decade, has its maximum.
    """
    if len(command) < _FEWEST_ROWS:
        return np.empty(0), np.empty(0)
    window = np.hanning(len(command))
    amplitude = 2.0 * np.abs(np.fft.rfft((command - command.mean()) * window))[1:] / window.sum()
    frequency = np.fft.rfftfreq(len(command), period)[1:]
    begins = np.unique(np.floor(_BINS * np.log10(frequency / frequency[0]) + 1e-9), return_index=True)[1]
    return np.asarray(frequency[begins], np.float64), np.asarray(np.maximum.reduceat(amplitude, begins), np.float64)


def swinging(command: Array, period: float) -> NDArray[np.bool_]:
    """For each row, whether the command, rad/s, oscillates by `VISIBLE`, at least two cycles in the 5 s around it."""
    around = max(2, min(round(1.0 / (SLOWEST * period)), len(command)))
    padded = np.pad(command, (around // 2, around - 1 - around // 2), mode="edge")
    parts = np.lib.stride_tricks.sliding_window_view(padded, around)
    fast = np.sign(parts - parts.mean(axis=1, keepdims=True))
    crossings = (fast[:, 1:] != fast[:, :-1]).sum(axis=1)
    return np.asarray((np.ptp(parts, axis=1) >= 2.0 * VISIBLE) & (crossings >= _FEWEST_CROSSINGS), np.bool_)


def _without_slow(x: Array, samples: float) -> Array:
    """The record minus its moving average, taken twice, over so many samples; faster cycles are unchanged."""
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


def _keeps_phase(x: Array, cycle: float) -> bool:
    """Whether a record is like itself `REMEMBERED` cycles of so many samples later, half a cycle more or less."""
    lags = range(math.floor((REMEMBERED - 0.5) * cycle), math.ceil((REMEMBERED + 0.5) * cycle) + 1)
    return any(_correlation(x, lag) >= LEAST_CORRELATION for lag in lags)


def _correlation(x: Array, lag: int) -> float:
    """Autocorrelation of a record at a lag of so many samples."""
    before, after = x[: len(x) - lag], x[lag:]
    size = math.sqrt(float(before @ before) * float(after @ after))
    return float(before @ after) / size if size > 0.0 else 0.0
