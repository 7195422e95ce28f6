"""A requirement on a flight, `NAME OP VALUE`: on its outcome, its metrics, and predictions that need no flight."""

import math
import operator
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from harness.error import HarnessError, did_you_mean
from harness.feasibility import feasibility_margin
from harness.flight import Flight
from harness.limit_cycle.predicted import PREDICTED, predicted
from harness.log.metric import METRICS, YES_OR_NO
from harness.plants.plant import Outcome

Fact = float | bool | str | None  # None: unknown, or there is no such thing
Facts = Mapping[str, Fact]  # outcome, metrics and predictions of a flight

OUTCOME = "outcome"
FEASIBILITY = "feasibility_margin_deg_s"
FORESEEN = (FEASIBILITY, *PREDICTED)  # predictions that need no flight

_EQUALITY: Mapping[str, Callable[[object, object], bool]] = MappingProxyType({"=": operator.eq, "!=": operator.ne})
_ORDER: Mapping[str, Callable[[float, float], bool]] = MappingProxyType(
    {"<=": operator.le, ">=": operator.ge, "<": operator.lt, ">": operator.gt}
)
_TEXT = re.compile(r"\s*(?P<name>\w+)\s*(?P<operator><=|>=|!=|==|=|<|>)\s*(?P<value>\S+)\s*")


class RequirementError(HarnessError, ValueError):
    """A text is no requirement; the message says what is wrong and what is allowed."""


@dataclass(frozen=True, slots=True)
class Requirement:
    """A requirement on each flight. An unknown value does not meet it, unless `where_known`."""

    name: str
    operator: str
    value: float | bool | str
    where_known: bool = False  # whether an unknown value meets it

    def __str__(self) -> str:
        value = f"{self.value:g}" if isinstance(self.value, float) else str(self.value)
        return f"{self.name} {self.operator} {value.lower()}"

    @property
    def is_foreseen(self) -> bool:
        """Whether it is decided without a flight."""
        return self.name in FORESEEN

    def is_met(self, facts: Facts) -> bool:
        """Whether the flight meets it."""
        fact = facts.get(self.name)
        if fact is None:
            return self.where_known
        if isinstance(fact, float) and isinstance(self.value, float) and self.operator in _ORDER:
            return _ORDER[self.operator](fact, self.value)
        return _EQUALITY[self.operator](fact, self.value)

    def distance(self, facts: Facts) -> float:
        """The margin to the required value, over that value: 0 or more if it is met, otherwise 0 or less.

        1 or -1 of what is not a number; -inf of what is unknown and does not meet it.
        """
        fact = facts.get(self.name)
        if isinstance(fact, float) and isinstance(self.value, float):
            room = (self.value - fact) if self.operator in ("<", "<=") else (fact - self.value)
            return room / (abs(self.value) or 1.0)
        if self.is_met(facts):
            return 1.0
        return -math.inf if fact is None else -1.0


def requirement(text: str) -> Requirement:
    """The requirement of a text such as `range_error_peak_m < 5`. Raises `RequirementError`."""
    found = _TEXT.fullmatch(text)
    if found is None:
        raise RequirementError("must be NAME OP VALUE, as in chatters = false or range_error_peak_m < 5")
    name, sign, value = found["name"], found["operator"].replace("==", "="), found["value"]
    if name == OUTCOME:
        return Requirement(name, _one_of(sign, _EQUALITY, name), _one_of(value, list(Outcome), name))
    if known_name(name) == YES_OR_NO:
        return Requirement(name, _one_of(sign, _EQUALITY, name), _one_of(value, ["true", "false"], name) == "true")
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise RequirementError(f"{value!r} must be a number")
    return Requirement(name, _one_of(sign, _ORDER, name), number)


def known_name(name: str) -> str:
    """The unit of a metric, empty of what is foreseen. Raises `RequirementError` for a name that is neither."""
    if name in METRICS:
        return METRICS[name].unit
    if name in FORESEEN:
        return ""
    known = [*METRICS, *FORESEEN, OUTCOME]
    raise RequirementError(
        f"unknown name {name!r}{did_you_mean(name, known)}; there are outcome, the metrics (`harness list metrics`), "
        f"{', '.join(FORESEEN)}"
    )


def foreseen(flight: Flight, names: Collection[str] = FORESEEN) -> dict[str, Fact]:
    """The predictions for a flight; at least those of `FORESEEN` that are named."""
    facts: dict[str, Fact] = {FEASIBILITY: math.degrees(feasibility_margin(flight))}
    if named := [name for name in PREDICTED if name in names]:
        facts.update(predicted(flight, named))
    return facts


def _one_of(word: str, allowed: Mapping[str, object] | list[str], name: str) -> str:
    if word not in allowed:
        raise RequirementError(f"{word!r} must be one of {', '.join(allowed)} for {name}")
    return str(word)
