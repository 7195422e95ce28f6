"""The paper's law on a predicted heading error: what the inner loop is late by is known, so it is not waited for."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import gamma, pi, sqrt
from types import MappingProxyType
from typing import Annotated, ClassVar

from annotated_types import Ge, Gt, Le

from autopilot import nftsm
from autopilot.guidance import UNKNOWN, Context, LawStep, Observation
from autopilot.linear import Linear
from autopilot.nftsm import Nftsm, reaching
from autopilot.predictor import Feedback, Predicted, faded, model, predictor, with_feed_forward
from autopilot.quantities import About, Seconds
from autopilot.rules import Known, Rule, rounded
from autopilot.standoff import Answer, feed_forward_ahead, relative_motion, remembering_step, standoff_step

_QUICKEST = 1.4  # k2 times what a command is late by

# The manifold has less of the fast term and more of the terminal one than the fitted set: it meets Eq. (30) in wind and
# with a moving target of together 41 % of the airspeed, and the last metre takes less time. The corner of the terminal
# term is rounded over 0.2 m, not 0.02 m: on the circle its slope is 70 % of the fitted set's.
_MANIFOLD = {"alpha2": 0.25, "alpha3": 0.3, "eta": 0.01}
GAIN_SETS = MappingProxyType({"calm": {**nftsm.GAIN_SETS["fitted"], **_MANIFOLD, "k2": 3.0, "k3": 1.5}})


@dataclass(frozen=True, slots=True, kw_only=True)
class NftsmLead(Nftsm):
    """NFTSM guidance on the heading error that the commands so far lead to, with a disturbance observer.

    Gains as in the paper. Where the plant answers at once, or its response is not identified, it is NFTSM.
    """

    uses_response: ClassVar[bool] = True
    disturbance_time: Annotated[Seconds, Gt(0), Le(1e3), About("correlation time of the disturbance, AR(1)")] = 1.25
    smoothing: Annotated[Seconds, Ge(0), Le(1e3), About("lag of the observed disturbance")] = 0.5

    def start(self, context: Context = UNKNOWN) -> LawStep:
        response = context.response
        if response is None or context.at_once:
            return standoff_step(self, reaching(self))
        R_d, reach, tau = self.standoff, reaching(self), response.lag
        left, carried = faded(tau, self.disturbance_time)
        start, seen, commanded = predictor(response, context.period, self.smoothing)

        def answer(o: Observation, v_a: float, psi_a: float, now: Predicted) -> tuple[Answer, Predicted]:
            motion = relative_motion(o, R_d, v_a, psi_a)
            now = seen(now, motion[3])
            _, _, d, w, _ = now
            _, rest, s = reach(relative_motion(o, R_d, v_a, psi_a + d + carried * w))
            feed_forward = feed_forward_ahead(o, motion, R_d, v_a, psi_a, tau)
            return (motion[0], s, motion[3], feed_forward, rest - left * w), now

        return remembering_step(self, answer, commanded, start)

    def linearised(self, context: Context, swing: float) -> Linear:
        """From (heading error, range error) to the command beyond the turn of the circle, in still air.

        The reaching law has the gain of its describing function where the command swings by `swing`, rad/s peak to
        peak; the manifold has its slope on the circle, where it is steepest.
        """
        v_a, period = context.nominal_airspeed, context.period
        response = None if context.at_once else context.response
        left, carried = faded(response.lag, self.disturbance_time) if response else (0.0, 0.0)
        slope = -reaching(self)((0.0, 1.0, 0.0, 0.0, 0.0))[1]  # of s over r, 1/m
        plant = model(response, period)
        reached = self._gain(slope * v_a, swing)
        e = slope * v_a + reached
        law = Feedback(e, reached * slope, e * plant.C[1], e * carried + left).linear(plant, period, self.smoothing)
        return with_feed_forward(law, v_a, self.standoff)

    def _gain(self, damped: float, swing: float) -> float:
        """Of the reaching law, Eq. (18), for an s whose oscillation makes the command swing so; 1/s."""
        g = self.gamma1
        of_power = 2.0 / sqrt(pi) * gamma(0.5 * g + 1.0) / gamma(0.5 * g + 1.5)  # its describing function at |s| = 1
        gain = self.k2 + self.k3
        for _ in range(50):  # contracts by 1 - gamma1 each time
            gain = self.k2 + self.k3 * of_power * (0.5 * swing / (damped + gain)) ** (g - 1.0)
        return gain


def by_lag(g: NftsmLead, known: Known) -> Mapping[str, float]:
    """k2 by what a command is late by, the lag of the inner loop and a period; k3 = k2 / 2 as in Table 2."""
    k2 = rounded(_QUICKEST / (known.response.lag + known.period))
    return {"k2": k2, "k3": 0.5 * k2}


RULES = MappingProxyType(
    {
        "by_lag": Rule(
            "calm", f"k2 is {_QUICKEST:g} over the lag of the inner loop and a guidance period, k3 = k2 / 2", by_lag
        )
    }
)
