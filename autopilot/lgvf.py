"""The Lyapunov guidance vector field of Lawrence, followed as Frew, Lawrence and Morris do for a moving target in wind.

E. W. Frew, D. A. Lawrence, S. Morris, Coordinated standoff tracking of moving targets using Lyapunov guidance vector
fields, J. Guidance, Control and Dynamics 31(2), 2008. The field is that of the relative velocity: scaled by alpha such
that |alpha f + v_t - W| = v_a, it gives the heading, whose rate is the feed-forward.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import atan2
from types import MappingProxyType
from typing import Annotated

from annotated_types import Gt

from autopilot.angles import wrap
from autopilot.circling import Circling, Steering, circling_step, course_gain, heading_of_course
from autopilot.guidance import UNKNOWN, Context, LawStep
from autopilot.quantities import About
from autopilot.rules import Known, Rule, rounded
from autopilot.standoff import StandoffLaw

GAIN_SETS = MappingProxyType(
    {"published": {"k": 1.0}}  # the papers leave it to the heading loop: the gain of mavsim's, as in `orbit_field`
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Lgvf(StandoffLaw):
    """Lyapunov guidance vector field: only the standoff distance shapes the field; k is the heading feedback."""

    gains: Annotated[str, About("the named set the gains started from")] = "custom"
    k: Annotated[float, Gt(0), About("feedback of the heading error", "1/s")]

    def start(self, context: Context = UNKNOWN) -> LawStep:
        return circling_step(self, steering(self))

    def broken_conditions(self, speed_ratio: float) -> list[str]:
        """That the scale alpha of the field exists everywhere."""
        if speed_ratio < 1.0:
            return []
        return [f"(v_t + v_w)/v_a = {speed_ratio:.3g} is not below 1: no scale of the field has the airspeed all round"]


def by_lag(g: Lgvf, known: Known) -> Mapping[str, float]:
    """The gain from heading error to command by `course_gain`: a damping ratio of 0.61 with the identified lag."""
    return {"k": rounded(course_gain(known))}


RULES = MappingProxyType(
    {"by_lag": Rule("published", "k = 1 / (1.5 tau), with the lag tau of the identified response", by_lag)}
)


def steering(g: Lgvf) -> Steering:
    """The law with these gains, unlimited."""
    R_d, k = g.standoff, g.k

    def steer(c: Circling) -> tuple[float, float, float, float]:
        L = c.L
        bar_chi_d = atan2(R_d * R_d - L * L, 2.0 * L * R_d)  # the field's course
        chi_d_dot = c.lam_dot - 2.0 * R_d / (L * L + R_d * R_d) * c.v_out  # 4 V R_d^3 / (L^2 + R_d^2)^2 on the field
        bar_psi_d, psi_d_dot = heading_of_course(c, bar_chi_d, chi_d_dot)
        error = wrap(c.bar_psi_a - bar_psi_d)
        return error, error, psi_d_dot, -k * error

    return steer
