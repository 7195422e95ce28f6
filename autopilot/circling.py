"""The circle as seen by a law that commands a course: the motion in the target's frame, and the wind triangle.

In the target's frame the target is at rest and the wind is the wind relative to the target. Vectors have
two components: along the circle, which is the direction lam = theta - pi/2, and out, away from the target. A bar marks
an angle against lam; it grows clockwise, so that a positive one leads away from the target. Pure functions of floats.
"""

from collections.abc import Callable
from math import asin, atan2, copysign, cos, hypot, pi, sin, sqrt
from typing import NamedTuple

from autopilot.guidance import Guidance, LawStep, Observation
from autopilot.rules import Known, rounded
from autopilot.standoff import STANDING, StandoffLaw, directed, limited, measured

MARGIN = 1.5  # PX4's NPFG_PERIOD_SF: factor of the period over the least stable one
_CLOSEST = 1e-6  # m: as in `standoff.relative_motion`
_LEAST_COSINE = 0.1  # least cosine of the angle between course and heading for course control


class Circling(NamedTuple):
    """The aircraft and the air in the target's frame. SI, rad."""

    L: float  # distance to the target
    r: float  # L - R_d
    lam_dot: float  # rate of lam, and so of the course that keeps the distance
    v_a: float
    bar_psi_a: float
    v_along: float  # the aircraft's velocity
    v_out: float
    w_along: float  # the air's velocity: the wind against the target
    w_out: float
    a_along: float  # the air's acceleration: the target's, turned round
    a_out: float


Steering = Callable[[Circling], tuple[float, float, float, float]]
"""A function from the motion to (course or heading error, s, feed-forward, rest of the command); rad and rad/s."""


def circling(o: Observation, R_d: float, v_a: float, psi_a: float) -> Circling:
    """The motion with airspeed `v_a` and heading `psi_a`: the ground velocity is theirs plus the wind."""
    x_r, y_r = o.north - o.target_north, o.east - o.target_east
    v_t_x, v_t_y = o.target_velocity_north, o.target_velocity_east
    a_t, omega_t = o.target_acceleration, o.target_turn_rate
    w_x, w_y = o.wind_north - v_t_x, o.wind_east - v_t_y
    L = sqrt(x_r * x_r + y_r * y_r)
    lam = atan2(y_r, x_r) - 0.5 * pi
    cos_lam, sin_lam = (y_r / L, -x_r / L) if L > _CLOSEST else (cos(lam), sin(lam))
    w_along, w_out = w_x * cos_lam + w_y * sin_lam, w_y * cos_lam - w_x * sin_lam
    bar_psi_a = psi_a - lam
    v_along, v_out = v_a * cos(bar_psi_a) + w_along, v_a * sin(bar_psi_a) + w_out
    a_along = a_out = 0.0
    if a_t or omega_t:
        v_t = hypot(v_t_x, v_t_y)
        faster = a_t / v_t if v_t > STANDING else 0.0
        a_x, a_y = omega_t * v_t_y - faster * v_t_x, -omega_t * v_t_x - faster * v_t_y
        a_along, a_out = a_x * cos_lam + a_y * sin_lam, a_y * cos_lam - a_x * sin_lam
    lam_dot = -v_along / (L if L > _CLOSEST else _CLOSEST)
    return Circling(L, L - R_d, lam_dot, v_a, bar_psi_a, v_along, v_out, w_along, w_out, a_along, a_out)


def heading_rate(c: Circling, a: float) -> float:
    """The heading rate that bends the path by `a`, m/s2, clockwise across the course: a / (v_a cos(psi_a - chi_a)).

    With a = |v| u_chi it is Eq. (3), u_chi / L(psi_a), in the target's frame. The acceleration of the air is
    subtracted. Defined for the result of `steered`.
    """
    V, cosine = _course(c)
    a_air = (c.a_out * c.v_along - c.a_along * c.v_out) / V
    return (a - a_air) / (c.v_a * cosine)


def steered(c: Circling) -> Circling:
    """The motion, with the air velocity in place of the course where wind makes course control singular.

    It is singular where cos(course - heading) <= 0.1, which requires wind above 0.995 of the airspeed.
    """
    if _course(c)[1] > _LEAST_COSINE:
        return c
    return c._replace(v_along=c.v_a * cos(c.bar_psi_a), v_out=c.v_a * sin(c.bar_psi_a))


def _course(c: Circling) -> tuple[float, float]:
    """The speed in the target's frame, and the cosine of the angle between course and heading; zero at rest."""
    V = sqrt(c.v_along * c.v_along + c.v_out * c.v_out)
    return V, (c.v_along * cos(c.bar_psi_a) + c.v_out * sin(c.bar_psi_a)) / V if V else 0.0


def heading_of_course(c: Circling, bar_chi: float, chi_dot: float) -> tuple[float, float]:
    """The heading that gives a course, against lam, and its rate when the course turns by `chi_dot`: wind triangle.

    A crosswind above the airspeed leaves no such heading; the nearest one turns against it.
    """
    cos_chi, sin_chi, v_a = cos(bar_chi), sin(bar_chi), c.v_a
    across = c.w_along * sin_chi - c.w_out * cos_chi
    if not -v_a < across < v_a:
        return bar_chi + copysign(0.5 * pi, across), chi_dot
    air = sqrt(v_a * v_a - across * across)  # the airspeed's part along the course
    ratio = 1.0 + (c.w_along * cos_chi + c.w_out * sin_chi) / air  # 1 / L(psi_a) of Eq. (3), on this course
    a_across = c.a_along * sin_chi - c.a_out * cos_chi
    return bar_chi + asin(across / v_a), chi_dot * ratio + a_across / air


def course_gain(known: Known) -> float:
    """The gain K, 1/s, from course error to heading rate for a damping ratio of 0.61 with the identified lag tau.

    With a lag the course error e has tau e'' + e' + K e = 0, whose damping ratio is 1 / (2 sqrt(K tau)). PX4 requires
    a half, K = 1 / tau, which is its bound 4 pi tau zeta of the period 4 pi zeta / K; its margin makes it 0.61.
    """
    return 1.0 / (MARGIN * max(known.response.lag, known.period))


def period_by_lag(damping: float, known: Known) -> float:
    """The period, s, of the path-following dynamics with this damping ratio and `course_gain`."""
    return rounded(4.0 * pi * damping / course_gain(known))


def circling_step(law: StandoffLaw, steer: Steering) -> LawStep:
    """The law in flight; `steer` answers for the paper's sense of circling."""
    R_d, known = law.standoff, measured(law)

    def step(o: Observation) -> Guidance:
        v_a, psi_a, limit = known(o)
        seen = circling(o, R_d, v_a, psi_a)
        error, s, feed_forward, rest = steer(seen)
        return limited(seen.r, s, error, feed_forward, rest, limit)

    return directed(law, step)
