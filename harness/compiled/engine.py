"""The compiled engine: flies a flight by a kernel, bit for bit as `harness.loop` does, where that can be."""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from autopilot.response import Delay, Piece
from harness import loop
from harness.compiled.kernel import Kernel, NotCompiledError, is_installed, kernel, refuse
from harness.compiled.loop import COMPLETED, TARGET_LOST, UNUSUAL, at_once, flown, in_pieces, moving
from harness.flight import Flight, air_of, command_delay, context_of, plant_of
from harness.knowledge import Estimation, Instruments, perfect_estimator
from harness.log import COLUMNS, FlightLog
from harness.plants.level import InPieces, Level, MovingInPieces
from harness.plants.plant import End, Outcome
from harness.toml_text import shortened
from harness.world.air import Air
from harness.world.target import Leg, Target, TargetState

Array = NDArray[np.float64]
_AT_ONCE = 20_000  # rows between two calls of `watch`
_TRUSTED: set[Any] = set()  # kernels that flew a flight as Python did


def simulate(flight: Flight, watch: loop.Watch | None = None) -> FlightLog:
    """Like `harness.loop.simulate` of a flight that has been checked: by a kernel where that can be, else by Python."""
    try:
        return _trusted(flight, watch)
    except NotCompiledError:
        return loop.simulate(flight, watch)


def why_plain(flight: Flight) -> str:
    """Why Python flies this flight; empty where a kernel does. It is compiled and tried, once in a process."""
    try:
        _trusted(flight, None)
    except NotCompiledError as error:
        return str(error)
    except ValueError:  # it cannot be flown at all: that is told where it is flown
        pass
    return ""


def _trusted(flight: Flight, watch: loop.Watch | None) -> FlightLog:
    """The log as a kernel makes it; the first flight of each kernel in a process is flown by Python as well.

    Raises `NotCompiledError`, and what `harness.loop.simulate` raises.
    """
    if not is_installed():
        raise NotCompiledError("there is no Numba: pip install 'standoff-harness[fast]'")
    ready = _ready(flight)
    compiled, numbers = kernel(ready.function)
    log = _flown(flight, watch, ready, compiled, numbers)
    if compiled not in _TRUSTED:
        plain = loop.simulate(flight)
        if plain.outcome is not log.outcome or not np.array_equal(plain.whole, log.whole, equal_nan=True):
            refuse(ready.function, "compiled, it does not fly to the last bit as in Python")
            raise NotCompiledError("compiled, it does not fly to the last bit as in Python")
        _TRUSTED.add(compiled)
    return log


class _Ready(NamedTuple):
    """A flight before its first row."""

    function: Callable[..., Any]  # its loop
    air: Air
    now: tuple[float, ...]
    states: tuple[float, ...]
    late: tuple[Array, int, Array]  # commands, and how late they are: see `flown`
    line: tuple[Any, ...]  # of `in_pieces`


def _ready(flight: Flight) -> _Ready:
    """Raises `NotCompiledError` for a flight that has no closed form, or whose law cannot start."""
    air = air_of(flight)
    flying = plant_of(flight).start(flight.start, air)
    if not isinstance(flying, Level):
        raise NotCompiledError(f"the plant {flight.plant} has no closed form")
    try:
        law = loop.begun(flight.law, context_of(flight))
    except End as end:
        raise NotCompiledError(str(end)) from None
    whole, part = command_delay(flight)
    parts = (part, flight.guidance_period - part) if part else (flight.guidance_period,)
    late = np.empty(flight.periods), whole, np.array(parts)
    if not isinstance(flying.move, MovingInPieces):
        return _Ready(flown(law, at_once(flying.move)), air, tuple(flying.moved), (), late, ())
    motion = flying.move.motion
    step = in_pieces(motion.commanded, motion.piece, motion.ended)
    line = np.empty(flight.periods * len(parts)), *_line(motion, parts, flight.periods)
    return _Ready(flown(law, step), air, tuple(flying.moved), motion.states, late, line)


def _flown(
    flight: Flight, watch: loop.Watch | None, ready: _Ready, compiled: Kernel, held: tuple[Any, ...]
) -> FlightLog:
    """The log of the flight. Raises `NotCompiledError` where it is left to Python."""
    period, last, instruments = flight.guidance_period, flight.periods, Instruments(flight)
    target = _target(flight.target, period, last)
    seen, rows = _known(flight, target)
    table, told = (np.empty((last + 1, n)) for n in (len(COLUMNS), len(compiled.told)))
    fixed = (
        period, flight.start.altitude, flight.start.airspeed, *map(float, instruments.wind), instruments.scale,
        flight.metrics.monitoring_range or math.inf,
    )  # fmt: skip
    air, drift = ready.air.sampled(ready.late[-1], last)
    before = target, seen, air, drift, instruments.turns(last + 1), told, ready.late, ready.line
    done, state, ended = 0, (ready.now, ready.states), COMPLETED
    outcome, reason = Outcome.COMPLETED, ""

    def log_so_far() -> FlightLog:
        channels = {f"law_{name}": told[:done, i] for i, name in enumerate(compiled.told)}
        log = FlightLog(flight, outcome, reason, table[:done], channels)
        return loop.completed(log, rows[:done] if rows is not None else None)

    while done <= last and ended == COMPLETED:
        end = min(last + 1, done + _AT_ONCE if done else 1) if watch else last + 1
        try:
            ended, done, *state = compiled.fly(table, *before, (done, end, last), fixed, *state, held)
        except (Exception, SystemExit) as error:
            _judge(ready.function, error)
            raise NotCompiledError(f"an error in the flight: {error}") from None
        if ended == UNUSUAL:
            raise NotCompiledError("the law answers what is no finite number")
        if watch:
            watch((done - 1) * period, log_so_far)
    if ended == TARGET_LOST:
        lost = loop.lost(flight)
        outcome, reason = lost.outcome, str(lost)
    return log_so_far()


def _judge(function: Any, error: BaseException) -> None:
    """Refuses a loop that Numba cannot compile; an error of the flight is that flight's alone."""
    from numba.core.errors import NumbaError

    if isinstance(error, NumbaError):
        lines = [line.strip() for line in str(error).splitlines() if line.strip()]
        why = f"Numba does not compile it: {shortened(' '.join(lines[1:3]))}"
        refuse(function, why)
        raise NotCompiledError(why) from None


@lru_cache(maxsize=8)
def _target(target: Target, period: float, last: int) -> Array:
    """The target at each row, as `TargetState`: (last + 1, 6)."""
    if target.track is None and (target.speed or target.segments):
        return _moving(target, period, last)
    at = target.start()
    return np.array([at(k * period) for k in range(last + 1)], dtype=np.float64)


def _moving(target: Target, period: float, last: int) -> Array:
    """The rows of a target that moves in legs. Raises `NotCompiledError`."""
    compiled, held = kernel(moving(Leg.at))
    rows = np.empty((last + 1, len(TargetState._fields)))
    try:
        compiled.fly(rows, np.array(target.legs(), dtype=np.float64), period, *held)
    except Exception as error:
        _judge(moving(Leg.at), error)
        raise NotCompiledError(f"an error in the target's motion: {error}") from None
    if compiled not in _TRUSTED:
        at = target.start()
        if not np.array_equal(rows, np.array([at(k * period) for k in range(last + 1)])):
            refuse(moving(Leg.at), "compiled, a target does not move to the last bit as in Python")
            raise NotCompiledError("compiled, a target does not move to the last bit as in Python")
        _TRUSTED.add(compiled)
    return rows


def _known(flight: Flight, target: Array) -> tuple[Array, list[tuple[float, ...]] | None]:
    """The target as the law knows it at each row, and the rows of an `Estimation`."""
    if not flight.estimator.filters:
        truth = TargetState(*target.T)
        known = perfect_estimator(flight.estimator)(0, truth)
        return target if known is truth else np.column_stack(np.broadcast_arrays(*known)), None
    estimation = Estimation(flight, flight.target.start())
    nothing = TargetState(0.0, 0.0, 0.0, 0.0)  # not used
    try:
        return np.array([estimation.at(k, nothing) for k in range(len(target))]), estimation.rows
    except End as end:
        raise NotCompiledError(str(end)) from None


@lru_cache(maxsize=16)
def _line(motion: InPieces, parts: tuple[float, ...], last: int) -> tuple[Array | NDArray[np.int64], ...]:
    """What `in_pieces` is told: where the pieces of each part of the periods begin, and what they are.

    First of each piece the row of the command that acts in it, -1 for none yet, and its kind; then of each kind its
    length and its rows.
    """
    delay, begins = Delay(motion.propagator.delay), [0]
    sources: list[int] = []
    kinds: list[int] = []
    known: dict[int, tuple[int, Piece]] = {}
    for number in range(last * len(parts)):
        for command, length in delay.pieces(number + 1.0, parts[number % len(parts)]):  # for a command its number
            count, piece = motion.of_length(length)
            kind, _ = known.setdefault(length, (len(known), piece))
            sources += [int(command) - 1] * count
            kinds += [kind] * count
        begins.append(len(kinds))
    pieces = [piece for _, piece in known.values()]
    rows = [np.array([getattr(piece, name) for piece in pieces]) for name in Piece._fields]
    rows = [
        array if array.ndim == n else np.empty((len(pieces), 0, 0))
        for array, n in zip(rows, (1, 3, 3, 3, 3), strict=True)
    ]
    return np.array(begins), np.array(sources), np.array(kinds), *rows
