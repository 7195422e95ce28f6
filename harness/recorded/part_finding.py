"""The verdict of a log on one part of the assumption."""

import math
from dataclasses import dataclass

from harness.verdict.parts import Bounds, Part

CANNOT = "cannot be judged from this log"


@dataclass(frozen=True, slots=True)
class PartFinding:
    """The verdict on one part."""

    part: Part
    word: str  # of `Verdict`, or `CANNOT`
    reason: str  # why it cannot be judged, or is undecided; else what goes with the number
    value: float = math.nan  # in the part's unit, with its 95 % interval
    low: float = math.nan
    high: float = math.nan
    windows: int = 0  # independent ones
    needed: int | None = None  # windows that would decide, were they like these
    bounds: Bounds = (None, None)  # of the value
