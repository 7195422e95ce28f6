"""The orbit following of Beard and McLain, with the rate of its vector field as the feed-forward.

R. W. Beard, T. W. McLain, Small Unmanned Aircraft, chapter 10: the course leans towards the orbit by
arctan(k_orbit (d - rho) / rho). The book feeds the turn of the orbit forward; with the field's whole rate (Nelson,
Barber, McLain and Beard, Vector field path following, 2007) the course follows the field everywhere. Course and speed
are over the ground, and the wind enters as Eq. (3) has it; the book moves the orbit with the target, which is the
target's frame.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import atan, atan2, hypot
from types import MappingProxyType
from typing import Annotated

from annotated_types import Gt

from autopilot.angles import wrap
from autopilot.circling import Circling, Steering, circling_step, course_gain, heading_rate, steered
from autopilot.guidance import UNKNOWN, Context, LawStep
from autopilot.quantities import About
from autopilot.rules import Known, Rule, rounded
from autopilot.standoff import StandoffLaw

GAIN_SETS = MappingProxyType(
    # The authors' mavsim: its path follower's k_orbit, and 2 zeta omega_n of its course loop, zeta = 1, omega_n = 0.5/s
    {"published": {"k_orbit": 1.0, "k": 1.0}}
)


@dataclass(frozen=True, slots=True, kw_only=True)
class OrbitField(StandoffLaw):
    """Orbit following of Beard and McLain: k_orbit is the orbit gain of the course field, k the course feedback."""

    gains: Annotated[str, About("the named set the gains started from")] = "custom"
    k_orbit: Annotated[float, Gt(0), About("orbit gain: atan(k_orbit r / R_d) is the course offset towards the orbit")]
    k: Annotated[float, Gt(0), About("feedback of the course error", "1/s")]

    def start(self, context: Context = UNKNOWN) -> LawStep:
        return circling_step(self, steering(self))

    def broken_conditions(self, speed_ratio: float) -> list[str]:
        """That the course can be flown at all."""
        if speed_ratio < 1.0:
            return []
        return [f"(v_t + v_w)/v_a = {speed_ratio:.3g} is not below 1: some courses cannot be flown"]


def by_lag(g: OrbitField, known: Known) -> Mapping[str, float]:
    """The sum k + V k_orbit / R_d, which feeds the course error back on the circle, is `course_gain`.

    With equal halves range error and course error decay at the same rate.
    """
    half = 0.5 * course_gain(known)
    return {"k": rounded(half), "k_orbit": rounded(half * g.standoff / known.airspeed)}


RULES = MappingProxyType(
    {
        "by_lag": Rule(
            "published",
            "k = v_a k_orbit / R_d = 1 / (3 tau), with the lag tau of the identified response",
            by_lag,
        )
    }
)


def steering(g: OrbitField) -> Steering:
    """The law with these gains, unlimited."""
    slope, k = g.k_orbit / g.standoff, g.k

    def steer(c: Circling) -> tuple[float, float, float, float]:
        c = steered(c)
        lean = slope * c.r
        chi_d_dot = c.lam_dot - slope * c.v_out / (1.0 + lean * lean)
        error = wrap(atan2(c.v_out, c.v_along) + atan(lean))
        V = hypot(c.v_along, c.v_out)
        feed_forward = heading_rate(c, V * chi_d_dot)
        return error, error, feed_forward, heading_rate(c, V * (chi_d_dot - k * error)) - feed_forward

    return steer
