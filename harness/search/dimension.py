"""A dimension of a search: a numeric setting and its range, `KEY=LO:HI`."""

import math
import re
from dataclasses import dataclass

from harness.error import HarnessError

_TEXT = re.compile(r"\s*(?P<key>[^=\s]+)\s*=\s*(?P<low>[^:=\s]+)\s*:\s*(?P<high>[^:=\s]+)\s*")
_DECADE = 10.0
_DIGITS = 4
OPTION = "--over"  # of the command line


class SearchError(HarnessError, ValueError):
    """A search cannot be made; the message says what is wrong and what is allowed."""


@dataclass(frozen=True, slots=True)
class Dimension:
    """A setting, by its key in a file, and the range that is searched, ends included, in the unit of the file."""

    key: str
    low: float
    high: float
    option: str = OPTION  # that gave it: it stands in messages

    @property
    def is_log(self) -> bool:
        """Whether it is searched by factors: a positive range of a decade or more is."""
        return self.low > 0.0 and self.high >= _DECADE * self.low

    def share(self, value: float) -> float:
        """Where a value lies in the range, as it is searched: 0 at its low end, 1 at its high end."""
        if self.is_log:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def value(self, share: float, digits: int = _DIGITS) -> float:
        """The value there, rounded: the inverse of `share`."""
        if self.is_log:
            return self.rounded(self.low * (self.high / self.low) ** share, digits)
        return self.rounded(self.low + (self.high - self.low) * share, digits)

    def rounded(self, value: float, digits: int = _DIGITS) -> float:
        """The value with so many digits, within the range: what is printed is what is flown."""
        return min(max(float(f"{value:.{digits}g}"), self.low), self.high)

    def __str__(self) -> str:
        return f"{self.key}={self.low:g}:{self.high:g}"


def dimension(text: str, option: str = OPTION) -> Dimension:
    """The dimension of a text such as `law.k2=0.5:20`. Raises `SearchError`."""
    found = _TEXT.fullmatch(text)
    if found is None:
        raise SearchError(f"{option} {text}: must be KEY=LO:HI, as in law.k2=0.5:20")
    try:
        low, high = float(found["low"]), float(found["high"])
    except ValueError:
        low = high = math.nan
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise SearchError(f"{option} {text}: LO and HI must be two numbers, the lower one first")
    return Dimension(found["key"].removeprefix("flight."), low, high, option)
