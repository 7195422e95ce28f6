"""A linear response with static gain one to a delayed command, and its exact solution under a zero-order hold."""

import math
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from operator import mul
from typing import Annotated, NamedTuple, Self

import numpy as np
from annotated_types import Ge, Gt, Lt
from numpy.typing import NDArray

from autopilot.quantities import About, Seconds

Array = NDArray[np.float64]
Rows = tuple[tuple[float, ...], ...]

ORDER = 5  # states of a `Response`
LONGEST = 50_000_000  # ns: longer intervals are cut into equal pieces, so that the nodes resolve the motion


@dataclass(frozen=True, slots=True, kw_only=True)
class Response:
    """The structure that is identified: delay, bank mode with a zero, sideslip mode with two zeros, slow tail.

        exp(-delay s) (1 + lead s) / q(s; bank) q(s; zero) / q(s; sideslip) (1 + (1 - share) s / rate) / (1 + s / rate)

    with q(s; w, z) = 1 + 2 z s / w + (s / w)^2. The static gain is one. The tail is the slow mode of the rate trim, an
    integrator; `share` and `rate` are `tail_share` and `tail_rate`.
    """

    delay: Annotated[Seconds, Ge(0), Lt(10), About("transport delay")]
    frequency: Annotated[float, Gt(0), About("natural frequency of the bank mode", "rad/s")]
    damping: Annotated[float, Gt(0), About("damping ratio of the bank mode")]
    lead: Annotated[Seconds, About("time constant of the zero: direct effects, such as the side force of a deflection")]
    sideslip_frequency: Annotated[float, Gt(0), About("natural frequency of the sideslip mode", "rad/s")]
    sideslip_damping: Annotated[float, Gt(0), About("damping ratio of the sideslip mode")]
    zero_frequency: Annotated[
        float, Gt(0), About("frequency of the zeros that nearly cancel the sideslip mode", "rad/s")
    ]
    zero_damping: Annotated[float, About("damping ratio of those zeros")]
    tail_rate: Annotated[float, Gt(0), About("pole of the slow tail", "1/s")]
    tail_share: Annotated[float, About("share of the slow tail in the response")]

    def matrices(self) -> tuple[Array, Array, Array]:
        """(A, b, c) of x' = A x + b u(t - delay), y = c x; shapes (5, 5), (5,), (5,)."""
        A, b, c = np.zeros((5, 5)), np.zeros(5), np.zeros(5)
        w, z = self.frequency, self.damping
        A[0, 1], A[1, :2], b[1] = 1.0, (-w * w, -2.0 * z * w), w * w
        c[:2] = 1.0, self.lead
        w, z = self.sideslip_frequency, self.sideslip_damping
        w_0, z_0 = self.zero_frequency, self.zero_damping
        A[2, 3], A[3, 2:4] = 1.0, (-w * w, -2.0 * z * w)
        A[3] += w * w * c
        ratio = (w / w_0) ** 2
        c = ratio * c
        c[2] += 1.0 - ratio
        c[3] += 2.0 * z_0 / w_0 - 2.0 * z / w * ratio
        A[4] = self.tail_rate * c
        A[4, 4] -= self.tail_rate
        c = (1.0 - self.tail_share) * c
        c[4] += self.tail_share
        return A, b, c

    def at(self, omega: Array) -> NDArray[np.complex128]:
        """The complex frequency response at these frequencies, rad/s; the shape of `omega`."""
        s = 1j * np.asarray(omega, dtype=float)
        numerator = (
            (1.0 + self.lead * s)
            * _q(s, self.zero_frequency, self.zero_damping)
            * (1.0 + (1.0 - self.tail_share) * s / self.tail_rate)
        )
        denominator = (
            _q(s, self.frequency, self.damping)
            * _q(s, self.sideslip_frequency, self.sideslip_damping)
            * (1.0 + s / self.tail_rate)
        )
        return np.asarray(np.exp(-s * self.delay) * numerator / denominator)

    def quicker(self, times: float) -> Self:
        """The response with its bandwidth scaled by the factor `times`: all time constants are divided by it."""
        return replace(
            self,
            delay=self.delay / times,
            frequency=self.frequency * times,
            lead=self.lead / times,
            sideslip_frequency=self.sideslip_frequency * times,
            zero_frequency=self.zero_frequency * times,
            tail_rate=self.tail_rate * times,
        )

    @property
    def lag(self) -> float:
        """Low-frequency delay, s: minus the derivative of the transfer function at zero frequency."""
        return (
            self.delay
            + 2.0 * self.damping / self.frequency
            - self.lead
            + 2.0 * self.sideslip_damping / self.sideslip_frequency
            - 2.0 * self.zero_damping / self.zero_frequency
            + self.tail_share / self.tail_rate
        )

    @property
    def bandwidth(self) -> float:
        """The frequency at which the gain first falls below -3 dB, rad/s."""
        omega = self.frequency * np.geomspace(1e-3, 1e3, 6001)
        return float(omega[int(np.argmax(np.abs(self.at(omega)) < math.sqrt(0.5)))])

    def sampled(self, period: float, z: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Transfer functions of the sampled response, at the points `z`; shape (len(z), 2).

        From a command held for `period` seconds to the output's first and second integral at the sampling instants.
        """
        periods, step, now, earlier = held(self, period)
        n = len(now) - 2
        drive = np.multiply.outer(z, now) + earlier  # times 1/z: the command of this period and of the one before
        left = z[:, np.newaxis, np.newaxis] * np.eye(n + 2) - step
        return np.asarray(np.linalg.solve(left, drive[:, :, np.newaxis])[:, n:, 0] * z[:, np.newaxis] ** (-periods - 1))


@lru_cache(maxsize=64)
def held(response: Response, period: float) -> tuple[int, Array, Array, Array]:
    """The discrete system of a response and its first and second integral under a zero-order hold of `period`, s.

    Returns the whole periods in the delay, the transition matrix of a period, and the input vectors of this period's
    command and of the one before. The states are those of `matrices`, then the two integrals.
    """
    A, b, c = response.matrices()
    n = len(b)
    system = np.zeros((n + 3, n + 3))
    system[:n, :n], system[:n, -1], system[n, :n], system[n + 1, n] = A, b, c, 1.0
    periods = math.floor(response.delay / period)
    late = response.delay - periods * period
    before, after = _expm(system * late), _expm(system * (period - late))
    step = (after @ before)[:-1, :-1]
    return periods, step, after[:-1, -1], after[:-1, :-1] @ before[:-1, -1]


def critical_gain(response: Response, period: float) -> tuple[float, float]:
    """Critical gain, 1/s, from heading error to command, and frequency, rad/s, of the sampled loop; inf if none."""
    omega = math.pi / period * np.append(np.geomspace(1e-4, 1.0, 6000, endpoint=False), 1.0)
    H = response.sampled(period, np.exp(1j * omega * period))[:, 0]
    crossing = np.flatnonzero((np.sign(H.imag[1:]) != np.sign(H.imag[:-1])) & (H.real[1:] < 0.0))
    gains = [
        (-1.0 / float(H.real[i + 1]), float(omega[i + 1])) for i in (*crossing, len(omega) - 2) if H.real[i + 1] < 0
    ]
    return min(gains, default=(math.inf, math.inf))


def _expm(matrix: Array) -> Array:
    from scipy.linalg import expm  # imported when used: the import takes a tenth of a second

    return np.asarray(expm(matrix))


def plain(delay: float, frequency: float, damping: float) -> Response:
    """A delay (s) and a second order (rad/s, damping ratio) alone, without zero, sideslip mode or tail."""
    return Response(
        delay=delay, frequency=frequency, damping=damping, lead=0.0,
        sideslip_frequency=frequency, sideslip_damping=damping,
        zero_frequency=frequency, zero_damping=damping, tail_rate=1.0, tail_share=0.0,
    )  # fmt: skip


def _q(s: NDArray[np.complex128], w: float, z: float) -> NDArray[np.complex128]:
    return np.asarray(1.0 + 2.0 * z * s / w + (s / w) ** 2)


def gauss(count: int) -> tuple[Array, Array, Array]:
    """Gauss quadrature on [0, 1] with `count` nodes: (nodes, weights, weights to the nodes).

    The weights give the integral from 0 to 1; row i of the last, shape (count, count), gives that from 0 to node i.
    """
    x, w = np.polynomial.legendre.leggauss(count)
    nodes = 0.5 * (x + 1.0)
    powers = np.arange(1, count + 1)
    to_nodes = nodes[:, np.newaxis] ** powers / powers
    return nodes, 0.5 * w, to_nodes @ np.linalg.inv(nodes[:, np.newaxis] ** (powers - 1))


class Piece(NamedTuple):
    """The motion over an interval with the input held, as rows that multiply the vector (states, input)."""

    length: float  # s
    outputs: Rows  # the output at each of Gauss's nodes
    integrals: Rows  # the output's integral up to each node, then up to the end
    end: Rows  # the states at the end
    airspeed: Rows = ()  # of the plant `coordinated`


class Held(NamedTuple):
    """A piece of a period: its length, and the command that acts in it."""

    command: float
    length: int  # ns


class Delay:
    """Transport delay: a queue of commands that take effect `delay` ns later. Time is in nanoseconds."""

    def __init__(self, delay: int) -> None:
        self._delay, self._input = delay, 0.0
        self._coming: deque[tuple[int, float]] = deque()  # (time until it acts, command)

    def pieces(self, command: float, period: float) -> Iterator[Held]:
        """Advances by `period` seconds with `command` given now, in pieces of constant effective command."""
        self._coming.append((self._delay, command))
        left = round(period * 1e9)
        while left:
            while self._coming and self._coming[0][0] == 0:
                self._input = self._coming.popleft()[1]
            length = min(left, self._coming[0][0]) if self._coming else left
            yield Held(self._input, length)
            self._coming = deque([(time - length, value) for time, value in self._coming])
            left -= length


class Propagator:
    """Exact solution of a response under constant input over any interval, without its `delay`, ns."""

    def __init__(self, response: Response, nodes: int) -> None:
        A, b, c = response.matrices()
        n = self._order = len(b)
        system = np.zeros((n + 2, n + 2))  # of the states, the output's integral, and the input
        system[:n, :n], system[:n, -1], system[n, :n] = A, b, c
        self._system, self._nodes = system, gauss(nodes)[0]
        self._pieces: dict[int, tuple[int, Piece]] = {}
        self.output = _row(c)  # multiplies the states
        self.slope = (*_row(c @ A), float(c @ b))  # multiplies (states, input): the output's rate of change
        self.delay = round(response.delay * 1e9)

    def piece(self, length: int) -> tuple[int, Piece]:
        """The number of equal pieces in an interval of `length` nanoseconds, and the piece."""
        if length not in self._pieces:
            count = -(-length // LONGEST)
            h, n = 1e-9 * length / count, self._order
            ways = [np.delete(_expm(self._system * (share * h)), n, axis=1) for share in (*self._nodes, 1.0)]
            outputs = [_row(np.array(self.output) @ way[:n]) for way in ways[:-1]]
            integrals, end = [_row(way[n]) for way in ways], [_row(row) for row in ways[-1][:n]]
            self._pieces[length] = count, Piece(h, tuple(outputs), tuple(integrals), tuple(end))
        return self._pieces[length]


def moved_on(end: Rows, vector: tuple[float, ...]) -> tuple[float, float, float, float, float]:
    """The states at the end of a piece, from the vector (states, input) at its start."""
    a, b, c, d, e = end[0], end[1], end[2], end[3], end[4]
    return dot(a, vector), dot(b, vector), dot(c, vector), dot(d, vector), dot(e, vector)


def _row(values: Array) -> tuple[float, ...]:
    return tuple(float(v) for v in values)


def dot(row: Sequence[float], values: Sequence[float]) -> float:
    """The scalar product, summed in the order of the terms: bit-identical on every machine."""
    total: float = sum(map(mul, row, values))
    return total
