"""The paper's plant, Eq. (1): constant airspeed, level, the commanded heading rate followed at once."""

import math
from dataclasses import dataclass

from autopilot.angles import wrap
from harness.air import Air
from harness.plant import Flying, Start
from harness.state import State

_NO_AIRFRAME = (math.nan,) * (State._fields.index("throttle") - State._fields.index("velocity_down"))


@dataclass(frozen=True, slots=True)
class Kinematic:
    """Eq. (1). Between commands the motion is exact: a circular arc in the air, which carries it.

    Gusts carry it at once. What is shown of them is their velocity now; the way between is the mean's.
    """

    def start(self, start: Start, air: Air) -> Flying:
        return _KinematicFlying(start, air)


class _KinematicFlying:
    def __init__(self, start: Start, air: Air) -> None:
        self._airspeed, self._altitude = start.airspeed, start.altitude
        self._air, self._step = air, 0
        self.state = self._state(*start.position, wrap(start.heading), 0.0)

    def advance(self, heading_rate: float, period: float) -> None:
        x, y, psi = self.state.north, self.state.east, self.state.heading
        air, begin = self._air, self._step
        self._step += round(period / air.step)
        W_x, W_y = air.steady
        gusts_x, gusts_y = air.drift(begin, self._step)
        half_turn = 0.5 * heading_rate * period
        chord = self._airspeed * period * (math.sin(half_turn) / half_turn if half_turn else 1.0)
        x += chord * math.cos(psi + half_turn) + W_x * period + gusts_x
        y += chord * math.sin(psi + half_turn) + W_y * period + gusts_y
        self.state = self._state(x, y, wrap(psi + 2.0 * half_turn), heading_rate)

    def _state(self, x: float, y: float, psi: float, heading_rate: float) -> State:
        v_a = self._airspeed
        W_x, W_y = self._air.steady
        gust_x, gust_y, gust_z = self._air.gust(self._step)
        W_x, W_y = W_x + gust_x, W_y + gust_y
        return State._make(
            (
                x, y, v_a * math.cos(psi) + W_x, v_a * math.sin(psi) + W_y, v_a, psi, heading_rate, math.nan, math.nan,
                self._altitude, 0.0, *_NO_AIRFRAME, W_x, W_y, gust_z,
            )
        )  # fmt: skip
