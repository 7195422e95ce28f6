"""Linear-quadratic circling: the least range error for a given effort behind the identified inner loop."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from math import copysign, pi, sqrt
from types import MappingProxyType
from typing import Annotated, ClassVar

import numpy as np
from annotated_types import Ge, Gt, Le

from autopilot.guidance import UNKNOWN, Context, LawStep, Observation
from autopilot.linear import Array, Linear
from autopilot.predictor import Feedback, Predicted, faded, model, predictor, states, with_feed_forward
from autopilot.quantities import About, Degrees, Seconds
from autopilot.response import Response, dot
from autopilot.rules import Known, Rule, rounded
from autopilot.standoff import (
    PAPER_AIRSPEED,
    Answer,
    StandoffLaw,
    feed_forward_ahead,
    relative_motion,
    remembering_step,
)

_RESERVED = 0.3  # of the turn rate beyond the circle's, for what the field does not know
_FASTEST = pi  # rad/s: of the field, where the command has no limit

GAIN_SETS = MappingProxyType({"slow": {"weight": 20.0}})


@dataclass(frozen=True, slots=True, kw_only=True)
class LqOrbit(StandoffLaw):
    """Linear-quadratic feedback of range error, heading error, inner loop and disturbance; far out a vector field.

    It minimises the sum of r^2 + weight u^2, with r in m and u, the command beyond the feed-forward, in rad/s.
    """

    uses_response: ClassVar[bool] = True
    gains: Annotated[str, About("the named set the gains started from")] = "custom"
    weight: Annotated[float, Ge(1e-3), Le(1e9), About("m2 s2/rad2: of the effort against the range error")]
    steepest: Annotated[Degrees, Gt(0), About("largest angle of the field against the circle's tangent")] = 1.0
    disturbance_time: Annotated[Seconds, Gt(0), Le(1e3), About("correlation time of the disturbance, AR(1)")] = 1.25
    smoothing: Annotated[Seconds, Ge(0), Le(1e3), About("lag of the observed disturbance")] = 0.35

    def start(self, context: Context = UNKNOWN) -> LawStep:
        R_d, response = self.standoff, None if context.at_once else context.response
        tau = response.lag if response else 0.0
        k = self.feedback(context)
        k_e, k_states, k_w = k.e, tuple(k.states.tolist()), k.disturbance
        field = self._field(k, context.nominal_airspeed)
        start, seen, commanded = predictor(response, context.period, self.smoothing)

        def answer(o: Observation, v_a: float, psi_a: float, now: Predicted) -> tuple[Answer, Predicted]:
            motion = relative_motion(o, R_d, v_a, psi_a)
            r, _, _, e, _ = motion
            now = seen(now, e)
            _, _, _, w, _ = now
            s = e + field(r)
            rest = -k_e * s - dot(k_states, states(now)) - k_w * w
            return (r, s, e, feed_forward_ahead(o, motion, R_d, v_a, psi_a, tau), rest), now

        return remembering_step(self, answer, commanded, start)

    def _field(self, k: Feedback, v_a: float) -> Callable[[float], float]:
        """The angle, rad, at which the circle's tangent is approached from a range error.

        Near the circle that of the gains, k.r r / k.e. Farther out sqrt(2 a |r| / v_a), along which the heading turns
        by a for small angles: what the limit leaves beyond the turn of the circle, less a reserve.
        """
        limit, steepest = min(self.max_heading_rate, _FASTEST), self.steepest
        a = (1.0 - _RESERVED) * max(limit - v_a / self.standoff, 0.1 * limit)
        near, far = k.r / k.e, 2.0 * a / v_a

        def field(r: float) -> float:
            size = abs(r)
            return copysign(min(near * size, sqrt(far * size), steepest), r)

        return field

    def broken_conditions(self, speed_ratio: float) -> list[str]:
        """The theory of linear-quadratic control asks for a positive weight only, which the field holds."""
        return []

    def feedback(self, context: Context) -> Feedback:
        """The gains, to six digits: another machine solves for the same, but not to the last bit."""
        response = None if context.at_once else context.response
        found = optimal(response, context.period, context.nominal_airspeed, self.disturbance_time, self.weight)
        k_r, k_e, *k_states, k_w = (float(f"{gain:.6g}") for gain in found)
        return Feedback(k_e, k_r, np.array(k_states), k_w)

    def linearised(self, context: Context, swing: float) -> Linear:
        """From (heading error, range error) to the command beyond the turn of the circle, in still air, near it."""
        response = None if context.at_once else context.response
        law = self.feedback(context).linear(model(response, context.period), context.period, self.smoothing)
        return with_feed_forward(law, context.nominal_airspeed, self.standoff)


def plant(response: Response | None, period: float, v_a: float, disturbance_time: float) -> tuple[Array, Array]:
    """(A, B) of the sampled motion near the circle: range error, heading error, the states of `model`, disturbance.

    r' = v_a e, and e turns by the response to the command and by the disturbance w, an AR(1).
    """
    inner = model(response, period)
    left, carried = faded(period, disturbance_time)
    m = len(inner.A)
    A, B = np.zeros((m + 3, m + 3)), np.zeros((m + 3, 1))
    A[1, 1], A[1, 2:-1], A[1, -1], B[1] = 1.0, inner.C[0], carried, inner.D[0]
    A[0] = 0.5 * period * v_a * A[1]  # the heading error of the period is the mean of both ends
    A[0, :2] += 1.0, 0.5 * period * v_a
    B[0] = 0.5 * period * v_a * B[1]
    A[2:-1, 2:-1], B[2:-1] = inner.A, inner.B
    A[-1, -1] = left
    return A, B


@lru_cache(maxsize=64)
def optimal(
    response: Response | None, period: float, v_a: float, disturbance_time: float, weight: float
) -> tuple[float, ...]:
    """K of u = -K x with the states of `plant`, which minimises the sum of r^2 + weight u^2."""
    from scipy.linalg import solve_discrete_are  # late: it takes a tenth of a second

    A, B = plant(response, period, v_a, disturbance_time)
    Q = np.zeros_like(A)
    Q[0, 0] = 1.0
    P = solve_discrete_are(A, B, Q, [[weight]])
    return tuple(float(value) for value in np.linalg.solve(weight + B.T @ P @ B, B.T @ P @ A)[0])


def by_airspeed(g: LqOrbit, known: Known) -> Mapping[str, float]:
    """Where r' = v_a e, the loop's bandwidth is the root of v_a over the root of the weight: the same at any v_a."""
    return {"weight": rounded(GAIN_SETS["slow"]["weight"] * (known.airspeed / PAPER_AIRSPEED) ** 2)}


RULES = MappingProxyType(
    {
        "by_airspeed": Rule(
            "slow", "weight grows with the square of the airspeed, so that the bandwidth is the same", by_airspeed
        )
    }
)
