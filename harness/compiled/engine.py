"""The compiled engine: flies a flight by a kernel, bit for bit as `harness.loop` does, where that can be."""

import math
import struct
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from autopilot.guidance import Remembering
from autopilot.response import Delay, Piece
from harness import loop
from harness.compiled.closure import NotLiftedError, form
from harness.compiled.kernel import Kernel, NotCompiledError, is_installed, kernel, refuse
from harness.compiled.loop import (
    COMPLETED,
    NOT_FLYING,
    TARGET_LOST,
    UNUSUAL,
    at_once,
    flown,
    forgetting,
    in_pieces,
    looking,
    moving,
)
from harness.flight import Flight, air_of, command_delay, context_of, plant_of
from harness.knowledge import Estimation, Instruments, Sighting, perfect_estimator, sighting
from harness.log import COLUMNS, FlightLog
from harness.plants.late import Late
from harness.plants.level import InPieces, Level, MovingInPieces, States
from harness.plants.plant import End, Outcome
from harness.plants.state import State
from harness.toml_text import shortened
from harness.world.air import Air
from harness.world.target import Leg, Target, TargetState
from harness.world.track import Track, load_track

Array = NDArray[np.float64]
_TRIED = 100.0  # s of the first flight of a kernel, which Python flies as well
_AT_ONCE = 20_000  # rows between two calls of `watch`
_TRUSTED: set[Any] = set()  # kernels, and forms of memory, that flew a flight as Python did


def simulate(flight: Flight, watch: loop.Watch | None = None) -> FlightLog:
    """Like `harness.loop.simulate` of a flight that has been checked: by a kernel where that can be, else by Python."""
    try:
        return _trusted(flight, watch)
    except NotCompiledError:
        return loop.simulate(flight, watch)


def why_plain(flight: Flight) -> str:
    """Why Python flies this flight; empty where a kernel does. It is compiled and its beginning is tried."""
    try:
        _trusted(_beginning(flight), None)
    except NotCompiledError as error:
        return str(error)
    except ValueError:  # it cannot be flown at all: that is told where it is flown
        pass
    return ""


def _trusted(flight: Flight, watch: loop.Watch | None) -> FlightLog:
    """The log as a kernel makes it; Python flies the beginning of each kernel's first flight in a process as well.

    Raises `NotCompiledError`, and what `harness.loop.simulate` raises.
    """
    if not is_installed():
        raise NotCompiledError("there is no Numba: pip install 'standoff-harness[fast]'")
    ready = _ready(flight)
    compiled, held = kernel(ready.function)
    log = _flown(flight, watch, ready, compiled, held)
    if (compiled, ready.form) not in _TRUSTED:
        if not _begins(log, loop.simulate(_beginning(flight))):
            refuse(ready.function, "compiled, it does not fly to the last bit as in Python")
            raise NotCompiledError("compiled, it does not fly to the last bit as in Python")
        _TRUSTED.add((compiled, ready.form))
    return log


def _beginning(flight: Flight) -> Flight:
    """The beginning of the flight, `_TRIED` seconds at most."""
    periods = max(1, math.floor(_TRIED / flight.guidance_period))
    return flight if periods >= flight.periods else replace(flight, duration=periods * flight.guidance_period)


def _begins(log: FlightLog, plain: FlightLog) -> bool:
    """Whether a log begins with the bits of another, which ends as it does or at an earlier time."""
    as_it_does = plain.outcome is log.outcome or (plain.outcome is Outcome.COMPLETED and len(plain) < len(log))
    return as_it_does and np.array_equal(plain.whole, log.whole[: len(plain)], equal_nan=True)


class _Arrays(NamedTuple):
    """What a kernel reads and fills, row by row."""

    table: Array
    target: Array
    seen: Array  # the target as the law knows it
    noise: Array  # of the course, or none
    told: Array  # the law's own channels


_Progress = Iterator[tuple[int, int]]  # how the flight has ended, and the number of rows that are filled


class _Ready(NamedTuple):
    """A flight before its first row."""

    function: Callable[..., Any]  # what is compiled
    form: Any  # of what the law remembers: for another it is compiled anew
    fly: Callable[[Callable[..., Any], Any, _Arrays, bool], _Progress]
    """By the compiled function and the numbers that it holds, into rows; last, whether somebody watches."""


def _ready(flight: Flight) -> _Ready:
    """Raises `NotCompiledError` for a flight that cannot be compiled, or whose law cannot start."""
    air = air_of(flight)
    flying = plant_of(flight).start(flight.start, air)
    try:
        law = loop.begun(flight.law, context_of(flight))
    except End as end:
        raise NotCompiledError(str(end)) from None
    own = law if isinstance(law, Remembering) else Remembering(forgetting(law), ())
    if isinstance(flying, Level):
        return _in_closed_form(flight, own, air, flying)
    return _by_steps(flight, own, flying)


def _in_closed_form(flight: Flight, law: Remembering[Any], air: Air, flying: Level) -> _Ready:
    """The whole loop is compiled."""
    last, (whole, part) = flight.periods, command_delay(flight)
    parts = (part, flight.guidance_period - part) if part else (flight.guidance_period,)
    late = np.empty(last), whole, np.array(parts)
    step = at_once(flying.move)
    states: States = ()
    line: tuple[Any, ...] = ()
    if isinstance(flying.move, MovingInPieces):
        motion = flying.move.motion
        step, states = in_pieces(motion.commanded, motion.piece, motion.ended), motion.states
        line = np.empty(last * len(parts)), *_line(motion, parts, last)

    def fly(compiled: Callable[..., Any], held: Any, rows: _Arrays, watched: bool) -> _Progress:
        velocity, drift = air.sampled(late[-1], last)
        done, state, ended = 0, (tuple(flying.moved), states, law.memory), COMPLETED
        while done <= last and ended == COMPLETED:
            end = min(last + 1, done + _AT_ONCE if done else 1) if watched else last + 1
            before = velocity, drift, late, line, (done, end, last), flight.start.altitude
            ended, done, *state = compiled(*rows, *before, _known(flight), *state, *held)
            yield ended, done

    return _Ready(flown(looking(law.step), step), _form(law.memory), fly)


def _by_steps(flight: Flight, law: Remembering[Any], flying: Any) -> _Ready:
    """JSBSim flies the periods, and what is done between two of them is compiled."""
    from harness.compiled.stepwise import reading  # late: only this plant needs JSBSim
    from harness.plants.sixdof import SixDofFlying

    if not isinstance(flying, SixDofFlying):
        raise NotCompiledError(f"the plant {flight.plant} has no closed form")
    period, last, readers = flight.guidance_period, flight.periods, flying.readers
    stall, frame = flying.stall, flying.frame
    record = struct.Struct(f"{len(readers) + 1}d")

    def fly(compiled: Callable[..., Any], held: Any, rows: _Arrays, watched: bool) -> _Progress:
        values, known, memory = bytearray(record.size), _known(flight), law.memory
        read, before = np.frombuffer(values), flying.heading()
        late = Late(flying, *command_delay(flight)) if flight.errors.command_delay else None
        length = period  # of what was flown last: commands that are late act in two parts of a period
        for k in range(last + 1):
            record.pack_into(values, 0, *[get() for get in readers], before)
            ended, command, memory = compiled(read, *rows, k, k == 0, stall, frame, known, memory, *held)
            if ended == NOT_FLYING:
                if not watched:  # it may end here
                    yield COMPLETED, k
                flying.judge(State._make(rows.table[k, 1 : 1 + len(State._fields)].tolist()), length)
                ended, command, memory = compiled(read, *rows, k, True, stall, frame, known, memory, *held)
            else:
                flying.stalled_for = 0.0
            if watched or late or ended != COMPLETED or k == last:  # late, it may end within the period
                yield ended, k + 1
            if ended != COMPLETED:
                return
            if k < last:
                if late:
                    *earlier, (command, length) = late.parts(command, period)
                    for part in earlier:
                        flying.advance(*part)
                before = flying.fly(command, length)

    return _Ready(reading(looking(law.step)), _form(law.memory), fly)


def _form(memory: Any) -> Any:
    """The form of what a law remembers. Raises `NotCompiledError`."""
    try:
        return form("its memory holds", memory)
    except NotLiftedError as error:
        raise NotCompiledError(str(error)) from None


def _known(flight: Flight) -> tuple[float, ...]:
    """What of a flight does not change: see `looking`."""
    instruments = Instruments(flight)
    range_ = flight.metrics.monitoring_range or math.inf
    wind = map(float, instruments.wind)
    return flight.guidance_period, flight.start.airspeed, *wind, instruments.scale, range_


def _flown(
    flight: Flight, watch: loop.Watch | None, ready: _Ready, compiled: Kernel, held: tuple[Any, ...]
) -> FlightLog:
    """The log of the flight. Raises `NotCompiledError` where it is left to Python."""
    period, last = flight.guidance_period, flight.periods
    track = load_track(Path(flight.target.track)) if flight.target.track is not None else None
    target = _target(flight.target, track, period, last)
    seen, estimates = _seen(flight, track, target)
    table, told = (np.empty((last + 1, n)) for n in (len(COLUMNS), len(compiled.told)))
    rows = _Arrays(table, target, seen, Instruments(flight).turns(last + 1), told)
    done, outcome, reason = 0, Outcome.COMPLETED, ""

    def log_so_far() -> FlightLog:
        channels = {f"law_{name}": told[:done, i] for i, name in enumerate(compiled.told)}
        log = FlightLog(flight, outcome, reason, table[:done], channels)
        return loop.completed(log, estimates[:done] if estimates is not None else None)

    progress = ready.fly(compiled.fly, held, rows, watch is not None)
    try:
        while now := _next(progress, ready.function):
            ended, done = now
            if ended == UNUSUAL:
                raise NotCompiledError("the law answers what is no finite number")
            if watch:
                watch((done - 1) * period, log_so_far)
            if ended == TARGET_LOST:
                raise loop.lost(flight)
    except End as end:
        outcome, reason = end.outcome, str(end)
    return log_so_far()


def _next(progress: _Progress, function: Any) -> tuple[int, int] | None:
    """The next progress of a flight; None when it has ended."""
    try:
        return next(progress, None)
    except End:
        raise
    except (Exception, SystemExit) as error:
        _judge(function, error)
        raise NotCompiledError(f"an error in the flight: {error}") from None


def _judge(function: Any, error: BaseException) -> None:
    """Refuses a loop that Numba cannot compile; an error of the flight is that flight's alone."""
    from numba.core.errors import NumbaError

    if isinstance(error, NumbaError):
        lines = [line.strip() for line in str(error).splitlines() if line.strip()]
        why = f"Numba does not compile it: {shortened(' '.join(lines[1:3]))}"
        refuse(function, why)
        raise NotCompiledError(why) from None


@lru_cache(maxsize=8)
def _target(target: Target, track: Track | None, period: float, last: int) -> Array:
    """The target at each row, as `TargetState`: (last + 1, 6); `track` as its file is now."""
    if track is None and (target.speed or target.segments):
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


def _seen(flight: Flight, track: Track | None, target: Array) -> tuple[Array, Array | None]:
    """The target as the law knows it at each row, and the rows of an `Estimation`."""
    if not flight.estimator.filters:
        truth = TargetState(*target.T)
        known = perfect_estimator(flight.estimator)(0, truth)
        return target if known is truth else np.column_stack(np.broadcast_arrays(*known)), None
    return _estimated(sighting(flight), track)


@lru_cache(maxsize=1)
def _estimated(of: Sighting, track: Track | None) -> tuple[Array, Array]:
    """The same with a filter; of flights that differ in plant or law alone it is made once."""
    estimation = Estimation(of)
    try:
        last = estimation.at(of.periods, TargetState(0.0, 0.0, 0.0, 0.0))  # the truth is not used
    except End as end:
        raise NotCompiledError(str(end)) from None
    rows = estimation.rows
    seen = np.tile(np.array(last), (len(rows), 1))
    seen[:, :4] = rows[:, :4]  # what no filter estimates is the same throughout
    return seen, rows


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
