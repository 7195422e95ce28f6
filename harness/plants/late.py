"""A plant with a transport delay of its command."""

from collections import deque

from harness.plants.plant import Flying
from harness.plants.state import State


class Late:
    """A plant in flight with a transport delay of `whole` guidance periods and `part` seconds, less than a period.

    Until the first command arrives the effective command is zero: straight flight.
    """

    def __init__(self, flying: Flying, whole: int, part: float) -> None:
        self._flying, self._part = flying, part
        self._on_the_way = deque([0.0] * (whole + 1))  # the oldest is the effective command

    @property
    def state(self) -> State:
        return self._flying.state

    def advance(self, heading_rate: float, period: float) -> None:
        for acts, length in self.parts(heading_rate, period):
            self._flying.advance(acts, length)

    def parts(self, heading_rate: float, period: float) -> list[tuple[float, float]]:
        """What acts in the period in which this command is given, and for how long, s."""
        self._on_the_way.append(heading_rate)
        earlier, later = self._on_the_way.popleft(), (self._on_the_way[0], period - self._part)
        return [(earlier, self._part), later] if self._part else [later]
