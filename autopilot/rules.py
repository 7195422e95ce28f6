"""Gains that follow from the circle and the aircraft by a rule, instead of a table of numbers."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from autopilot.guidance import Law

if TYPE_CHECKING:
    from autopilot.response import Response

Border = Callable[[Callable[[float], Law], float], float]


class RuleError(ValueError):
    """A rule has no answer for this flight; the message says why."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Known:
    """The flight as seen by a gain rule, besides its law. SI, rad.

    `border(law_at, guess)` is the gain q > 0, near the guess, at which the limit cycle of the law `law_at(q)` begins on
    its circle behind the identified response. Raises `RuleError` where there is none.
    """

    airspeed: float  # nominal
    period: float  # between two commands
    identified: "Response | None"  # of the heading rate to its command
    why_unknown: str  # when there is none
    border: Border

    @property
    def response(self) -> "Response":
        """The identified response. Raises `RuleError` where there is none."""
        if self.identified is None:
            raise RuleError(self.why_unknown)
        return self.identified


class Rule(NamedTuple):
    """A gain set that is calculated: from a law with the gains of `base`, and those that the user set, its gains."""

    base: str  # the set of numbers that it starts from
    about: str  # one sentence
    gains: Callable[[Any, Known], Mapping[str, float]]  # of the law; raises `RuleError`


def rounded(gain: float) -> float:
    """To three digits: another machine solves for the same gain, but not to the last bit."""
    return float(f"{gain:.3g}")
