"""The plant `kinematic`, the paper's Eq. (1): level, constant airspeed, the commanded heading rate at once."""

import math
from dataclasses import dataclass

from autopilot.angles import wrap
from harness.plants.level import Level, Motion, at_start
from harness.plants.plant import Flying, Start
from harness.world.air import Air

_moved = Motion._make


@dataclass(frozen=True, slots=True)
class Kinematic:
    """Eq. (1). Between commands the motion is exact: a circular arc relative to the air, plus the motion of the air."""

    def start(self, start: Start, air: Air) -> Flying:
        return Level(start, air, arc, Motion(*at_start(start)))


def arc(now: Motion, heading_rate: float, period: float) -> Motion:
    """The motion while this heading rate is held."""
    x, y, v_a, psi, _, bank, roll_rate, bank_command = now
    half_turn = 0.5 * heading_rate * period
    chord = v_a * period * (math.sin(half_turn) / half_turn if half_turn else 1.0)
    x += chord * math.cos(psi + half_turn)
    y += chord * math.sin(psi + half_turn)
    return _moved((x, y, v_a, wrap(psi + 2.0 * half_turn), heading_rate, bank, roll_rate, bank_command))
