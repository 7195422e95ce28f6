"""The paper's plant, Eq. (1): constant airspeed, level, the commanded heading rate followed at once."""

import math
from dataclasses import dataclass

from autopilot.angles import wrap
from harness.plant import Flying, Start
from harness.state import State
from harness.wind import Wind

_NO_AIRFRAME = (math.nan,) * (State._fields.index("throttle") - State._fields.index("velocity_down"))


@dataclass(frozen=True, slots=True)
class Kinematic:
    """Eq. (1). Between commands the motion is exact: a circular arc in the air, carried by the wind."""

    def start(self, start: Start, wind: Wind) -> Flying:
        return _KinematicFlying(start, wind)


class _KinematicFlying:
    def __init__(self, start: Start, wind: Wind) -> None:
        self._airspeed, self._altitude = start.airspeed, start.altitude
        self._wind = wind.steady
        self.state = self._state(*start.position, wrap(start.heading), 0.0)

    def advance(self, heading_rate: float, period: float) -> None:
        x, y, psi = self.state.north, self.state.east, self.state.heading
        W_x, W_y = self._wind
        half_turn = 0.5 * heading_rate * period
        chord = self._airspeed * period * (math.sin(half_turn) / half_turn if half_turn else 1.0)
        x += chord * math.cos(psi + half_turn) + W_x * period
        y += chord * math.sin(psi + half_turn) + W_y * period
        self.state = self._state(x, y, wrap(psi + 2.0 * half_turn), heading_rate)

    def _state(self, x: float, y: float, psi: float, heading_rate: float) -> State:
        v_a = self._airspeed
        W_x, W_y = self._wind
        return State._make(
            (
                x, y, v_a * math.cos(psi) + W_x, v_a * math.sin(psi) + W_y, v_a, psi, heading_rate, math.nan, math.nan,
                self._altitude, 0.0, *_NO_AIRFRAME, W_x, W_y, 0.0,
            )
        )  # fmt: skip
