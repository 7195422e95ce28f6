"""The air of one flight: a steady wind, and what it does beyond that, the same for whatever flies in it."""

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
    """Velocities of the air, m/s towards north, east, down, on a grid of steps: never the plant's or the law's own.

    Between two steps the gusts go in a straight line; without any, the air is steady for ever.
    """

    steady: tuple[float, float] = (0.0, 0.0)
    shear: tuple[float, float] = (0.0, 0.0)  # of the steady wind, m/s per metre above `altitude`
    altitude: float = 0.0  # m: where the wind is the steady one
    step: float = math.inf  # s: of the grid
    gusts: Array = field(default_factory=_calm)  # (steps + 1, 3), beyond the steady wind
    turbulence: Callable[[float], Array] | None = None  # how its turbulence turns over a wing of this span, m
    _way: Array = field(init=False)  # (steps + 1, 2): how far they have carried since the start, north, east

    def __post_init__(self) -> None:
        horizontal = self.gusts[:, :2]
        way = np.zeros_like(horizontal)
        np.cumsum(0.5 * self.step * (horizontal[1:] + horizontal[:-1]), axis=0, out=way[1:])
        object.__setattr__(self, "_way", way)

    def gust(self, k: int) -> Vector:
        """The velocity beyond the steady wind at the k-th step, at `altitude`."""
        if not len(self.gusts):
            return 0.0, 0.0, 0.0
        north, east, down = self.gusts[k].tolist()
        return north, east, down

    def horizontal(self, k: int) -> tuple[float, float]:
        """The whole horizontal wind at the k-th step, at `altitude`; north, east."""
        (W_x, W_y), (gust_x, gust_y, _) = self.steady, self.gust(k)
        return W_x + gust_x, W_y + gust_y

    def rotation(self, span: float) -> Array:
        """The air's rotation over a wing of this span (m), rad/s: (steps + 1, 4).

        Roll rate, pitch rate, and two parts of the yaw rate, which is east cos(yaw) - north sin(yaw): north, east.
        """
        return self.turbulence(span) if self.turbulence else np.zeros((len(self.gusts), 4))

    def drift(self, begin: int, end: int) -> tuple[float, float]:
        """How far, m, the gusts carry something that follows them at once, between two steps; north, east."""
        if not len(self.gusts):
            return 0.0, 0.0
        north, east = (self._way[end] - self._way[begin]).tolist()
        return north, east
