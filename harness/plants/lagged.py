"""The plant `lagged`: the heading rate follows its command with the identified response of the inner loop, gain one."""

import math
from dataclasses import dataclass

from autopilot.angles import wrap
from autopilot.response import Propagator, Response, dot, gauss
from harness.plants.level import Level
from harness.plants.plant import Flying, Start
from harness.world.air import Air

_NODES = 4  # of the quadrature of the position in a piece of at most 50 ms
_WEIGHTS = tuple(float(weight) for weight in gauss(_NODES)[1])


@dataclass(frozen=True, slots=True)
class Lagged:
    """Level flight at constant airspeed. The heading is exact, the position a quadrature (1e-8 m off in 400 m)."""

    response: Response

    def start(self, start: Start, air: Air) -> Flying:
        return _LaggedFlying(self.response, start, air)


class _LaggedFlying:
    def __init__(self, response: Response, start: Start, air: Air) -> None:
        self._propagator, self._level, self._airspeed = Propagator(response, _NODES), Level(start, air), start.airspeed
        self.state = self._level.state(*start.position, start.airspeed, wrap(start.heading), 0.0)

    def advance(self, heading_rate: float, period: float) -> None:
        propagator, v_a = self._propagator, self._airspeed
        x, y, psi = self.state.north, self.state.east, self.state.heading
        for now, piece in propagator.pieces(heading_rate, period):
            *turned, turn = [dot(row, now) for row in piece.integrals]
            x += v_a * piece.length * dot(_WEIGHTS, [math.cos(psi + angle) for angle in turned])
            y += v_a * piece.length * dot(_WEIGHTS, [math.sin(psi + angle) for angle in turned])
            psi += turn
        north, east = self._level.carried(period)
        self.state = self._level.state(x + north, y + east, v_a, wrap(psi), propagator.output)
