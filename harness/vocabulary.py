"""The words of a verdict, the same for the coordinated-flight assumption and for each of the paper's claims."""

from collections.abc import Mapping
from enum import StrEnum
from types import MappingProxyType


class Verdict(StrEnum):
    """The verdict on a statement."""

    HOLDS = "holds"
    HOLDS_IF = "holds if"  # the condition follows; without it the statement fails, or is undecided
    FAILS = "fails"
    UNDECIDED = "undecided"  # the evidence does not decide


SIGNS: Mapping[Verdict, str] = MappingProxyType(
    {Verdict.HOLDS: "●", Verdict.HOLDS_IF: "◐", Verdict.FAILS: "○", Verdict.UNDECIDED: "·"}
)
