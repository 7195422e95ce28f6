"""The paper's closed forms, corrected as `docs/reference/errata.md` says: what its theory promises, as numbers."""

import math

from autopilot.nftsm import Nftsm


def tsm_time(x0: float, alpha1: float, beta1: float) -> float:
    """Remark 3: when x' = -alpha1 sig^beta1(x) reaches 0 from x0, s; 0 < beta1 < 1."""
    return math.pow(abs(x0), 1.0 - beta1) / (alpha1 * (1.0 - beta1))


def ftsm_time(x0: float, alpha2: float, beta2: float, alpha3: float, beta3: float) -> float:
    """Remark 4, corrected: when x' = -alpha2 sig^beta2(x) - alpha3 sig^beta3(x) reaches 0 from x0, s.

    The printed form is the antiderivative without its limit at 0; this one is the integral from 0 to |x0|. Needs
    beta3 < 1 and beta3 < beta2.
    """
    from scipy.special import hyp2f1

    q = (1.0 - beta3) / (beta2 - beta3)
    ratio = alpha2 / alpha3 * abs(x0) ** (beta2 - beta3)
    return float(abs(x0) ** (1.0 - beta3) / (alpha3 * (1.0 - beta3)) * hyp2f1(1.0, q, 1.0 + q, -ratio))


def printed_ftsm_time(x0: float, alpha2: float, beta2: float, alpha3: float, beta3: float) -> float:
    """Remark 4 as printed, its stray k read as 1. Negative for beta2 > 1: it lacks its limit at 0."""
    from scipy.special import hyp2f1

    q = (beta2 - 1.0) / (beta2 - beta3)
    z = -alpha3 / alpha2 * abs(x0) ** (beta3 - beta2)
    front = abs(x0) ** (1.0 - beta2) / (1.0 - beta2) * alpha2 ** ((1.0 - beta2) / beta2)
    return float(front * hyp2f1(1.0, q, 1.0 + q, z))


def reaching_time(g: Nftsm, s0: float) -> float:
    """Eq. (25): when the reaching law brings s from s0 to 0, s, without a limit. The bound is the time itself."""
    V1 = 0.5 * s0 * s0
    power = math.sqrt(2.0) ** (g.gamma1 + 1.0)
    inside = (2.0 * g.k2 * V1 ** (0.5 * (1.0 - g.gamma1)) + g.k3 * power) / (g.k3 * power)
    return math.log(inside) / (g.k2 * (1.0 - g.gamma1))


def manifold_reach(g: Nftsm) -> float:
    """The largest heading error on the manifold, alpha2 (pi/2)^beta2 + alpha3 (pi/2)^beta3, rad: Eq. (28)."""
    return float(g.alpha2 * (math.pi / 2) ** g.beta2 + g.alpha3 * (math.pi / 2) ** g.beta3)


def boundary_heading_error(g: Nftsm) -> float:
    """The right side of Eq. (32) and (33), alpha2 eta^beta2 + alpha3 eta^beta3, rad."""
    return float(g.alpha2 * g.eta**g.beta2 + g.alpha3 * g.eta**g.beta3)


def longest_stable_period(g: Nftsm, s: float) -> float:
    """The longest guidance period at which a held command still shrinks |s|, s: 2 over the reaching law's slope at s.

    With the command held for T the reaching law becomes s -> s - T (k2 s + k3 sig^gamma1(s)); it shrinks |s| while
    T (k2 + k3 |s|^(gamma1 - 1)) < 2. As s goes to 0 no period is short enough: below some |s| a held command chatters.
    """
    return 2.0 / (g.k2 + g.k3 * math.pow(abs(s), g.gamma1 - 1.0))
