"""PX4's nonlinear path following guidance (NPFG) of Stastny and Siegwart, on the circle.

Formulas as in PX4's `DirectionalGuidance` and the papers arXiv:1609.07577 and arXiv:1908.01381, with their feasibility
of a bearing and their bounds of the period. The wind is treated as there; moving targets are not, and are followed in
the target's frame, with the wind relative to the target and the target's acceleration in the feed-forward.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import atan2, copysign, cos, hypot, pi, sin, sqrt
from types import MappingProxyType
from typing import Annotated

from annotated_types import Ge, Le

from autopilot.angles import wrap
from autopilot.circling import MARGIN, Circling, Steering, circling_step, period_by_lag
from autopilot.guidance import UNKNOWN, Context, LawStep
from autopilot.quantities import About
from autopilot.rules import Known, Rule, rounded
from autopilot.standoff import StandoffLaw

GAIN_SETS = MappingProxyType(
    # PX4's NPFG_PERIOD, NPFG_DAMPING and NPFG_ROLL_TC
    {"published": {"period": 10.0, "damping": 0.7, "roll_time": 0.5}}
)

_BUFFER = 1.5  # m/s: range of airspeed over which a bearing becomes infeasible
_SLOWEST = 1.0  # m/s: the speed below which the track error bound no longer shrinks in proportion
_SMALLEST_RADIUS = 0.5  # m: least distance to the centre in the feed-forward
_NO_AIR = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class Npfg(StandoffLaw):
    """PX4's NPFG: the look-ahead angle depends on the track error; the period is bounded by the roll time constant."""

    gains: Annotated[str, About("the named set the gains started from")] = "custom"
    period: Annotated[float, Ge(0.01), About("period of the path-following dynamics", "s")]
    damping: Annotated[float, Ge(0.01), Le(100), About("damping ratio of the path-following dynamics")]
    roll_time: Annotated[float, Ge(0), About("roll time constant, which bounds the period; 0: no bounds", "s")]

    def start(self, context: Context = UNKNOWN) -> LawStep:
        return circling_step(self, steering(self))

    def broken_conditions(self, speed_ratio: float) -> list[str]:
        """The stable period of a curved path in wind, and that the wind leaves the circle feasible."""
        broken = []
        least = 4.0 * pi * self.roll_time * self.damping
        if self.period < least:
            broken.append(f"period = {self.period:g} s is below 4 pi roll_time damping = {least:.3g} s: wind raises it")
        if self.damping < 0.5:
            broken.append(f"damping = {self.damping:g} is below 0.5, where the period's bounds end")
        if speed_ratio >= 1.0:
            broken.append(f"(v_t + v_w)/v_a = {speed_ratio:.3g} is not below 1: some bearings are infeasible")
        return broken


def by_lag(g: Npfg, known: Known) -> Mapping[str, float]:
    """The shortest period that PX4's bound, with its margin, leaves on a circle in wind."""
    return {"period": period_by_lag(g.damping, known), "roll_time": rounded(max(known.response.lag, known.period))}


RULES = MappingProxyType(
    {
        "by_lag": Rule(
            "published", "period = 1.5 4 pi tau damping, roll_time = tau: the identified response's lag", by_lag
        )
    }
)


def feasibility(v_a: float, cross: float, along: float, w: float) -> float:
    """Feasibility of a bearing, from 0 to 1: `cross` and `along` are the wind components, `w` is the wind speed."""
    cross = w if along < 0.0 else abs(cross)
    share = (v_a - cross) / _BUFFER
    if share >= 1.0:
        return 1.0
    if share <= 0.0:
        return 0.0
    return sin(0.5 * pi * share) ** 2


def look_ahead(e: float, V: float, time_constant: float) -> float:
    """The look-ahead angle of an absolute track error: pi/2 on the track, 0 from the track error bound outwards."""
    bound = V * time_constant if V > _SLOWEST else 0.5 * time_constant * (V * V + 1.0)
    near = 1.0 - e / bound if e < bound else 0.0
    return 0.5 * pi * near * near


def bounded_period(g: Npfg, e: float, V: float, v_a: float, w: float, feasible: float) -> float:
    """The period, s, at an absolute track error, bounded below by the roll time constant and above by the turn."""
    period, zeta, tau = g.period, g.damping, g.roll_time
    if tau == 0.0:
        return period
    factor = 2.0 if w > v_a else 2.0 * (1.0 - sqrt(1.0 - w / v_a))
    turning = v_a / g.standoff * factor
    straight = MARGIN * pi * tau / zeta
    lower = straight
    if turning > _NO_AIR and zeta >= 0.5:
        lower += (MARGIN * 4.0 * pi * tau * zeta - straight) * feasible
    proximity = sin(look_ahead(e, V, straight * zeta)) ** 2
    lower = straight + (lower - straight) * proximity
    period = max(lower, period)
    if turning * feasible > _NO_AIR and zeta >= 0.5:
        upper = 4.0 * pi * zeta / (turning * feasible)
        if period > upper:
            period += (max(lower, upper) - period) * proximity
    return period


def steering(g: Npfg) -> Steering:
    """The law with these parameters, unlimited."""

    def steer(c: Circling) -> tuple[float, float, float, float]:
        v_a, w_along, w_out = c.v_a, c.w_along, c.w_out
        e, V, w = abs(c.r), hypot(c.v_along, c.v_out), hypot(w_along, w_out)
        on_track = feasibility(v_a, w_out, w_along, w)
        T = bounded_period(g, e, V, v_a, w, on_track)
        angle = look_ahead(e, V, T * g.damping)
        b_along, b_out = sin(angle), -copysign(cos(angle), c.r)  # the bearing
        cross, along = w_along * b_out - w_out * b_along, w_along * b_along + w_out * b_out
        if abs(cross) < v_a and (along > 0.0 or w < v_a):
            air = sqrt(v_a * v_a - cross * cross)
            u_along, u_out = air * b_along - cross * b_out, air * b_out + cross * b_along
        else:  # no heading gives the bearing: the ground velocity is at least along it as much as may be
            slow = sqrt(max(w * w - v_a * v_a, 0.0))
            u_along, u_out = slow * b_along - w_along, slow * b_out - w_out
        error = wrap(c.bar_psi_a - atan2(u_out, u_along))
        towards = -sin(error) if -0.5 * pi <= error <= 0.5 * pi else -copysign(1.0, error)
        rest = 4.0 * pi * g.damping / T * towards

        air = sqrt(max(v_a * v_a - w_out * w_out, _NO_AIR))  # the airspeed's part along the track
        turn = -(1.0 + w_along / air) * max(c.v_along, 0.0) / max(c.L, _SMALLEST_RADIUS) - c.a_out / air
        bearing = feasibility(v_a, cross, along, w)
        feed_forward = bearing * on_track * sin(angle) ** 2 * turn
        return error, error, feed_forward, rest

    return steer
