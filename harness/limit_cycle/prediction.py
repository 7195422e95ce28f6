"""Predicts the limit cycle of a high-gain law behind an inner loop with lag, from the identified response.

On its circle the aircraft turns at omega_0 = -v_a / R_d. The command u, held for a period T, makes the heading error e
and the range error r, and the law makes the command of them:

    e(z) = H(z) (u(z) - omega_0),   r(z) = v_a J(z) (u(z) - omega_0),   u = law(e, r)

where H and J are the identified response's first and second integral at the sampling instants. A steady oscillation
e = sum of E_m exp(i m omega t) has E_m = H(exp(i m omega T)) U_m for every harmonic m of u, and U_0 = omega_0: the turn
biases the law, and a mean range error compensates the bias. With one harmonic this is the biased describing function;
with more it converges to the cycle of the sampled loop. The law is called as in flight: no gain of it is approximated.
"""

import cmath
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from autopilot.guidance import Context, Law, LawStep, Observation, started
from autopilot.response import Response, critical_gain
from autopilot.standoff import mirrored
from harness.chatter import VISIBLE

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

HARMONICS = 15
CANNOT_HOLD = "the circle cannot be held: the heading-rate limit is below what it takes"
_SAMPLES = 128  # in one cycle
_SOLVED = 1e-6  # the largest imbalance of a solution, relative to the first harmonic
_UNKNOWN = (math.nan, math.nan, math.nan)  # heading rate, bank, roll rate: unknown here


class LawFailed(ValueError):  # noqa: N818 - it says what happened
    """The law of a loop failed where it was asked; the message says how."""


class LimitCycle(NamedTuple):
    """A limit cycle on the circle. SI, rad; an amplitude is half of peak to peak."""

    frequency: float  # Hz
    heading_rate: float  # amplitude of the means over a guidance period
    command: float  # amplitude
    range_mean: float
    range_error: float  # amplitude

    @property
    def is_known(self) -> bool:
        """Whether its numbers are known, and not only that there is one."""
        return not math.isnan(self.frequency)


@dataclass(frozen=True, slots=True)
class Loop:
    """A law on its circle behind an inner loop."""

    law: Law
    response: Response  # of the heading rate to its command
    airspeed: float
    period: float  # s, between two commands
    gain: float = 1.0  # times what the law commands beyond the turn of the circle: 2 is 6 dB more loop gain

    @property
    def context(self) -> Context:
        """What the law knows before it flies: here its response is the right one."""
        return Context(self.period, self.airspeed, response=self.response)

    @property
    def turn(self) -> float:
        """The heading rate on the circle in still air, in the paper's direction, rad/s."""
        return -self.airspeed / self.law.standoff

    @property
    def holds_circle(self) -> bool:
        """Whether the heading-rate limit allows the heading rate of the circle."""
        return self.law.max_heading_rate > abs(self.turn)

    def commands(self, e: Array, r: Array) -> Array:
        """The commands of the law, rad/s, at these heading errors, rad, and range errors, m; equal shapes.

        Raises `LawFailed`.
        """
        command = self.started()
        return np.array([command(*both) for both in zip(e.tolist(), r.tolist(), strict=True)], np.float64)

    def started(self) -> Callable[[float, float], float]:
        """The law in flight: its command, rad/s, at a heading error, rad, and a range error, m.

        Both raise `LawFailed`.
        """
        R_d, v_a, limit = self.law.standoff, self.airspeed, self.law.max_heading_rate

        def seen(e: float, r: float) -> Observation:
            psi = e - 0.5 * math.pi  # due north of the target, at the origin, the paper's circle goes west
            own = (R_d + r, 0.0, v_a * math.cos(psi), v_a * math.sin(psi), v_a, psi, *_UNKNOWN, v_a)
            return Observation._make((*own, *(0.0,) * 9))

        def command(e: float, r: float) -> float:
            try:
                guidance = step(seen(e, r))
                if self.gain == 1.0:
                    answer = float(guidance.heading_rate)
                else:
                    wanted = self.turn + self.gain * (guidance.unlimited_command - self.turn)
                    answer = float(min(max(wanted, -limit), limit))
            except (Exception, SystemExit) as error:
                raise LawFailed(f"the law raised {type(error).__name__}: {error}") from error
            if not math.isfinite(answer):
                raise LawFailed("the law commanded what is not finite")
            return answer

        try:
            step = self._in_the_papers_direction(seen(0.0, 0.0))
        except (Exception, SystemExit) as error:
            raise LawFailed(f"the law raised {type(error).__name__}: {error}") from error
        return command

    def _in_the_papers_direction(self, on_the_circle: Observation) -> LawStep:
        """The law in flight; one that has no setting for it is turned round if it circles the other way."""
        law: Any = self.law
        if hasattr(law, "direction"):
            return started(replace(law, direction="paper"), self.context)
        off = [
            abs(step(on_the_circle).heading_rate - self.turn)
            for step in (started(law, self.context), mirrored(started(law, self.context)))
        ]
        return started(law, self.context) if off[0] <= off[1] else mirrored(started(law, self.context))


class _Cycle(NamedTuple):
    """One cycle of an assumed oscillation, and by how much the loop fails to sustain it."""

    omega: float
    e: Array
    r: Array
    u: Array
    U: Complex  # harmonics of u from 0 on
    imbalance: Array  # relative; zero for a limit cycle


def _cycle(loop: Loop, x: Array) -> _Cycle:
    """The oscillation with the unknowns x: ln omega, ln E_1, mean r / v_a, then Re and Im of E_m / E_1 for m >= 2."""
    higher = (len(x) - 3) // 2
    m = np.arange(1, higher + 2)
    omega = float(np.exp(x[0]))
    E = np.exp(x[1]) * np.append(1.0, x[3 : 3 + higher] + 1j * x[3 + higher :])
    H, J = loop.response.sampled(loop.period, np.exp(1j * m * omega * loop.period)).T
    wave = np.exp(2j * math.pi * np.outer(np.arange(_SAMPLES), m) / _SAMPLES)
    e = 2.0 * np.real(wave @ E)
    r = loop.airspeed * (float(x[2]) + 2.0 * np.real(wave @ (E * J / H)))
    u = loop.commands(e, r)
    U = np.fft.fft(u)[: higher + 2] / _SAMPLES
    off = (H * U[1:] - E) / abs(E[0])
    bias = (U[0].real - loop.turn) / loop.turn
    return _Cycle(omega, e, r, u, U, np.concatenate([[bias], off.real, off.imag]))


def balanced(loop: Loop, starts: Iterable[Array], harmonics: int = HARMONICS) -> LimitCycle | None:
    """The first oscillation in balance that one of the `starts` leads to; None where none does.

    That there is no limit cycle does not follow from None. A start is the unknowns of `_cycle`.
    """
    for start in starts:
        x = _balanced(loop, start, harmonics)
        if x is not None:
            return _limit_cycle(loop, _cycle(loop, x))
    return None


def unknowns(omega: float, E: Complex, range_mean: float, airspeed: float) -> Array:
    """The unknowns of an oscillation: rad/s, harmonics of the heading error from 1 on, rad, and mean range error, m."""
    turned = E * np.exp(-1j * np.arange(1, len(E) + 1) * np.angle(E[0])) / abs(E[0])
    known = [math.log(omega), math.log(abs(E[0])), range_mean / airspeed]
    return np.concatenate([known, turned[1:].real, turned[1:].imag])


def _balanced(loop: Loop, guess: Array, harmonics: int) -> Array | None:
    """The unknowns of the limit cycle, solved with more and more harmonics; None if the guess leads to no solution."""
    known = (len(guess) - 1) // 2
    for count in sorted({count for count in (1, 3, 7, harmonics) if known <= count <= harmonics}):
        solution = _solved(lambda x: _cycle(loop, x).imbalance, _with_harmonics(guess, count))
        if solution is None:
            return None
        guess = solution
        if np.ptp(_cycle(loop, solution).u) < VISIBLE:
            break
    return guess


def _solved(imbalance: Callable[[Array], Array], x: Array) -> Array | None:
    scale = np.append([1.0, 1.0], np.full(len(x) - 2, 0.1))
    solution = least_squares(imbalance, x, x_scale=scale, xtol=1e-10, max_nfev=40)
    return np.asarray(solution.x) if np.abs(solution.fun).max() < _SOLVED else None


def _with_harmonics(x: Array, count: int) -> Array:
    """The same oscillation with `count` harmonics, the added ones zero."""
    known = (len(x) - 3) // 2
    new = np.zeros(count - 1 - known)
    return np.concatenate([x[:3], x[3 : 3 + known], new, x[3 + known :], new])


def _limit_cycle(loop: Loop, cycle: _Cycle) -> LimitCycle | None:
    command = float(np.ptp(cycle.u)) / 2.0
    if command < VISIBLE:
        return None
    spectrum = np.fft.rfft(cycle.e)
    ahead = np.fft.irfft(spectrum * np.exp(1j * np.arange(len(spectrum)) * cycle.omega * loop.period), _SAMPLES)
    return LimitCycle(
        frequency=cycle.omega / math.tau,
        heading_rate=float(np.ptp(ahead - cycle.e)) / loop.period / 2.0,
        command=command,
        range_mean=float(cycle.r.mean()),
        range_error=float(np.ptp(cycle.r)) / 2.0,
    )


class Crossover(NamedTuple):
    """The gain crossover of the loop of law and inner loop, opened at the command."""

    frequency: float  # rad/s
    phase_margin: float  # rad; negative: unstable
    gain: float  # 1/s, of the law there: command over heading error


def crossover(loop: Loop) -> Crossover | None:
    """The crossover for an oscillation by which the command swings by `VISIBLE`; None when there is none.

    The law's gain depends on the size of the oscillation, so it is that of its first harmonic (describing function).
    """
    fastest = min(critical_gain(loop.response, loop.period)[1], 0.9 * math.pi / loop.period)

    def imbalance(x: Array) -> Array:
        cycle = _cycle(loop, x)
        ratio = abs(complex(1.0 + cycle.imbalance[1], cycle.imbalance[2]))  # once round the loop, over what it was
        swing = max(2.0 * abs(cycle.U[1]), 1e-300)
        return np.array([cycle.imbalance[0], math.log(max(ratio, 1e-300)), math.log(swing / VISIBLE)])

    for share in (1.0, 0.5, 0.2, 0.08, 0.03, 0.01):
        omega = share * fastest
        x = _solved(imbalance, np.array([math.log(omega), math.log(0.5 * VISIBLE / omega), 0.0]))
        if x is not None and _is_sampled(loop, x):
            cycle = _cycle(loop, x)
            once_round = complex(1.0 + cycle.imbalance[1], cycle.imbalance[2])
            return Crossover(cycle.omega, cmath.phase(once_round), abs(cycle.U[1]) / math.exp(x[1]))
    return None


def boundary(loop_at: Callable[[float], Loop], guess: float) -> float:
    """The q > 0, near `guess`, at which the limit cycle of `loop_at(q)` has the command amplitude `VISIBLE`; or NaN."""

    def imbalance(x: Array) -> Array:
        cycle = _cycle(loop_at(float(np.exp(x[3]))), x[:3])
        return np.append(cycle.imbalance, math.log(max(2.0 * abs(cycle.U[1]), 1e-300) / VISIBLE))

    for off in (1.0, 0.5, 2.0, 0.25, 4.0):
        loop = loop_at(off * guess)
        gain, omega = critical_gain(loop.response, loop.period)
        x = _solved(imbalance, np.array([math.log(omega), math.log(0.5 * VISIBLE / gain), 0.0, math.log(off * guess)]))
        if x is not None and _is_sampled(loop, x):
            return float(np.exp(x[3]))
    return math.nan


def _is_sampled(loop: Loop, x: Array) -> bool:
    """Whether commands held for a period can follow an oscillation: it is no faster than half their frequency."""
    return bool(math.exp(x[0]) * loop.period <= math.pi)
