"""Level flight in moving air: the part that the plants `kinematic`, `lagged` and `coordinated` share."""

import math

from harness.plants.plant import Start
from harness.plants.state import State
from harness.world.air import Air

_UNKNOWN = (math.nan,) * (State._fields.index("throttle") - State._fields.index("bank_command"))


class Level:
    """The air carries the aircraft at once, as in Eq. (1), at constant altitude.

    The state holds the gust velocity of the present step; the displacement over a period is the integral of the gusts.
    """

    def __init__(self, start: Start, air: Air) -> None:
        self._altitude, self._air, self._step = start.altitude, air, 0

    def carried(self, period: float) -> tuple[float, float]:
        """Moves on by `period` seconds and returns the displacement of the air in that time, m north and east."""
        air, begin = self._air, self._step
        self._step += round(period / air.step)
        W_x, W_y = air.steady
        gusts_x, gusts_y = air.drift(begin, self._step)
        return W_x * period + gusts_x, W_y * period + gusts_y

    def state(
        self,
        x: float,
        y: float,
        v_a: float,
        psi: float,
        heading_rate: float,
        bank: float = math.nan,
        roll_rate: float = math.nan,
        bank_command: float = math.nan,
    ) -> State:
        """The state now, from position, airspeed `v_a` and heading `psi`; SI, rad; NaN for what the plant lacks."""
        W_x, W_y = self._air.horizontal(self._step)
        return State._make(
            (
                x, y, v_a * math.cos(psi) + W_x, v_a * math.sin(psi) + W_y, v_a, psi, heading_rate, bank, roll_rate,
                self._altitude, 0.0, math.nan, math.nan, math.nan, math.nan, bank_command, *_UNKNOWN, W_x, W_y,
                self._air.gust(self._step)[2],
            )
        )  # fmt: skip
