"""What was tried for speed and is not used: the section of docs/performance.md, measured anew with the page.

Each is timed beside what the harness does, in turn, in processor time; the least of some repeats, since what else the
machine does only adds.
"""

import gc
import statistics
import timeit
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from autopilot.estimator import Estimate, Estimator, Measurement, Tracker
from autopilot.guidance import Observation
from benchmarks.compiled import FLIGHT
from benchmarks.flight_speed import seconds
from harness import loop
from harness.compiled import engine
from harness.compiled.kernel import kernel
from harness.flight import Flight, context_of
from harness.log import FlightLog
from harness.log.metric import measure

Array = NDArray[np.float64]
_UPDATES = 1800  # of a filter in 900 s
_SEEN = Observation(
    150.0, 120.0, -3.0, -12.0, 13.0, -1.8, 0.0, 0.0, 0.0, 13.0, 3.0, 1.0, 10.0, 10.0, 1.0, 1.0, 0.0, 0.0
)  # fmt: skip

_BY_HAND = (
    "**Sine and cosine in one call** of the C library (`sincos`) take 9.4 ns in place of 15.7, a tenth of a compiled "
    "flight on `lagged`. Of 1e9 random angles none had other bits, but 1.6762650767948966 rad has. (By hand, once.)",
    "**Divisions that are not checked** (Numba's `error_model`) save 1 to 2 % of a compiled flight, and a law that "
    "divides by zero would go on. (By hand, once.)",
    "**Several of JSBSim's properties in one call**: its Python package has no such call.",
)


def least(work: Callable[[], object], number: int, repeats: int = 7) -> float:
    """Processor time of one call, µs."""
    return 1e6 * min(seconds(partial(timeit.timeit, work, number=number)) for _ in range(repeats)) / number


class _Lean:
    """The arithmetic of filterpy's filter and nothing else: no copies, no record of what was before."""

    def __init__(self, kalman: Any, inverse: Callable[[Array], Array]) -> None:
        self.F, self.Q, self.R, self._inverse, self._I = kalman.F, kalman.Q, kalman.R, inverse, np.eye(4)
        self.x, self.P, self.y = kalman.x, kalman.P, np.zeros((2, 1))

    def predict(self) -> None:
        self.x = np.dot(self.F, self.x) + 0.0
        self.P = np.dot(self.F, self.P).dot(self.F.T) + self.Q

    def update(self, z: Array, jacobian: Any, expected: Any, *, args: Any, hx_args: Any, residual: Any) -> None:
        H = jacobian(self.x, *args)
        PHT = np.dot(self.P, H.T)
        K = PHT.dot(self._inverse(np.dot(H, PHT) + self.R))
        self.y = residual(z, expected(self.x, *hx_args))
        self.x = self.x + np.dot(K, self.y)
        I_KH = self._I - np.dot(K, H)
        self.P = np.dot(I_KH, self.P).dot(I_KH.T) + np.dot(K, self.R).dot(K.T)


def _inverse(S: Array) -> Array:
    return np.asarray(np.linalg.inv(S))


def _closed_form(S: Array) -> Array:
    (a, b), (c, d) = S.tolist()
    det = a * d - b * c
    return np.array([[d / det, -b / det], [-c / det, a / det]])


def _filtered(inverse: Callable[[Array], Array] | None) -> list[Estimate]:
    """The estimates of a filter with this inverse; of filterpy's own without one."""
    draw = np.random.default_rng(1)
    tracker = Estimator(kind="ekf").start()
    assert isinstance(tracker, Tracker)
    if inverse:
        tracker.kalman = _Lean(tracker.kalman, inverse)
    found = []
    for r, azimuth in (draw.standard_normal((_UPDATES, 2)) * (1.0, 0.1) + (100.0, 0.3)).tolist():
        tracker.update(Measurement(r, azimuth))
        found.append(tracker.ahead(tracker.known, 0.1))
    return found


def update(inverse: Callable[[Array], Array] | None, repeats: int) -> float:
    """What an update of such a filter takes, µs."""
    return least(partial(_filtered, inverse), 1, repeats) / _UPDATES


def of_the_filter(repeats: int) -> str:
    """Filters of our own beside filterpy's."""
    kinds: dict[str, Callable[[Array], Array]] = {
        "SciPy's inverse": scipy.linalg.inv,
        "NumPy's": _inverse,
        "a closed form": _closed_form,
    }
    usual = _filtered(None)
    took = update(None, repeats)
    told = []
    for name, inverse in kinds.items():
        moved = sum(a != b for a, b in zip(usual, _filtered(inverse), strict=True))
        moves = f"moves {moved} of {_UPDATES} estimates in their last bits" if moved else "moves no bit"
        told.append(f"{update(inverse, repeats):.1f} with {name}, which {moves}")
    return (
        f"**A filter of our own in place of filterpy's**, with its arithmetic and without its copies: an update takes "
        f"{took:.1f} µs, and {'; '.join(told)}."
    )


def of_the_law(repeats: int) -> str:
    """The law of a flight, compiled and called from Python."""
    from numba import njit

    step = loop.begun(FLIGHT.law, context_of(FLIGHT))
    compiled, numbers = kernel(step)
    nothing = njit(_nothing)
    assert tuple(compiled.fly(_SEEN, *numbers)) == tuple(step(_SEEN))
    nothing(_SEEN)
    python, quick, call = (
        least(work, 4000, repeats)
        for work in (partial(step, _SEEN), partial(compiled.fly, _SEEN, *numbers), partial(nothing, _SEEN))
    )
    return (
        f"**The law alone compiled, in a 6-DOF flight**: a command takes {quick:.2f} µs, in Python {python:.2f}. "
        f"To hand over what it sees, {len(_SEEN)} numbers, takes {call:.2f} without any law."
    )


def _nothing(seen: Any) -> float:
    return 0.0


def of_the_collector(flight: Flight, pairs: int) -> str:
    """A flight with and without Python's garbage collector, in turn."""
    ratios = []
    for _ in range(pairs):
        usual = seconds(partial(loop.simulate, flight))
        gc.disable()
        try:
            ratios.append(seconds(partial(loop.simulate, flight)) / usual)
        finally:
            gc.enable()
    return (
        f"**Python's garbage collector off**: a 6-DOF flight takes {statistics.median(ratios):.3f} "
        f"({min(ratios):.3f} to {max(ratios):.3f}) times as long."
    )


def of_the_table(repeats: int) -> str:
    """The metrics of a log whose columns lie one after another."""
    flight = replace(FLIGHT, plant="coordinated")
    log = engine.simulate(flight)
    by_columns = FlightLog(flight, log.outcome, log.reason, np.asfortranarray(log.table), log.channels)
    usual, others = measure(log), measure(by_columns)
    moved = [f"`{name}`" for name in usual if usual[name] != others[name]]
    share = least(partial(measure, by_columns), 50, repeats) / least(partial(measure, log), 50, repeats)
    moves = f"but the last bits of {', '.join(moved)} move" if moved else "and no metric moves here"
    return f"**A log by columns** instead of rows: metrics take {share:.2f} times as long, {moves}."


def section(flight: Flight, pairs: int) -> Iterator[str]:
    """The section in Markdown; `flight` is a 6-DOF flight."""
    yield "\n## What was tried in vain\n"
    yield "`benchmarks/in_vain.py` measures this with the page, except where it says otherwise.\n"
    measured = of_the_law(pairs), of_the_filter(pairs), of_the_collector(flight, pairs), of_the_table(pairs)
    for line in (*measured, *_BY_HAND):
        yield f"- {line}"
