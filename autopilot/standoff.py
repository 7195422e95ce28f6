"""Standoff geometry of the paper: relative motion, desired heading, course rate, and the mirrored direction.

Symbols are the paper's: L distance, R_d standoff distance, r range error, theta azimuth of the aircraft seen from the
target, lam = theta - pi/2; a bar is an angle minus lam. Pure functions of floats, finite for finite arguments.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import asin, atan2, copysign, cos, hypot, pi, radians, sin, sqrt
from types import MappingProxyType
from typing import Annotated, Any, Literal

from annotated_types import Ge, Gt

from autopilot.angles import wrap
from autopilot.guidance import Guidance, LawStep, Memory, Observation, Remembering, Telling, telling
from autopilot.quantities import About, DegreesPerSecond, Metres, Unlimited

PAPER_STANDOFF, PAPER_AIRSPEED = 200.0, 13.0  # m, m/s: of the circle and the aircraft of Table 1
_CLOSEST = 1e-6  # m: at a smaller distance the azimuth has no meaning; it also bounds the rate of the azimuth
STANDING = 1e-9  # m/s: a slower target has no direction along which it could accelerate


Motion = tuple[
    float, float, float, float, float
]  # r, its rate, rate of lam, heading error, rate of the desired bar psi_a


def relative_motion(o: Observation, R_d: float, v_a: float, psi_a: float) -> Motion:
    """Eq. (5), (7), (20), as corrected in `docs/reference/errata.md`, for airspeed `v_a` and heading `psi_a`. SI, rad.

    With lam = theta - pi/2, v sin(psi - lam) is a velocity away from the target, v cos(psi - lam) the one along lam.
    """
    x, y, _, _, _, _, _, _, _, _, W_x, W_y, x_t, y_t, v_t_x, v_t_y, a_t, omega_t, _ = o
    x_r, y_r = x - x_t, y - y_t
    L = sqrt(x_r * x_r + y_r * y_r)
    lam = atan2(y_r, x_r) - 0.5 * pi
    cos_lam, sin_lam = (y_r / L, -x_r / L) if L > _CLOSEST else (cos(lam), sin(lam))
    v_t_sin, v_t_cos = v_t_y * cos_lam - v_t_x * sin_lam, v_t_x * cos_lam + v_t_y * sin_lam  # v_t sin, cos(bar psi_t)
    v_w_sin, v_w_cos = W_y * cos_lam - W_x * sin_lam, W_x * cos_lam + W_y * sin_lam
    bar_psi_a = psi_a - lam

    r_dot = v_a * sin(bar_psi_a) - v_t_sin + v_w_sin  # Eq. (5)
    lam_dot = (-v_a * cos(bar_psi_a) + v_t_cos - v_w_cos) / (L if L > _CLOSEST else _CLOSEST)  # Eq. (5), second line
    across = v_t_sin - v_w_sin
    if -v_a < across < v_a:
        bar_psi_a_d = asin(across / v_a)  # Eq. (7)
        across_dot = v_t_cos * (omega_t - lam_dot) + v_w_cos * lam_dot
        if a_t:
            across_dot += a_t * v_t_sin / (hypot(v_t_x, v_t_y) or 1.0)
        psi_a_d_dot = across_dot / sqrt(v_a * v_a - across * across)  # Eq. (20)
    else:  # Remark 1 is violated: no heading keeps the distance; the nearest one is desired
        bar_psi_a_d = copysign(0.5 * pi, across)
        psi_a_d_dot = 0.0
    psi_a_err = bar_psi_a - bar_psi_a_d
    return L - R_d, r_dot, lam_dot, psi_a_err if -pi <= psi_a_err < pi else wrap(psi_a_err), psi_a_d_dot


def feed_forward_ahead(o: Observation, motion: Motion, R_d: float, v_a: float, psi_a: float, time: float) -> float:
    """The rate of the desired heading in `time` seconds, rad/s, if the aircraft goes on around the target as now."""
    _, _, lam_dot, _, psi_a_d_dot = motion
    x, y, v_x, v_y, speed, psi, psi_dot, bank, p, v_n, W_x, W_y, x_t, y_t, v_t_x, v_t_y, a_t, omega_t, now = o
    x_r, y_r, turned = x - x_t, y - y_t, lam_dot * time
    cos_turned, sin_turned = cos(turned), sin(turned)
    if a_t or omega_t:
        v_t = hypot(v_t_x, v_t_y)
        faster = max(0.0, 1.0 + a_t * time / v_t) if v_t > STANDING else 1.0
        cos_t, sin_t = faster * cos(omega_t * time), faster * sin(omega_t * time)
        v_t_x, v_t_y = v_t_x * cos_t - v_t_y * sin_t, v_t_x * sin_t + v_t_y * cos_t
    x, y = x_t + x_r * cos_turned - y_r * sin_turned, y_t + x_r * sin_turned + y_r * cos_turned
    later = _observation(
        (x, y, v_x, v_y, speed, psi, psi_dot, bank, p, v_n, W_x, W_y, x_t, y_t, v_t_x, v_t_y, a_t, omega_t, now)
    )
    _, _, lam_dot, _, psi_a_d_dot = relative_motion(later, R_d, v_a, psi_a + (lam_dot + psi_a_d_dot) * time)
    return lam_dot + psi_a_d_dot


def course_rate_ratio(v_a: float, psi_a: float, W_x: float, W_y: float) -> float:
    """L(psi_a) of Eq. (3): the course rate over heading rate, for |wind| < v_a. Above 1/2; above 1 in a headwind."""
    along = v_a * (W_x * cos(psi_a) + W_y * sin(psi_a))
    return (v_a * v_a + along) / (v_a * v_a + W_x * W_x + W_y * W_y + 2.0 * along)


def ground_speed(v_a: float, chi_a: float, W_x: float, W_y: float) -> float:
    """v_g from the airspeed and the course chi_a (the relation above Eq. 3). Needs |wind| < v_a."""
    across = W_x * sin(chi_a) - W_y * cos(chi_a)
    return W_x * cos(chi_a) + W_y * sin(chi_a) + sqrt(v_a * v_a - across * across)


def heading_from_course(v_a: float, chi_a: float, W_x: float, W_y: float) -> float:
    """psi_a, rad, from the course, for a UAV without air data. A crosswind above v_a counts as v_a."""
    across = (W_x * sin(chi_a) - W_y * cos(chi_a)) / v_a
    return wrap(chi_a + asin(max(-1.0, min(1.0, across))))


_SLOWEST = 1e-3  # m/s: no airspeed that a law computes with is smaller
_STANDS_STILL = 1.0 - 1e-6  # wind over airspeed: from here on the aircraft may stand still, where Eq. (3) has no value
AIRSPEEDS: Mapping[str, Callable[[Observation], float]] = MappingProxyType(  # the v_a of a law, by its setting
    {
        "nominal": lambda o: o.nominal_airspeed,
        "measured": lambda o: max(o.airspeed, _SLOWEST),
        "ground": lambda o: max(hypot(o.velocity_north - o.wind_north, o.velocity_east - o.wind_east), _SLOWEST),
    }
)
_guidance, _observation = Guidance._make, Observation._make  # from a tuple, in half the time of the constructor
Reaching = Callable[[Motion], tuple[float, float, float]]  # feed-forward, rest of the command, s
Answer = tuple[float, float, float, float, float]  # r, s, heading error, feed-forward, rest of the command


@dataclass(frozen=True, slots=True, kw_only=True)
class StandoffLaw:
    """The parameters that all standoff laws share: circle, limit, direction, and the quantities they compute with."""

    standoff: Annotated[Metres, Ge(0.1), About("desired distance to the target, R_d")] = PAPER_STANDOFF
    max_heading_rate: Annotated[DegreesPerSecond, Gt(0), Unlimited(), About("limit of the command, Eq. (2)")] = radians(
        5.0
    )
    direction: Annotated[
        Literal["paper", "mirrored"], About("sense of circling: paper is anticlockwise on a map, mirrored is clockwise")
    ] = "paper"
    airspeed: Annotated[
        Literal["nominal", "measured", "ground"],
        About("the v_a that the law computes with; ground is |ground velocity - estimated wind|"),
    ] = "ground"
    command: Annotated[
        Literal["heading_rate", "course_rate"],
        About("the quantity that is limited: heading rate, or course rate by Eq. (3), which needs no air data"),
    ] = "heading_rate"


def standoff_step(law: StandoffLaw, reach: Reaching) -> LawStep:
    """The law in flight. `reach` computes (feed-forward, rest of the command, s) for the paper's sense of circling."""
    R_d, known = law.standoff, measured(law)

    def step(o: Observation) -> Guidance:
        v_a, psi_a, limit = known(o)
        motion = relative_motion(o, R_d, v_a, psi_a)
        feed_forward, rest, s = reach(motion)
        return limited(motion[0], s, motion[3], feed_forward, rest, limit)

    return directed(law, step)


def remembering_step(
    law: StandoffLaw,
    answer: Callable[[Observation, float, float, Memory], tuple[Answer, Memory]],
    applied: Callable[[Memory, float], Memory],
    memory: Memory,
) -> LawStep:
    """A law with memory in flight; `memory` is that at the start.

    `answer` gets the observation, v_a, psi_a and the memory, and answers for the paper's sense of circling. `applied`
    adds to the memory what became of it: the limited command beyond the equally limited feed-forward, rad/s.
    """
    known = measured(law)

    def step(o: Observation, memory: Memory) -> tuple[Guidance, Memory]:
        v_a, psi_a, limit = known(o)
        answered, memory = answer(o, v_a, psi_a, memory)
        r, s, heading_error, feed_forward, rest = answered
        guidance = limited(r, s, heading_error, feed_forward, rest, limit)
        return guidance, applied(memory, guidance[0] - max(-limit, min(limit, feed_forward)))

    return directed(law, Remembering(step, memory))


def measured(law: StandoffLaw) -> Callable[[Observation], tuple[float, float, float]]:
    """From an observation to v_a and psi_a as the law is set to know them, and to the limit of its command, rad/s."""
    max_rate = law.max_heading_rate
    airspeed, by_course = AIRSPEEDS[law.airspeed], law.command == "course_rate"

    def known(o: Observation) -> tuple[float, float, float]:
        v_a = airspeed(o)
        if not by_course:
            return v_a, o.heading, max_rate
        W_x, W_y = o.wind_north, o.wind_east
        psi_a = heading_from_course(v_a, atan2(o.velocity_east, o.velocity_north), W_x, W_y)
        if hypot(W_x, W_y) < _STANDS_STILL * v_a:
            return v_a, psi_a, max_rate / course_rate_ratio(v_a, psi_a, W_x, W_y)  # |u_chi| <= max_rate, Eq. (3)
        return v_a, psi_a, max_rate

    return known


def limited(r: float, s: float, heading_error: float, feed_forward: float, rest: float, limit: float) -> Guidance:
    """The answer with its command within +-`limit`, rad/s."""
    unlimited = feed_forward + rest
    command = unlimited if -limit < unlimited < limit else copysign(limit, unlimited)
    return _guidance((command, r, s, heading_error, feed_forward, unlimited))


def directed(law: StandoffLaw, step: LawStep) -> LawStep:
    """A law that answers for the paper's sense of circling, in the direction that it is set to."""
    return step if law.direction == "paper" else mirrored(step)


def mirrored(step: LawStep) -> LawStep:
    """The same law the other way round: it circles clockwise on a map where the other circles anticlockwise."""
    if not isinstance(step, Remembering):
        return lambda o: _mirror_guidance(step(_mirror_observation(o)))
    recalling = step.step

    def turned(o: Observation, memory: Any) -> tuple[Guidance, Any]:
        guidance, memory = recalling(_mirror_observation(o), memory)
        return _mirror_guidance(guidance), memory

    return Remembering(turned, step.memory)


def _mirror_observation(o: Observation) -> Observation:
    x, y, v_x, v_y, v_a, psi, psi_dot, bank, p, v_n, W_x, W_y, x_t, y_t, v_t_x, v_t_y, a_t, omega_t, now = o
    return _observation(
        (x, -y, v_x, -v_y, v_a, -psi, -psi_dot, -bank, -p, v_n, W_x, -W_y, x_t, -y_t, v_t_x, -v_t_y, a_t, -omega_t, now)
    )


def _mirror_guidance(g: Guidance) -> Guidance:
    turned = Guidance(
        -g.heading_rate, g.range_error, -g.sliding_variable, -g.heading_error, -g.feed_forward, -g.unlimited_command
    )
    return telling(turned, **g.channels) if isinstance(g, Telling) else turned
