"""Gains by rule: what the rule of a law makes of a flight."""

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from autopilot.guidance import Law
from autopilot.rules import Known, Rule, RuleError
from harness.flight import Flight, told_response
from harness.plants.plant import PlantError
from harness.settings.laws import kind_of_class

if TYPE_CHECKING:
    from autopilot.response import Response


def by_rule(flight: Flight, given: Collection[str]) -> Flight:
    """The flight with the gains that the rule of its law gives, but for those `given` by name; others as they are.

    Raises `RuleError`, with the reason, where the rule has no answer.
    """
    law: Any = flight.law
    kind = known[1] if (known := kind_of_class(type(law))) else None
    if kind is None or not kind.rules or law.gains not in kind.rules or set(kind.numbers(law.gains)) <= set(given):
        return flight
    try:
        response, why_unknown = told_response(flight), ""
    except (PlantError, FileNotFoundError) as error:
        response, why_unknown = None, str(error)
    gains = _gains(kind.rules[law.gains], law, flight.start.airspeed, flight.guidance_period, response, why_unknown)
    return replace(flight, law=replace(law, **{name: value for name, value in gains.items() if name not in given}))


@lru_cache(maxsize=1024)
def _gains(
    rule: Rule, law: Law, airspeed: float, period: float, response: "Response | None", why_unknown: str
) -> Mapping[str, float]:
    from harness.limit_cycle.prediction import CANNOT_HOLD, Loop, boundary

    def border(law_at: Callable[[float], Law], guess: float) -> float:
        if response is None:
            raise RuleError(why_unknown)
        if law.max_heading_rate * law.standoff <= airspeed:
            raise RuleError(CANNOT_HOLD)
        found = boundary(lambda gain: Loop(law_at(gain), response, airspeed, period), guess)
        if math.isnan(found):
            raise RuleError("no gain was found at which a limit cycle begins")
        return found

    known = Known(airspeed=airspeed, period=period, identified=response, why_unknown=why_unknown, border=border)
    return rule.gains(law, known)
