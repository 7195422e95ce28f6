"""The plant `coordinated`: bank and airspeed have dynamics and limits of their own; every turn is coordinated."""

import math
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Annotated

import numpy as np
from annotated_types import Gt

from autopilot.angles import wrap
from autopilot.quantities import About
from autopilot.response import ORDER, Piece, Propagator, Response, dot, gauss, moved_on
from harness.plants.level import InPieces, Level, Motion, MovingInPieces, States, at_start
from harness.plants.plant import Flying, Start
from harness.plants.turn import GRAVITY, bank_of_turn
from harness.world.air import Air

_NODES = 3  # nodes of the collocation in a piece of at most 50 ms
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
        return Level(start, air, MovingInPieces(motion(self, start.airspeed)), Motion(*at_start(start), 0.0, 0.0, 0.0))


@lru_cache(maxsize=64)
def motion(plant: Coordinated, nominal: float) -> InPieces:
    """The motion of this plant from rest; `nominal` is its airspeed then, m/s."""
    propagator, limit = Propagator(plant.bank, _NODES), plant.bank_limit
    output, slope = propagator.output, propagator.slope

    @cache
    def of_length(length: int) -> tuple[int, Piece]:
        count, piece = propagator.piece(length)
        return count, piece._replace(airspeed=_airspeed_rows(plant.airspeed, piece.length))

    def commanded(heading_rate: float) -> float:
        return bank_command(heading_rate, nominal, limit)

    def banked(now: Motion, states: States, acts: float, piece: Piece) -> tuple[Motion, States]:
        """Over a piece. The states are those of the bank, the change of airspeed, m/s, and its integral, m."""
        x, y, _, psi, _, _, _, _ = now
        h, vector, rows = piece.length, (*states[:ORDER], acts), piece.outputs
        t_1, t_2, t_3 = math.tan(dot(rows[0], vector)), math.tan(dot(rows[1], vector)), math.tan(dot(rows[2], vector))
        drive = (*states[ORDER:], excess(t_1), excess(t_2), excess(t_3))
        rows = piece.airspeed
        V_1, V_2, V_3 = nominal + dot(rows[0], drive), nominal + dot(rows[1], drive), nominal + dot(rows[2], drive)
        rates = (GRAVITY * t_1 / V_1, GRAVITY * t_2 / V_2, GRAVITY * t_3 / V_3)
        a_1, a_2, a_3 = _TO_NODES
        psi_1, psi_2, psi_3 = psi + h * dot(a_1, rates), psi + h * dot(a_2, rates), psi + h * dot(a_3, rates)
        x += h * dot(_WEIGHTS, (V_1 * math.cos(psi_1), V_2 * math.cos(psi_2), V_3 * math.cos(psi_3)))
        y += h * dot(_WEIGHTS, (V_1 * math.sin(psi_1), V_2 * math.sin(psi_2), V_3 * math.sin(psi_3)))
        change, summed = dot(rows[3], drive), dot(rows[4], drive)
        return Motion(x, y, nominal, psi + h * dot(_WEIGHTS, rates)), (*moved_on(piece.end, vector), change, summed)

    def ended(now: Motion, states: States, acts: float, given: float) -> Motion:
        V, bank = nominal + states[ORDER], states[:ORDER]
        phi = dot(output, bank)
        rate = GRAVITY * math.tan(phi) / V
        return Motion(now.north, now.east, V, wrap(now.heading), rate, phi, dot(slope, (*bank, acts)), given)

    return InPieces((0.0,) * (len(output) + 2), commanded, banked, ended, propagator, of_length)


def excess(tangent: float) -> float:
    """The load factor beyond one in a coordinated turn, from the tangent of the bank."""
    return math.sqrt(1.0 + tangent * tangent) - 1.0


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
