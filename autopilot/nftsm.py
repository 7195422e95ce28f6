"""The paper's law: nonsingular fast terminal sliding mode guidance, Eq. (15)-(20)."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import asin, atan, copysign, pi
from types import MappingProxyType
from typing import Annotated

from annotated_types import Ge, Gt, Le, Lt

from autopilot.guidance import UNKNOWN, Context, LawStep
from autopilot.quantities import About
from autopilot.rules import Known, Rule, rounded
from autopilot.standoff import PAPER_AIRSPEED, PAPER_STANDOFF, Motion, Reaching, StandoffLaw, standoff_step

_TABLE_2 = {"alpha3": 0.2, "eta": 0.001, "beta3": 2.0 / 3.0, "k1": 0.05, "k2": 12.0, "k3": 6.0, "gamma1": 0.9}
GAIN_SETS = MappingProxyType(
    {
        "paper": {"alpha2": 0.5, "beta2": 0.2, **_TABLE_2},  # Table 2, row NFTSM
        "paper_1": {"alpha2": 2.0, "beta2": 3.0, **_TABLE_2},  # Table 2, row NFTSM_1
        "fitted": {"alpha2": 0.4, "beta2": 2.4, **_TABLE_2},  # gives Table 3's NFTSM rows
    }
)

_SMALLEST = 1e-12  # stands for |ell| = 0, where |ell|^(beta2-1) is singular for beta2 < 1, as in the paper's own set


@dataclass(frozen=True, slots=True, kw_only=True)
class Nftsm(StandoffLaw):
    """NFTSM guidance. Gains as in the paper; angles in rad, k1 in 1/m, k2 and k3 in 1/s."""

    gains: Annotated[str, About("the named set the gains started from")] = "custom"
    alpha2: Annotated[float, Ge(0), About("weight of the fast term of the manifold, Eq. (17)")]
    alpha3: Annotated[float, Ge(0), About("weight of the terminal term, Eq. (17)")]
    beta2: Annotated[float, Gt(0), Le(100), About("power of the fast term; Definition 5 requires at least 1")]
    beta3: Annotated[float, Gt(0), Lt(1), About("power of the terminal term")]
    eta: Annotated[float, Ge(1e-9), Le(1), About("|ell| below which the terminal term is smoothed")]
    k1: Annotated[float, Gt(0), About("ell = arctan(k1 r)", "1/m")]
    k2: Annotated[float, Gt(0), About("linear reaching gain, Eq. (18)", "1/s")]
    k3: Annotated[float, Ge(0), About("power reaching gain, Eq. (18)", "1/s")]
    gamma1: Annotated[float, Gt(0), Lt(1), About("power of the reaching law, Eq. (18)")]

    def start(self, context: Context = UNKNOWN) -> LawStep:
        return standoff_step(self, reaching(self))

    def broken_conditions(self, speed_ratio: float) -> list[str]:
        """The conditions of Definition 5, Eq. (28) and Eq. (30) that these gains violate, one sentence each."""
        broken = []
        if self.beta2 < 1.0:
            broken.append(
                f"beta2 = {self.beta2:g} is below 1 (Definition 5): the law is singular on the circle, at ell = 0"
            )
        reach = self.alpha2 * (pi / 2) ** self.beta2 + self.alpha3 * (pi / 2) ** self.beta3
        if reach > pi:
            broken.append(f"Eq. (28): alpha2 (pi/2)^beta2 + alpha3 (pi/2)^beta3 = {reach:.3g} exceeds pi")
        xi = asin(min(1.0, speed_ratio))
        if xi + reach >= pi / 2:
            broken.append(
                f"Eq. (30): arcsin((v_t + v_w)/v_a) + {reach:.3g} = {xi + reach:.3g} is not below pi/2: "
                "on the manifold the aircraft may fly away from the circle"
            )
        return broken


def behind_inner_loop(g: Nftsm, known: Known) -> Mapping[str, float]:
    """k2 is half of the highest without a limit cycle, and k3 = k2 / 2 as in Table 2."""

    def with_k2(k2: float) -> Nftsm:
        return replace(g, k2=k2, k3=0.5 * k2)

    k2 = rounded(0.5 * known.border(with_k2, 2.0))
    return {"k2": k2, "k3": 0.5 * k2}


def scaled(g: Nftsm, known: Known) -> Mapping[str, float]:
    """Table 2 in the circle's own units: k1 R_d, k2 R_d / v_a and k3 R_d / v_a as with 200 m and 13 m/s."""
    shorter, quicker = PAPER_STANDOFF / g.standoff, known.airspeed / g.standoff * PAPER_STANDOFF / PAPER_AIRSPEED
    return {"k1": _TABLE_2["k1"] * shorter, "k2": _TABLE_2["k2"] * quicker, "k3": _TABLE_2["k3"] * quicker}


RULES = MappingProxyType(
    {
        "behind_inner_loop": Rule(
            "fitted",
            "k2 is half of the highest without a limit cycle behind the airframe's inner loop, k3 = k2 / 2",
            behind_inner_loop,
        ),
        "scaled": Rule(
            "fitted",
            "k1 R_d, k2 R_d / v_a and k3 R_d / v_a are the paper's: another circle or airspeed is the same flight",
            scaled,
        ),
    }
)


def reaching(g: Nftsm) -> Reaching:
    """Eq. (15)-(19) with these gains, unlimited: (feed-forward, rest of the command, s) in rad/s, rad/s, rad."""
    alpha2, alpha3, beta2, beta3, eta = g.alpha2, g.alpha3, g.beta2, g.beta3, g.eta
    k1, k2, k3, gamma1 = g.k1, g.k2, g.k3, g.gamma1
    r1 = (2.0 - beta3) * eta ** (beta3 - 1.0)
    r2 = (beta3 - 1.0) * eta ** (beta3 - 2.0)

    def reach(motion: Motion) -> tuple[float, float, float]:
        r, r_dot, lam_dot, psi_a_err, psi_a_d_dot = motion
        k1_r = k1 * r
        ell = atan(k1_r)
        size = abs(ell) or _SMALLEST
        fast = alpha2 * size ** (beta2 - 1.0)  # alpha2 sig^beta2(ell) = fast ell
        if size > eta:
            power = alpha3 * size ** (beta3 - 1.0)
            f, slope = (fast + power) * ell, beta2 * fast + beta3 * power
        else:  # Definition 5; its slope has r1 + 2 r2 |ell| where Eq. (16) prints ell
            f = (fast + alpha3 * (r1 + r2 * size)) * ell
            slope = beta2 * fast + alpha3 * (r1 + 2.0 * r2 * size)
        s = psi_a_err + f  # Eq. (17)
        reached = k2 * s + k3 * copysign(abs(s) ** gamma1, s)  # Eq. (18)
        return lam_dot + psi_a_d_dot, -slope * k1 * r_dot / (1.0 + k1_r * k1_r) - reached, s  # Eq. (19)

    return reach
