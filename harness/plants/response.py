"""A linear response of gain one to a held and delayed command, and its exact propagation between commands."""

import math
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from operator import mul
from typing import Annotated, NamedTuple, Self

import numpy as np
from annotated_types import Ge, Gt, Lt
from numpy.typing import NDArray
from scipy.linalg import expm

from autopilot.quantities import About, Seconds

Array = NDArray[np.float64]
Rows = tuple[tuple[float, ...], ...]

LONGEST = 50_000_000  # ns: a longer stretch is cut into equal pieces, for the nodes within to follow the motion


@dataclass(frozen=True, slots=True, kw_only=True)
class Response:
    """A delay, the bank's second order with a zero, a sideslip mode with its zeros, and the slow tail a trim leaves.

        exp(-delay s) (1 + lead s) / q(s; bank) q(s; zero) / q(s; sideslip) (1 + (1 - share) s / rate) / (1 + s / rate)

    with q(s; w, z) = 1 + 2 z s / w + (s / w)^2 and the tail's share and rate. Its gain is one.
    """

    delay: Annotated[Seconds, Ge(0), Lt(10), About("from the command to its first effect")]
    frequency: Annotated[float, Gt(0), About("rad/s: of the bank's second order")]
    damping: Annotated[float, Gt(0), About("of the bank's second order")]
    lead: Annotated[Seconds, About("its zero: what comes at once, as the side force of a deflection")]
    sideslip_frequency: Annotated[float, Gt(0), About("rad/s: of the sideslip mode")]
    sideslip_damping: Annotated[float, Gt(0), About("of the sideslip mode")]
    zero_frequency: Annotated[float, Gt(0), About("rad/s: of the zeros that nearly cancel the sideslip mode")]
    zero_damping: Annotated[float, About("of those zeros")]
    tail_rate: Annotated[float, Gt(0), About("1/s: of the slow end of the response")]
    tail_share: Annotated[float, About("how much of the response comes with that slow end")]

    def matrices(self) -> tuple[Array, Array, Array]:
        """(A, b, c) of x' = A x + b u(t - delay), y = c x."""
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
        """The frequency response at these rad/s."""
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
        """The same response so many times as quick."""
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
    def bandwidth(self) -> float:
        """Where the gain first falls through -3 dB, rad/s."""
        omega = self.frequency * np.geomspace(1e-3, 1e3, 6001)
        return float(omega[int(np.argmax(np.abs(self.at(omega)) < math.sqrt(0.5)))])

    def sampled(self, period: float, z: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """From a command held for `period` to the output's integral, and to that one's, at its instants: (z's, 2)."""
        A, b, c = self.matrices()
        n = len(b)
        system = np.zeros((n + 3, n + 3))
        system[:n, :n], system[:n, -1], system[n, :n], system[n + 1, n] = A, b, c, 1.0
        whole = math.floor(self.delay / period)
        late = self.delay - whole * period
        before, after = expm(system * late), expm(system * (period - late))
        step = (after @ before)[:-1, :-1]
        now, earlier = after[:-1, -1], after[:-1, :-1] @ before[:-1, -1]
        drive = np.multiply.outer(z, now) + earlier  # times 1/z: of the command now and of the one before
        left = z[:, np.newaxis, np.newaxis] * np.eye(n + 2) - step
        return np.asarray(np.linalg.solve(left, drive[:, :, np.newaxis])[:, n:, 0] * z[:, np.newaxis] ** (-whole - 1))


def plain(delay: float, frequency: float, damping: float) -> Response:
    """The second order alone, without sideslip or tail."""
    return Response(
        delay=delay, frequency=frequency, damping=damping, lead=0.0,
        sideslip_frequency=frequency, sideslip_damping=damping,
        zero_frequency=frequency, zero_damping=damping, tail_rate=1.0, tail_share=0.0,
    )  # fmt: skip


def _q(s: NDArray[np.complex128], w: float, z: float) -> NDArray[np.complex128]:
    return np.asarray(1.0 + 2.0 * z * s / w + (s / w) ** 2)


def gauss(count: int) -> tuple[Array, Array, Array]:
    """Gauss's nodes on [0, 1], the weights of the integral to 1, and of those to each node, (nodes, nodes)."""
    x, w = np.polynomial.legendre.leggauss(count)
    nodes = 0.5 * (x + 1.0)
    powers = np.arange(1, count + 1)
    to_nodes = nodes[:, np.newaxis] ** powers / powers
    return nodes, 0.5 * w, to_nodes @ np.linalg.inv(nodes[:, np.newaxis] ** (powers - 1))


class Piece(NamedTuple):
    """The motion over one stretch with the input held: rows to multiply (states, input) with."""

    length: float  # s
    outputs: Rows  # of the output at Gauss's nodes
    integrals: Rows  # of the output's integral up to each node, and to the end
    end: Rows  # of the states at the end


class Propagator:
    """A response in motion: exact while the command is held, whatever the delay. Times are counted in nanoseconds."""

    def __init__(self, response: Response, nodes: int) -> None:
        A, b, c = response.matrices()
        n = self._order = len(b)
        system = np.zeros((n + 2, n + 2))  # of the states, the output's integral, and the input
        system[:n, :n], system[:n, -1], system[n, :n] = A, b, c
        self._system, self._output = system, _row(c)
        self._slope = (*_row(c @ A), float(c @ b))
        self._nodes = gauss(nodes)[0]
        self._pieces: dict[int, tuple[int, Piece]] = {}
        self._delay = round(response.delay * 1e9)
        self._input = 0.0
        self._coming: deque[tuple[int, float]] = deque()  # (time until it acts, command)
        self._states = (0.0,) * n

    @property
    def output(self) -> float:
        return dot(self._output, self._states)

    @property
    def slope(self) -> float:
        """The output's rate of change."""
        return dot(self._slope, (*self._states, self._input))

    def pieces(self, command: float, period: float) -> Iterator[tuple[tuple[float, ...], Piece]]:
        """The next `period` seconds with this command given now: ((states, input) at its start, piece), one by one."""
        self._coming.append((self._delay, command))
        left = round(period * 1e9)
        while left:
            while self._coming and self._coming[0][0] == 0:
                self._input = self._coming.popleft()[1]
            length = min(left, self._coming[0][0]) if self._coming else left
            count, piece = self._piece(length)
            for _ in range(count):
                now = (*self._states, self._input)
                yield now, piece
                self._states = tuple([dot(row, now) for row in piece.end])
            self._coming = deque([(time - length, value) for time, value in self._coming])
            left -= length

    def _piece(self, length: int) -> tuple[int, Piece]:
        """A stretch of so many nanoseconds: the number of equal pieces, and the piece."""
        if length not in self._pieces:
            count = -(-length // LONGEST)
            h, n = 1e-9 * length / count, self._order
            ways = [np.delete(expm(self._system * (share * h)), n, axis=1) for share in (*self._nodes, 1.0)]
            outputs = [_row(np.array(self._output) @ way[:n]) for way in ways[:-1]]
            integrals, end = [_row(way[n]) for way in ways], [_row(row) for row in ways[-1][:n]]
            self._pieces[length] = count, Piece(h, tuple(outputs), tuple(integrals), tuple(end))
        return self._pieces[length]


def _row(values: Array) -> tuple[float, ...]:
    return tuple(float(v) for v in values)


def dot(row: Sequence[float], values: Sequence[float]) -> float:
    """The scalar product, in this order of terms on every machine."""
    total: float = sum(map(mul, row, values))
    return total
