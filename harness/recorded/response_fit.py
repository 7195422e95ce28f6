"""The response to a command, fitted to a recorded flight: a delay and a second order, with intervals.

The gain and the zero are fitted beside them. Where a rate is commanded, what is flown is its integral, an angle; then
each span of a few seconds counts from its own mean, since errors of a rate add up for ever. Blocks of the flight are
left out in turn, so that the intervals know how unlike each other the parts of the flight are.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import least_squares
from scipy.signal import lfilter

from autopilot.response import Response, plain
from harness.recorded.recorded_flight import Channel
from harness.verdict.statistics import Sample

Array = NDArray[np.float64]

BLOCKS = 20
_GRID = 0.02  # s: the step of the response, unless that makes more than so many
_MOST_STEPS = 500_000
_SPAN = 4.0  # s: length of the spans whose mean is removed, for an angle whose rate is commanded
_TRANSIENT = 4.0  # s: ignored at the beginning, since earlier commands are unknown
_LOWEST = (-0.5, math.log(1.0), math.log(0.3), 0.2, -0.5)
_HIGHEST = (3.0, math.log(40.0), math.log(4.0), 3.0, 0.5)
_STARTS = ((0.05, 8.0, 1.0), (0.5, 5.0, 0.8), (1.2, 4.0, 1.0))  # the smallest delay first
_USUAL = (0.1, math.log(7.0), math.log(1.0))  # prior means: delay, s, log of frequency, rad/s, log of damping
_SPREAD = (0.2, 0.7, 0.4)
_FIRM = 3.0  # factor on the noise of the prior: residuals are correlated, and so count for less
AS_WELL = 0.9  # a smaller delay is preferred if it explains this share: a periodic command fits a period later as well
DELAY, FREQUENCY, DAMPING, GAIN, LAG = range(5)


@dataclass(frozen=True, slots=True)
class ResponseFit:
    """The fitted parameters and their jackknife pseudo-values over the blocks of the flight. SI, rad."""

    delay: float
    frequency: float
    damping: float
    gain: float
    explained: float  # share of the response's variation
    interval: float  # s, between two values of the response
    held: float  # s, half the time between two values of the command
    excited: float  # rms, SI, rad: the change of the command within `interval` of the response's own time
    pseudo: Array  # (blocks, 5): delay, frequency, damping, gain, lag; the mean of each is an estimate without bias

    @property
    def lag(self) -> float:
        """Low-frequency delay, s."""
        return self.delay + 2.0 * self.damping / self.frequency

    @property
    def response(self) -> Response:
        """The response as a plant uses it: with static gain one and a delay of at least zero."""
        return plain(max(0.0, self.delay), self.frequency, self.damping)

    def lag_interval(self) -> tuple[float, float]:
        """The interval of the lag, including the uncertainty of the time at which the command changed."""
        low, high = self.sample(LAG).interval() or (-math.inf, math.inf)
        return low - self.held, high + self.held

    def sample(self, column: int) -> Sample:
        """One of the numbers as a sample of independent parts of the flight."""
        values = self.pseudo[:, column]
        return Sample(values, len(values), drawn=True)


def fitted(command: Channel, response: Channel, is_rate: bool = False) -> ResponseFit | None:
    """The fit; None where command and response share less than half a minute.

    With `is_rate` the command is the rate of the response, an angle.
    """
    begin = max(command.time[0], response.time[0])
    end = min(command.time[-1], response.time[-1])
    inside = (response.time >= begin + _TRANSIENT) & (response.time <= end)
    time, y = response.time[inside], response.values[inside]
    if end - begin < 30.0 or len(time) < 4 * BLOCKS:
        return None
    held = 0.5 * command.interval  # the delay of an observed command, on average
    step = max(_GRID, (end - begin) / _MOST_STEPS)
    grid = np.arange(begin, end + step, step)
    u = command.at(np.minimum(grid + held, command.time[-1]))
    u = np.where(np.isfinite(u), u, 0.0)
    spans = np.floor((time - time[0]) / _SPAN).astype(int)
    slope = time - time[0] if is_rate else np.ones(len(time))  # of what a zero of the response adds
    slope, y = (_centred(slope, spans), _centred(y, spans)) if is_rate else (slope, y)
    noise = _FIRM * float(np.std(np.diff(y))) / 10.0

    def off(x: Array) -> Array:
        delay, frequency, damping, gain, zero = x
        over_time = _second_order(u, step, math.exp(frequency), math.exp(damping))
        if is_rate:  # by the trapezium rule
            over_time = step * (np.cumsum(over_time) - 0.5 * (over_time + over_time[0]))
        follows = np.interp(time - delay, grid, over_time)
        follows = _centred(follows, spans) if is_rate else follows
        usual = noise * (x[:3] - _USUAL) / _SPREAD
        return np.concatenate([zero * slope + gain * follows - y, usual])

    found = [
        least_squares(
            off, [start[0], math.log(start[1]), math.log(start[2]), 1.0, 0.0], bounds=(_LOWEST, _HIGHEST),
            x_scale=[0.05, 0.3, 0.3, 0.1, 0.02], diff_step=[1e-4],
        )
        for start in _STARTS
    ]  # fmt: skip
    variation = max(1e-12, float(np.sum((y - y.mean()) ** 2)))
    explained = [1.0 - 2.0 * each.cost / variation for each in found]
    first = next(i for i, share in enumerate(explained) if share >= AS_WELL * max(explained) or share == max(explained))
    x, J, r = found[first].x, np.asarray(found[first].jac, dtype=np.float64), found[first].fun
    changes = np.diff(u[:: max(1, round(max(response.interval, 0.25) / step))])
    return ResponseFit(
        delay=float(x[0]), frequency=math.exp(x[1]), damping=math.exp(x[2]), gain=float(x[3]),
        explained=explained[first], interval=response.interval, held=held,
        excited=float(np.sqrt(np.mean(changes**2))), pseudo=_left_out(x, J, r, time),
    )  # fmt: skip


def _centred(values: Array, spans: NDArray[np.intp]) -> Array:
    """The values less the mean of their span."""
    count = np.maximum(np.bincount(spans), 1)
    centred: Array = values - (np.bincount(spans, weights=values) / count)[spans]
    return centred


def _left_out(x: Array, J: Array, r: Array, time: Array) -> Array:
    """The pseudo-values of the jackknife: one Gauss-Newton step without each block."""
    block = np.minimum((BLOCKS * (time - time[0]) / (time[-1] - time[0])).astype(int), BLOCKS - 1)
    block = np.append(block, [-1, -1, -1])  # the rows of what is usual stay
    whole = J.T @ J
    found = []
    for k in range(BLOCKS):
        here = block == k
        if not here.any():
            continue
        left = x + np.linalg.lstsq(whole - J[here].T @ J[here], J[here].T @ r[here], rcond=None)[0]
        found.append(BLOCKS * _numbers(x) - (BLOCKS - 1) * _numbers(np.clip(left, _LOWEST, _HIGHEST)))
    return np.array(found)


def _numbers(x: Array) -> Array:
    frequency, damping = math.exp(x[1]), math.exp(x[2])
    return np.array([x[0], frequency, damping, x[3], x[0] + 2.0 * damping / frequency])


def _second_order(u: Array, step: float, frequency: float, damping: float) -> Array:
    """The output, each `step` s, of a second order whose input is held from one to the next; begun at rest at u[0]."""
    w, z = frequency, damping
    system = np.array([[0.0, 1.0, 0.0], [-w * w, -2.0 * z * w, w * w], [0.0, 0.0, 0.0]])
    over = expm(system * step)
    (a, b), (c, d) = over[:2, :2]
    g, k = over[:2, 2]
    # y over u, from z y = a y + b v + g u, z v = c y + d v + k u
    out = lfilter([0.0, g, b * k - d * g], [1.0, -(a + d), a * d - b * c], u - u[0])
    followed: Array = np.asarray(out) + u[0]
    return followed
