"""The plant `kinematic`, the paper's Eq. (1): level, constant airspeed, the commanded heading rate at once."""

import math
from dataclasses import dataclass

from autopilot.angles import wrap
from harness.plants.level import Level
from harness.plants.plant import Flying, Start
from harness.world.air import Air


@dataclass(frozen=True, slots=True)
class Kinematic:
    """Eq. (1). Between commands the motion is exact: a circular arc relative to the air, plus the motion of the air."""

    def start(self, start: Start, air: Air) -> Flying:
        return _KinematicFlying(start, air)


class _KinematicFlying:
    def __init__(self, start: Start, air: Air) -> None:
        self._airspeed, self._level = start.airspeed, Level(start, air)
        self.state = self._level.state(*start.position, start.airspeed, wrap(start.heading), 0.0)

    def advance(self, heading_rate: float, period: float) -> None:
        x, y, psi = self.state.north, self.state.east, self.state.heading
        half_turn = 0.5 * heading_rate * period
        chord = self._airspeed * period * (math.sin(half_turn) / half_turn if half_turn else 1.0)
        x += chord * math.cos(psi + half_turn)
        y += chord * math.sin(psi + half_turn)
        north, east = self._level.carried(period)
        self.state = self._level.state(x + north, y + east, self._airspeed, wrap(psi + 2.0 * half_turn), heading_rate)
