"""The plant `lagged`: the heading rate follows its command with the identified response of the inner loop, gain one."""

import math
from dataclasses import dataclass
from functools import lru_cache

from autopilot.angles import wrap
from autopilot.response import Piece, Propagator, Response, dot, gauss, moved_on
from harness.plants.level import InPieces, Level, Motion, MovingInPieces, States, at_start
from harness.plants.plant import Flying, Start
from harness.world.air import Air

_NODES = 4  # nodes of the quadrature of the position in a piece of at most 50 ms
_WEIGHTS = tuple(float(weight) for weight in gauss(_NODES)[1])


@dataclass(frozen=True, slots=True)
class Lagged:
    """Level flight at constant airspeed. The heading is exact, the position a quadrature (1e-8 m off in 400 m)."""

    response: Response

    def start(self, start: Start, air: Air) -> Flying:
        return Level(start, air, MovingInPieces(motion(self.response)), Motion(*at_start(start)))


@lru_cache(maxsize=64)
def motion(response: Response) -> InPieces:
    """The motion behind this response, from rest."""
    propagator = Propagator(response, _NODES)
    output = propagator.output

    def commanded(heading_rate: float) -> float:
        return heading_rate

    def ended(now: Motion, states: States, acts: float, given: float) -> Motion:
        return Motion(now.north, now.east, now.airspeed, wrap(now.heading), dot(output, states))

    return InPieces((0.0,) * len(output), commanded, turned, ended, propagator, propagator.piece)


def turned(now: Motion, states: States, acts: float, piece: Piece) -> tuple[Motion, States]:
    """The motion over a piece."""
    x, y, v_a, psi = now.north, now.east, now.airspeed, now.heading
    vector, rows = (*states, acts), piece.integrals
    a, b = psi + dot(rows[0], vector), psi + dot(rows[1], vector)
    c, d = psi + dot(rows[2], vector), psi + dot(rows[3], vector)
    x += v_a * piece.length * dot(_WEIGHTS, (math.cos(a), math.cos(b), math.cos(c), math.cos(d)))
    y += v_a * piece.length * dot(_WEIGHTS, (math.sin(a), math.sin(b), math.sin(c), math.sin(d)))
    return Motion(x, y, v_a, psi + dot(rows[4], vector)), moved_on(piece.end, vector)
