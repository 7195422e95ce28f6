"""The plant `coordinated`: bank and airspeed have dynamics and limits of their own; every turn is coordinated."""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

import numpy as np
from annotated_types import Gt

from autopilot.angles import wrap
from autopilot.quantities import About
from autopilot.response import Propagator, Response, dot, gauss
from harness.plants.level import Level
from harness.plants.plant import Flying, Start
from harness.plants.turn import GRAVITY, bank_of_turn
from harness.world.air import Air

_NODES = 3  # of the collocation in a piece of at most 50 ms
_GAUSS_NODES, _WEIGHTS_TO_END, _WEIGHTS_TO_NODES = gauss(_NODES)
_WEIGHTS = tuple(float(weight) for weight in _WEIGHTS_TO_END)
_TO_NODES = tuple(tuple(float(weight) for weight in row) for row in _WEIGHTS_TO_NODES)


@dataclass(frozen=True, slots=True, kw_only=True)
class AirspeedHold:
    """The change of airspeed, m/s, that a turn causes: gain s e / (s^2 + 2 damping frequency s + frequency^2).

    The input e = 1/cos(bank) - 1 is the load factor beyond one. The gain stands for the drag that a turn adds, minus
    the thrust that the airspeed hold adds in advance; the hold then brings the airspeed back.
    """

    gain: Annotated[float, About("m/s^2 per unit of load factor beyond one")]
    frequency: Annotated[float, Gt(0), About("rad/s: of the hold")]
    damping: Annotated[float, Gt(0), About("of the hold")]


@dataclass(frozen=True, slots=True)
class Coordinated:
    """Level flight without sideslip: heading rate = g tan(bank) / V.

    The inner loop's bank command and bank limit apply, without its rate trim: a coordinated turn has no shortfall of
    turn rate to remove. Between commands the bank is exact; airspeed, heading and position follow from the bank by
    collocation at Gauss's nodes.
    """

    bank: Response
    airspeed: AirspeedHold
    bank_limit: float  # rad

    def start(self, start: Start, air: Air) -> Flying:
        return _CoordinatedFlying(self, start, air)


class _CoordinatedFlying:
    def __init__(self, plant: Coordinated, start: Start, air: Air) -> None:
        self._propagator, self._level = Propagator(plant.bank, _NODES), Level(start, air)
        self._hold, self._limit, self._nominal = plant.airspeed, plant.bank_limit, start.airspeed
        self._change = self._summed = 0.0  # the change of airspeed, m/s, and its integral, m
        self.state = self._level.state(*start.position, start.airspeed, wrap(start.heading), 0.0, 0.0, 0.0, 0.0)

    def advance(self, heading_rate: float, period: float) -> None:
        propagator = self._propagator
        x, y, psi = self.state.north, self.state.east, self.state.heading
        command = bank_command(heading_rate, self._nominal, self._limit)
        for now, piece in propagator.pieces(command, period):
            h = piece.length
            tangents = [math.tan(dot(row, now)) for row in piece.outputs]
            excess = [math.sqrt(1.0 + t * t) - 1.0 for t in tangents]
            moved = (self._change, self._summed, *excess)
            *changes, self._change, self._summed = [dot(row, moved) for row in _airspeed_rows(self._hold, h)]
            speeds = [self._nominal + change for change in changes]
            rates = [GRAVITY * t / V for t, V in zip(tangents, speeds, strict=True)]
            headings = [psi + h * dot(row, rates) for row in _TO_NODES]
            x += h * dot(_WEIGHTS, [V * math.cos(angle) for V, angle in zip(speeds, headings, strict=True)])
            y += h * dot(_WEIGHTS, [V * math.sin(angle) for V, angle in zip(speeds, headings, strict=True)])
            psi += h * dot(_WEIGHTS, rates)
        north, east = self._level.carried(period)
        bank, V = propagator.output, self._nominal + self._change
        rate = GRAVITY * math.tan(bank) / V
        self.state = self._level.state(x + north, y + east, V, wrap(psi), rate, bank, propagator.slope, command)


def bank_command(heading_rate: float, airspeed: float, limit: float) -> float:
    """The bank, rad, that the inner loop commands for a heading rate: tan(bank) = V rate / g, within +-`limit`."""
    return max(-limit, min(limit, bank_of_turn(airspeed, heading_rate)))


@lru_cache(maxsize=64)
def _airspeed_rows(hold: AirspeedHold, h: float) -> tuple[tuple[float, ...], ...]:
    """One collocation step of h seconds of v' = -2 d w v - w^2 i + gain e, i' = v, as rows of a matrix.

    Each row multiplies (v now, i now, e at each node). The rows give v at each node, v at the end and i at the end.
    """
    F = np.array([[-2.0 * hold.damping * hold.frequency, -(hold.frequency**2)], [1.0, 0.0]])
    now = np.hstack([np.tile(np.eye(2), (_NODES, 1)), np.zeros((2 * _NODES, _NODES))])
    drive = np.hstack([np.zeros((_NODES, 2)), np.eye(_NODES)])
    forced = np.kron(drive, np.array([[hold.gain], [0.0]]))  # of (v, i) at each node
    at_nodes = np.linalg.solve(
        np.eye(2 * _NODES) - h * np.kron(_WEIGHTS_TO_NODES, F), now + h * np.kron(_WEIGHTS_TO_NODES, np.eye(2)) @ forced
    )
    slopes = np.kron(np.eye(_NODES), F) @ at_nodes + forced
    end = now[:2] + h * np.kron(_WEIGHTS_TO_END, np.eye(2)) @ slopes
    return tuple(tuple(float(v) for v in row) for row in (*at_nodes[::2], *end))
