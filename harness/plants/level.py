"""Level flight in moving air: what the plants `kinematic`, `lagged` and `coordinated` share.

What moves them relative to the air is in pure functions of floats, so that they can be compiled.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

from autopilot.angles import wrap
from autopilot.response import Delay, Piece, Propagator
from harness.plants.plant import Start
from harness.plants.state import NAN, State
from harness.world.air import Air


class Motion(NamedTuple):
    """The motion of the aircraft. SI, rad; NaN for what the plant lacks."""

    north: float
    east: float
    airspeed: float
    heading: float
    heading_rate: float = NAN
    bank: float = NAN
    roll_rate: float = NAN
    bank_command: float = NAN


_moved, _state = Motion._make, State._make  # from a tuple, in half the time of the constructor
Move = Callable[[Motion, float, float], Motion]
"""Advances the aircraft with a heading-rate command, rad/s, over a time, s, in still air."""
States = tuple[float, ...]


class InPieces(NamedTuple):
    """The motion of a plant behind a delay, in pieces within which what acts is constant."""

    states: States  # at the start
    commanded: Callable[[float], float]  # from the heading-rate command to what is given to the delay
    piece: Callable[[Motion, States, float, Piece], tuple[Motion, States]]  # over a piece, with what acts in it
    ended: Callable[[Motion, States, float, float], Motion]  # at the end of a period: what acted last, what was given
    propagator: Propagator
    of_length: Callable[[int], tuple[int, Piece]]  # see `Propagator.piece`


class MovingInPieces:
    """Such a motion in flight: a `Move` that remembers the commands on their way and its states."""

    def __init__(self, motion: InPieces) -> None:
        self.motion = motion
        self._states, self._delay = motion.states, Delay(motion.propagator.delay)

    def __call__(self, now: Motion, heading_rate: float, period: float) -> Motion:
        motion, states, acts = self.motion, self._states, 0.0
        given = motion.commanded(heading_rate)
        for acts, length in self._delay.pieces(given, period):
            count, piece = motion.of_length(length)
            for _ in range(count):
                now, states = motion.piece(now, states, acts, piece)
        self._states = states
        return motion.ended(now, states, acts, given)


class Level:
    """A plant in flight: the air carries the aircraft at once, as in Eq. (1), at constant altitude.

    The state holds the gust velocity of the present step; the displacement over a period is the integral of the gusts.
    """

    def __init__(self, start: Start, air: Air, move: Move, moved: Motion) -> None:
        self.move, self.moved = move, moved
        self._altitude, self._air, self._step = start.altitude, air, 0
        self.state = self._state()

    def advance(self, heading_rate: float, period: float) -> None:
        moved = self.move(self.moved, heading_rate, period)
        air, begin = self._air, self._step
        self._step += round(period / air.step)
        W_x, W_y = air.steady
        gusts_x, gusts_y = air.drift(begin, self._step)
        self.moved = carried(moved, W_x * period + gusts_x, W_y * period + gusts_y)
        self.state = self._state()

    def _state(self) -> State:
        W_x, W_y = self._air.horizontal(self._step)
        return level_state(self.moved, self._altitude, W_x, W_y, self._air.gust(self._step)[2])


def at_start(start: Start) -> tuple[float, float, float, float, float]:
    """Position, airspeed, heading and heading rate of an aircraft that flies straight."""
    return *start.position, start.airspeed, wrap(start.heading), 0.0


def carried(moved: Motion, north: float, east: float) -> Motion:
    """The aircraft after the air has moved by so much, m."""
    x, y, v_a, psi, rate, bank, roll_rate, bank_command = moved
    return _moved((x + north, y + east, v_a, psi, rate, bank, roll_rate, bank_command))


def level_state(moved: Motion, altitude: float, W_x: float, W_y: float, down: float) -> State:
    """The state in air of this velocity, m/s."""
    x, y, v_a, psi, rate, bank, roll_rate, bank_command = moved
    return _state(
        (
            x, y, v_a * math.cos(psi) + W_x, v_a * math.sin(psi) + W_y, v_a, psi, rate, bank, roll_rate, altitude, 0.0,
            NAN, NAN, NAN, NAN, bank_command, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN, W_x, W_y, down,
        )
    )  # fmt: skip
