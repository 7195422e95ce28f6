"""The air: where it moves to."""

from dataclasses import dataclass
from typing import Annotated, Literal

from autopilot.quantities import About, MetresPerSecond


@dataclass(frozen=True, slots=True, kw_only=True)
class Wind:
    """The wind of a flight. A velocity is that of the air: towards."""

    steady: Annotated[
        tuple[MetresPerSecond, MetresPerSecond], About("steady wind: the air moves towards north, east")
    ] = (0.0, 0.0)
    turbulence: Annotated[Literal["none"], About("severity of the turbulence")] = "none"
