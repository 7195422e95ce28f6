"""A finding of the doctor."""

from enum import StrEnum
from typing import NamedTuple


class Soundness(StrEnum):
    """How a thing is."""

    OK = "ok"
    MISSING = "MISSING"  # something cannot be done here, but no result is false
    BAD = "BAD"  # results are false


class Finding(NamedTuple):
    """One line of the examination."""

    name: str
    measured: str  # in words, with units
    state: Soundness
