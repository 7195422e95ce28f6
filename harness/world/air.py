"""The air of one flight: steady wind, shear, gusts and turbulence, the same for every plant and law."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Vector = tuple[float, float, float]


def _calm() -> Array:
    return np.empty((0, 3))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Air:
    """The velocity of the air, m/s, towards north, east, down, on a grid of time steps.

    It depends on neither plant nor law. Between two steps the gusts are linear in time. Without gusts the air is steady
    and has no grid.
    """

    steady: tuple[float, float] = (0.0, 0.0)
    shear: tuple[float, float] = (0.0, 0.0)  # change of the steady wind, north and east, m/s per metre above `altitude`
    altitude: float = 0.0  # m: at which the wind has no shear added
    step: float = math.inf  # s, of the grid
    gusts: Array = field(default_factory=_calm)  # (steps + 1, 3), m/s, added to the steady wind
    turbulence: Callable[[float], Array] | None = None  # its rotation by the wing span, m: see `rotation`
    _way: Array = field(init=False)  # (steps + 1, 2): integral of the gusts since the start, m, north and east

    def __post_init__(self) -> None:
        horizontal = self.gusts[:, :2]
        way = np.zeros_like(horizontal)
        np.cumsum(0.5 * self.step * (horizontal[1:] + horizontal[:-1]), axis=0, out=way[1:])
        object.__setattr__(self, "_way", way)

    def gust(self, k: int) -> Vector:
        """The gust at the k-th step, at `altitude`: m/s towards north, east, down, without the steady wind."""
        if not len(self.gusts):
            return 0.0, 0.0, 0.0
        north, east, down = self.gusts[k].tolist()
        return north, east, down

    def horizontal(self, k: int) -> tuple[float, float]:
        """Steady wind plus gust at the k-th step, at `altitude`: m/s towards north, east."""
        (W_x, W_y), (gust_x, gust_y, _) = self.steady, self.gust(k)
        return W_x + gust_x, W_y + gust_y

    def rotation(self, span: float) -> Array:
        """The rotation of the air over a wing of this span, m, at each step: (steps + 1, 4), rad/s.

        The columns are roll rate, pitch rate, and two numbers `north`, `east` from which an aircraft's heading gives
        the yaw rate: east cos(yaw) - north sin(yaw). Zero without turbulence.
        """
        return self.turbulence(span) if self.turbulence else np.zeros((len(self.gusts), 4))

    def drift(self, begin: int, end: int) -> tuple[float, float]:
        """The integral of the gusts from step `begin` to step `end`: m north, east."""
        if not len(self.gusts):
            return 0.0, 0.0
        north, east = (self._way[end] - self._way[begin]).tolist()
        return north, east

    def sampled(self, parts: Array, count: int) -> tuple[Array, Array]:
        """The air in `count` periods, of which each has parts of these lengths, s.

        `horizontal` with the velocity down at each period, m/s, and the way in each part, m: of shapes (count + 1, 3)
        and (count * len(parts), 2).
        """
        steady = np.array([*self.steady, 0.0])
        velocity = np.tile(steady, (count + 1, 1))
        way = np.tile(np.multiply.outer(parts, steady[:2]), (count, 1))
        if len(self.gusts):
            steps = np.concatenate([[0], np.cumsum(np.tile([round(part / self.step) for part in parts], count))])
            velocity += self.gusts[steps[:: len(parts)]]
            way += np.diff(self._way[steps], axis=0)
        return velocity, way
