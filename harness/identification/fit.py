"""Fits linear responses to flown records by least squares."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft
from scipy.linalg import expm
from scipy.optimize import least_squares
from scipy.signal import lfilter

from autopilot.response import Response
from harness.identification.manoeuvres import STEP
from harness.plants.coordinated import AirspeedHold

Array = NDArray[np.float64]

_COMPARED = 4  # steps: fits and errors compare means over 20 ms


class Training(NamedTuple):
    """A record to fit a response to: the input of each step, and the mean of the output over each step."""

    input: Array
    output: Array


_START = Response(
    delay=0.02, frequency=10.0, damping=0.8, lead=0.01, sideslip_frequency=4.0, sideslip_damping=0.6,
    zero_frequency=4.2, zero_damping=0.7, tail_rate=0.5, tail_share=0.05,
)  # fmt: skip
_LOWEST = (0.0, 1.0, 0.2, -0.2, 0.5, 0.2, 0.5, -2.0, 0.1, -0.5)
_HIGHEST = (0.3, 60.0, 3.0, 0.5, 60.0, 3.0, 100.0, 5.0, 3.0, 0.9)
_FIELDS = tuple(Response.__dataclass_fields__)
_POWERS = np.array([-1, 1, 0, -1, 1, 0, 1, 0, 1, 0])  # of the pace, in each field: times, frequencies, ratios


def fit(records: Sequence[Training], pace: float = 1.0) -> Response:
    """The response that fits the records best; each record has the same weight, relative to its input.

    Start and bounds suit small aircraft; those of an aircraft that follows `pace` times as fast are scaled with it.
    """
    weights = [1.0 / math.sqrt(np.sum(record.input**2) / _COMPARED) for record in records]
    longest = max(len(record.input) for record in records)
    convolutions = [_convolution(record.input) for record in records]

    def errors(x: Array) -> Array:
        kernel = pulse_response(response_of(x), longest)
        return np.concatenate(
            [
                weight * means(convolved(kernel) - record.output)
                for record, weight, convolved in zip(records, weights, convolutions, strict=True)
            ]
        )

    scale = pace ** _POWERS.astype(float)
    start = scale * [getattr(_START, name) for name in _FIELDS]
    bounds = (scale * _LOWEST, scale * _HIGHEST)
    solution = least_squares(errors, start, bounds=bounds, x_scale=start, xtol=1e-7, ftol=1e-7)
    return response_of(solution.x)


def response_of(x: Array) -> Response:
    """The response whose fields have these values, in their order."""
    return Response(**dict(zip(_FIELDS, (float(value) for value in x), strict=True)))


def error(response: Response, record: Training) -> float:
    """The RMS of (response - flown), in means over 20 ms, relative to the RMS of the input."""
    wrong = means(followed(response, record.input) - record.output)
    return float(np.sqrt(np.mean(wrong**2) / np.mean(record.input**2)))


def followed(response: Response, command: Array) -> Array:
    """The output of the response to a command: its mean over each step, one value per step of the command."""
    return _convolution(command)(pulse_response(response, len(command)))


def pulse_response(response: Response, count: int) -> Array:
    """The mean output over each of `count` steps after a command of one, held for a single step."""
    A, b, c = response.matrices()
    n = len(b)
    system = np.zeros((n + 2, n + 2))
    system[:n, :n], system[:n, -1], system[n, :n] = A, b, c
    steps = int(response.delay // STEP)  # whole ones in the delay
    late = response.delay - steps * STEP  # s: offset of the pulse's edges in a step
    before, after = expm(system * late), expm(system * (STEP - late))
    step = (after @ before)[: n + 1, : n + 1]
    begun, ended = after[: n + 1, -1], after[: n + 1, : n + 1] @ before[: n + 1, -1]
    second = step[:, :n] @ begun[:n] + ended
    states, power = second[:n, np.newaxis], step[:n, :n]
    while states.shape[1] < count:  # each pass doubles the number of steps
        states, power = np.hstack([states, power @ states]), power @ power
    means = np.concatenate([np.zeros(steps), [begun[n], second[n]], step[n, :n] @ states]) / STEP
    return means[:count]


def fit_airspeed(records: Sequence[Training]) -> AirspeedHold:
    """The airspeed hold that fits the records best, from load factor beyond one to change of airspeed, m/s."""
    weights = [1.0 / max(float(np.sqrt(np.sum(record.input**2))), 1e-12) for record in records]

    def errors(x: Array) -> Array:
        hold = AirspeedHold(gain=float(x[0]), frequency=float(x[1]), damping=float(x[2]))
        return np.concatenate(
            [
                weight * (airspeed_change(hold, record.input) - record.output)[::_COMPARED]
                for record, weight in zip(records, weights, strict=True)
            ]
        )

    solution = least_squares(errors, [-0.5, 0.8, 1.0], bounds=([-20, 0.05, 0.05], [20, 10, 10]), xtol=1e-7)
    return AirspeedHold(gain=float(solution.x[0]), frequency=float(solution.x[1]), damping=float(solution.x[2]))


def airspeed_change(hold: AirspeedHold, excess: Array) -> Array:
    """The change of airspeed, m/s, at the end of each step; `excess` is each step's load factor beyond one."""
    F = np.array([[-2 * hold.damping * hold.frequency, -(hold.frequency**2), hold.gain], [1, 0, 0], [0, 0, 0]])
    step = expm(F * STEP)
    (a, b), (c, d) = step[:2, :2]
    g, k = step[:2, 2]
    # v over e, from z v = a v + b i + g e, z i = c v + d i + k e
    return np.asarray(lfilter([0.0, g, b * k - d * g], [1.0, -(a + d), a * d - b * c], np.append(excess, 0.0))[1:])


def _convolution(command: Array) -> Callable[[Array], Array]:
    """A function that gives what a kernel makes of the command, whose spectrum is computed once."""
    count = len(command)
    size = next_fast_len(2 * count - 1, real=True)
    spectrum = rfft(command, size)
    return lambda kernel: np.asarray(irfft(spectrum * rfft(kernel[:count], size), size)[:count])


def means(values: Array) -> Array:
    """Means over four steps each, 20 ms; steps left at the end are dropped."""
    complete = len(values) // _COMPARED * _COMPARED
    return np.asarray(values[:complete].reshape(-1, _COMPARED).mean(axis=1))
