"""Units and meanings of settings, declared once with the field that they belong to.

Inside, every number is SI and radians. A field annotated `Degrees` holds radians; its key in a settings file is
the field's name with the suffix `_deg`, and the file's number is multiplied by `Unit.si` on the way in.
"""

import math
from dataclasses import dataclass
from typing import Annotated


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit at the border: `suffix` ends the key, `si` is one such unit in SI."""

    suffix: str
    si: float


@dataclass(frozen=True, slots=True)
class About:
    """The meaning of a field in one line, for `harness list` and the reference.

    `unit` is for a field without a `Unit`, whose number is the same in a file and inside.
    """

    text: str
    unit: str = ""


@dataclass(frozen=True, slots=True)
class OneOf:
    """The allowed values of a text field, where another module declares them."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Unlimited:
    """The field may be infinite: `inf` in a file."""


Seconds = Annotated[float, Unit("s", 1.0)]
Metres = Annotated[float, Unit("m", 1.0)]
MetresPerSecond = Annotated[float, Unit("mps", 1.0)]
MetresPerSecond2 = Annotated[float, Unit("mps2", 1.0)]
MetresPerSecondPerMetre = Annotated[float, Unit("mps_per_m", 1.0)]
Degrees = Annotated[float, Unit("deg", math.pi / 180.0)]
DegreesPerSecond = Annotated[float, Unit("deg_s", math.pi / 180.0)]
