"""The law the paper compares with: sliding mode control with a linear-arctan manifold, Eq. (34)-(35)."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import atan
from types import MappingProxyType
from typing import Annotated

from annotated_types import Gt

from autopilot.guidance import UNKNOWN, Context, LawStep
from autopilot.quantities import About
from autopilot.rules import Known, Rule
from autopilot.standoff import PAPER_AIRSPEED, PAPER_STANDOFF, Motion, Reaching, StandoffLaw, standoff_step

GAIN_SETS = MappingProxyType(
    {"paper": {"c1": 0.2, "c2": 0.05, "c3": 0.005, "epsilon": 0.2}}  # Table 2, the row labelled TSM
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Smc(StandoffLaw):
    """SMC guidance. c2 in 1/m, c3 in rad/s, the rest in rad."""

    gains: Annotated[str, About("the named set the gains started from")] = "custom"
    c1: Annotated[float, Gt(0), About("height of the manifold, Eq. (34)", "rad")]
    c2: Annotated[float, Gt(0), About("steepness of the manifold, Eq. (34)", "1/m")]
    c3: Annotated[float, Gt(0), About("reaching gain, Eq. (35)", "rad/s")]
    epsilon: Annotated[float, Gt(0), About("half width of the boundary layer, Eq. (35)", "rad")]

    def start(self, context: Context = UNKNOWN) -> LawStep:
        return standoff_step(self, reaching(self))

    def broken_conditions(self, speed_ratio: float) -> list[str]:
        """None: the paper requires positive gains only, which the fields' bounds ensure."""
        return []


def scaled(g: Smc, known: Known) -> Mapping[str, float]:
    """Table 2 in the circle's own units: c2 R_d and c3 R_d / v_a as with 200 m and 13 m/s."""
    shorter, quicker = PAPER_STANDOFF / g.standoff, known.airspeed / g.standoff * PAPER_STANDOFF / PAPER_AIRSPEED
    paper = GAIN_SETS["paper"]
    return {"c2": paper["c2"] * shorter, "c3": paper["c3"] * quicker}


RULES = MappingProxyType(
    {
        "scaled": Rule(
            "paper", "c2 R_d and c3 R_d / v_a are the paper's: another circle or airspeed is the same flight", scaled
        )
    }
)


def reaching(g: Smc) -> Reaching:
    """Eq. (34)-(35) with these gains, unlimited: (feed-forward, rest of the command, s) in rad/s, rad/s, rad."""
    c1, c2, c3, epsilon = g.c1, g.c2, g.c3, g.epsilon

    def reach(motion: Motion) -> tuple[float, float, float]:
        r, r_dot, lam_dot, psi_a_err, psi_a_d_dot = motion
        c2_r = c2 * r
        s = psi_a_err + c1 * atan(c2_r)  # Eq. (34)
        sat = max(-1.0, min(1.0, s / epsilon))
        rest = -c1 * c2 * r_dot / (1.0 + c2_r * c2_r) - c3 * sat  # Eq. (35)
        return lam_dot + psi_a_d_dot, rest, s

    return reach
