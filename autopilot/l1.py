"""ArduPilot's loiter: the L1 law of Park, Deyst and How towards the centre, and a linear law on the circle.

Formulas as in ArduPilot's `AP_L1_Control`. It uses the ground velocity without wind; the wind enters in the conversion
of lateral acceleration to heading rate, which ArduPilot leaves to the bank angle. It circles points at rest: a moving
target is at rest in the target's frame. As in ArduPilot the heading replaces the course at zero ground speed. Left out
is its memory of the turn direction while it flies away from the centre.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import atan2, copysign, pi, sqrt
from types import MappingProxyType
from typing import Annotated

from annotated_types import Ge, Le

from autopilot.angles import wrap
from autopilot.circling import Circling, Steering, circling_step, heading_rate, period_by_lag, steered
from autopilot.guidance import UNKNOWN, Context, LawStep
from autopilot.quantities import About
from autopilot.rules import Known, Rule
from autopilot.standoff import StandoffLaw

GAIN_SETS = MappingProxyType(
    {"published": {"period": 17.0, "damping": 0.75}}  # ArduPilot's NAVL1_PERIOD and NAVL1_DAMPING
)


@dataclass(frozen=True, slots=True, kw_only=True)
class L1(StandoffLaw):
    """ArduPilot's L1 loiter: on the circle the range error has second-order dynamics with this period and damping."""

    gains: Annotated[str, About("the named set the gains started from")] = "custom"
    period: Annotated[float, Ge(0.01), About("period of the path-following dynamics", "s")]
    damping: Annotated[float, Ge(0.01), Le(100), About("damping ratio of the path-following dynamics")]

    def start(self, context: Context = UNKNOWN) -> LawStep:
        return circling_step(self, steering(self))

    def broken_conditions(self, speed_ratio: float) -> list[str]:
        """The recommended range of ArduPilot's parameter description."""
        if 0.6 <= self.damping <= 1.0:
            return []
        return [f"ArduPilot recommends a damping from 0.6 to 1: {self.damping:g} is outside"]


def by_lag(g: L1, known: Known) -> Mapping[str, float]:
    """The period by the rule of `npfg`: near the circle the two laws are the same.

    Far from the circle so short a period saturates the heading rate, and the aircraft overshoots.
    """
    return {"period": period_by_lag(g.damping, known)}


RULES = MappingProxyType(
    {"by_lag": Rule("published", "period = 1.5 4 pi tau damping, with the lag tau of the identified response", by_lag)}
)


def steering(g: L1) -> Steering:
    """The loiter with these parameters, unlimited."""
    R_d = g.standoff
    omega = 2.0 * pi / g.period
    K_x, K_v = omega * omega, 2.0 * g.damping * omega
    K_capture = 4.0 * pi * g.damping / g.period  # K_L1 V / L1 with K_L1 = 4 zeta^2 and L1 = zeta T V / pi

    def steer(c: Circling) -> tuple[float, float, float, float]:
        c = steered(c)
        e, v_along, v_out = c.r, c.v_along, c.v_out
        bar_chi = wrap(atan2(v_out, v_along))
        a_pd = K_x * e + K_v * v_out  # towards the centre, which is to the left
        if v_out > 0.0 > v_along and a_pd < 0.0:  # outbound and in the wrong sense
            a_pd = 0.0
        a_c = v_along * v_along / max(0.5 * R_d, c.L)
        if e > 0.0:
            V = max(sqrt(v_along * v_along + v_out * v_out), 1.0)
            sin_nu = v_along / V if v_out <= 0.0 else copysign(1.0, v_along)  # |nu| <= pi/2, from centre to course
            a_capture = K_capture * V * sin_nu
            if a_capture < a_pd + a_c:
                return bar_chi, 0.0, 0.0, heading_rate(c, -a_capture)
        feed_forward = heading_rate(c, -a_c)
        return bar_chi, 0.0, feed_forward, heading_rate(c, -a_pd - a_c) - feed_forward

    return steer
