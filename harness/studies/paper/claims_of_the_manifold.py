"""What the paper claims of sliding manifolds in formulas (3.2, 3.4), decided by closed forms, grids and quadrature."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from autopilot.nftsm import Nftsm, reaching
from harness.studies.paper.claims_of_geometry import EXACT, V_A, nftsm
from harness.studies.paper.ledger import Finding, below, holds, holds_if
from harness.studies.paper.theory import (
    boundary_heading_error,
    ftsm_time,
    manifold_reach,
    printed_ftsm_time,
    reaching_time,
    tsm_time,
)

Array = NDArray[np.float64]


# Section 3.2


def exponential_mode() -> Finding:
    """X' = -alpha x from 5: e^-1 after 1/alpha."""
    x = _mode(5.0, 1.0, 1.0, 2.0)
    off = abs(x / (5.0 * math.exp(-2.0)) - 1.0)
    return holds(off < 1e-6, f"x(2 s) = {x:.5f} from 5, {below(off)} off 5 e^-2")


def _mode(x0: float, alpha: float, beta: float, time: float) -> float:
    """X after a time of x' = -alpha sig^beta(x), integrated."""
    from scipy.integrate import solve_ivp

    def slope(_: float, x: Array) -> Array:
        return np.asarray(-alpha * np.maximum(x, 0.0) ** beta)

    return float(solve_ivp(slope, (0.0, time), [x0], rtol=1e-10, atol=1e-12).y[0, -1])


def terminal_mode() -> Finding:
    """0 < beta < 1: finite time."""
    time = tsm_time(5.0, 1.0, 0.5)
    before, after = _mode(5.0, 1.0, 0.5, 0.99 * time), _mode(5.0, 1.0, 0.5, 1.01 * time)
    return holds(before > 1e-5 > after, f"β1 = 0.5, α1 = 1, from 5: zero after {time:.3f} s")


def steep_mode() -> Finding:
    """Beta > 1: fast far away, and never there."""
    fast, linear = _mode(5.0, 1.0, 2.0, 0.5), _mode(5.0, 1.0, 1.0, 0.5)
    late = _mode(5.0, 1.0, 2.0, 100.0)
    return holds(
        fast < linear and late > 1e-3,
        f"β1 = 2 from 5: {fast:.2f} after 0.5 s (β1 = 1: {linear:.2f}), yet {late:.4f} after 100 s",
    )


def rate_over_distance() -> Finding:
    """The relative rate of convergence, alpha |x|^(beta-1), is no inverse of the distance for any beta > 1."""
    near, far = (1.0 * x ** (2.0 - 1.0) for x in (0.1, 1.0))
    return holds(
        near > far, f"it grows with the distance, as |x|^(β1−1): {near:g} /s at 0.1, {far:g} /s at 1 for β1 = 2"
    )


def monotone_in_alpha() -> Finding:
    """Remark 3's time falls as alpha rises."""
    times = [tsm_time(5.0, alpha, 0.5) for alpha in (0.5, 1.0, 2.0, 4.0)]
    return holds(
        times == sorted(times, reverse=True), "α1 = 0.5, 1, 2, 4: " + ", ".join(f"{t:.2f}" for t in times) + " s"
    )


def remark_3() -> Finding:
    """The closed form against quadrature."""
    from scipy.integrate import quad

    worst = 0.0
    for x0 in (0.5, 5.0):
        for alpha in (0.5, 2.0):
            for beta in (0.2, 0.5, 0.8):
                integral, _ = quad(lambda u, e=1.0 - beta, a=alpha: 1.0 / (a * e), 0.0, x0 ** (1.0 - beta))
                worst = max(worst, abs(tsm_time(x0, alpha, beta) / integral - 1.0))
    return holds(worst < EXACT, f"{below(worst)} off the integral")


def figure_3() -> Finding:
    """The times of s1, s2, s3 from 6."""
    s1, s2, s3 = tsm_time(6.0, 1.0, 0.5), ftsm_time(6.0, 1.0, 3.0, 1.0, 0.5), ftsm_time(6.0, 1.0, 1.0, 1.0, 0.5)
    return holds(s2 < s1 and s3 < s1, f"from 6: s1 {s1:.2f} s, s2 {s2:.2f} s, s3 {s3:.2f} s")


def dominance() -> Finding:
    """Where the two terms of Eq. (12) are equal, for the gains of Table 2."""
    told, right = [], []
    for name in ("NFTSM_1", "NFTSM", "NFTSM as printed"):
        g = nftsm(name)
        cross = (g.alpha3 / g.alpha2) ** (1.0 / (g.beta2 - g.beta3))
        near = 1e-3
        right.append(g.alpha3 * near**g.beta3 > g.alpha2 * near**g.beta2)
        told.append(f"{name} beyond |ℓ| = {cross:.2f}" if right[-1] else f"{name} everywhere, near zero most of all")
    return holds_if(
        "β2 > β3", right == [True, True, False], "the α2 term dominates for " + ", ".join(told) + " (β2 = 0.2)"
    )


def without_the_fast_term() -> Finding:
    """With alpha2 = 0 the manifold of Eq. (12) is that of Eq. (11)."""
    g = replace(nftsm("NFTSM"), alpha2=0.0)
    worst = max(abs(manifold(g, x)[0] - g.alpha3 * x**g.beta3) for x in (0.002, 0.1, 1.0, 1.5))
    return holds(worst < EXACT, f"{below(worst)} off α3 sig^β3 outside η; the law flown as TSM, Eq. (34), is another")


def remark_4() -> Finding:
    """The printed closed form, and the corrected one, against quadrature."""
    from scipy.integrate import quad

    integral, _ = quad(lambda u: 2.0 / (u**5 + 1.0), 0.0, math.sqrt(6.0))  # dx / (x^3 + x^0.5) in u = x^0.5
    printed, corrected = printed_ftsm_time(6.0, 1.0, 3.0, 1.0, 0.5), ftsm_time(6.0, 1.0, 3.0, 1.0, 0.5)
    return holds(
        abs(printed - integral) < 1e-6,
        f"s2 of Figure 3 from 6: printed {printed:.4f} s, the integral {integral:.4f} s; the form with its limit at 0 "
        f"taken off gives {corrected:.4f} s",
    )


def hypergeometric_examples() -> Finding:
    """The three special values after Remark 4."""
    from scipy.special import hyp2f1

    off: list[float] = []
    for z in (0.1, 0.5, 0.9):
        off.append(float(hyp2f1(-3.0, 0.7, 0.7, -z)) - (1.0 + z) ** 3)
        off.append(float(hyp2f1(1.0, 1.0, 2.0, -z)) - math.log(1.0 + z) / z)
        off.append(float(hyp2f1(0.5, 1.0, 1.5, -z * z)) - math.atan(z) / z)
    worst = max(map(abs, off))
    return holds(worst < EXACT, f'{below(worst)} off, reading "ln 1+z / z" as ln(1 + z)/z')


def singular_tsm() -> Finding:
    """The slope of Eq. (13) near 0."""
    slopes = [(2.0 / 3.0) * x ** (2.0 / 3.0 - 1.0) for x in (1e-3, 1e-6, 1e-9)]
    return holds(
        slopes[2] > 10.0 * slopes[1] > 90.0 * slopes[0],
        f"the slope is {slopes[0]:.0f}, {slopes[1]:.0f}, {slopes[2]:.0f} at x = 1e-3, 1e-6, 1e-9",
    )


def manifold(g: Nftsm, ell: float) -> tuple[float, float]:
    """f(ell) of Section 3.3 and its slope, as the law has them."""
    _, rest, f = reaching(g)((math.tan(ell) / g.k1, 1.0, 0.0, 0.0, 0.0))
    reached = g.k2 * f + g.k3 * math.copysign(abs(f) ** g.gamma1, f)
    return f, -(rest + reached) / (g.k1 * math.cos(ell) ** 2)


def nonsingular() -> Finding:
    """The slope of the manifold near 0 with the three sets of gains."""
    slopes = {name: manifold(nftsm(name), 1e-9)[1] for name in ("NFTSM", "NFTSM_1", "NFTSM as printed")}
    told = ", ".join(f"{name} {slope:.3g}" for name, slope in slopes.items())
    return holds_if(
        "β2 ≥ 1", slopes["NFTSM"] < 10.0 and slopes["NFTSM_1"] < 10.0 < slopes["NFTSM as printed"],
        f"slope of the manifold at ℓ = 1e-9: {told} (β2 = 0.2, Table 2)",
    )  # fmt: skip


def continuous_slope() -> Finding:
    """Sigma and its derivative at +eta and -eta: as corrected, and as printed, with r1 + 2 r2 x for negative x."""
    g = nftsm("NFTSM")
    eta, beta3 = g.eta, g.beta3
    jumps = []
    for sign in (1.0, -1.0):
        inside, outside = (manifold(g, sign * eta * (1.0 + side * 1e-9)) for side in (-1.0, 1.0))
        jumps += [abs(inside[0] / outside[0] - 1.0), abs(inside[1] / outside[1] - 1.0)]
    r1, r2 = (2.0 - beta3) * eta ** (beta3 - 1.0), (beta3 - 1.0) * eta ** (beta3 - 2.0)
    printed, outer = r1 + 2.0 * r2 * -eta, beta3 * eta ** (beta3 - 1.0)
    return holds_if(
        "Eq. (16) has |x| in r1 + 2 r2 x",
        max(jumps) < 1e-6 and printed > 2.0 * outer,
        f"jumps of {below(max(jumps))} at ±η then; as printed the slope of σ at −η is "
        f"{printed / outer:.1f} times that outside",
    )


# Section 3.4


def lemma_1() -> Finding:
    """Eq. (22) against the integral of dV / (a V + b V^c)."""
    from scipy.integrate import quad

    worst = 0.0
    for a, b, c, V0 in ((1.0, 2.0, 0.5, 3.0), (24.0, 11.6, 0.95, 1.0), (0.3, 0.1, 0.2, 10.0)):
        bound = math.log((a * V0 ** (1.0 - c) + b) / b) / (a * (1.0 - c))
        integral, _ = quad(lambda u, a=a, b=b, c=c: 1.0 / ((1.0 - c) * (a * u + b)), 0.0, V0 ** (1.0 - c))
        worst = max(worst, abs(bound / integral - 1.0))
    return holds(worst < EXACT, f"with equality in (21) it is the time itself, to {below(worst)}")


def reaching_bound() -> Finding:
    """Eq. (25) against quadrature of Eq. (18)."""
    from scipy.integrate import quad

    g, worst = nftsm("NFTSM"), 0.0
    for s0 in (0.1, 1.0, 3.0):
        integral, _ = quad(lambda u: 1.0 / ((1.0 - g.gamma1) * (g.k2 * u + g.k3)), 0.0, s0 ** (1.0 - g.gamma1))
        worst = max(worst, abs(reaching_time(g, s0) / integral - 1.0))
    return holds(
        worst < 1e-8, f"it is the reaching time itself, to {below(worst)}: {reaching_time(g, 1.0):.3f} s from s = 1 rad"
    )


def eq_28() -> Finding:
    """The reach of the manifolds of Table 2."""
    reach = {name: manifold_reach(nftsm(name)) for name in ("NFTSM as printed", "NFTSM", "NFTSM_1")}
    told = ", ".join(f"{name} {x:.2f}" for name, x in reach.items())
    return holds_if(
        "NFTSM_1 is left out",
        reach["NFTSM_1"] > math.pi > reach["NFTSM"] > reach["NFTSM as printed"],
        f"{told} rad against π",
    )


def eq_30() -> Finding:
    """The reach plus arcsin xi, for Section 4's targets and wind."""

    def left(name: str, speed: float, wind: float) -> float:
        return math.degrees(math.asin((speed + wind) / V_A) + manifold_reach(nftsm(name)))

    still = {name: left(name, 0.0, 0.0) for name in ("NFTSM as printed", "NFTSM", "NFTSM_1")}
    moving = {name: left(name, 2.0, 0.0) for name in ("NFTSM as printed", "NFTSM")}
    return holds_if(
        "the gains are the printed ones of NFTSM, or the target rests",
        still["NFTSM"] < 90.0 < min(moving["NFTSM"], still["NFTSM_1"]) and moving["NFTSM as printed"] < 90.0,
        f"against 90°, target at rest: printed {still['NFTSM as printed']:.1f}°, fitted {still['NFTSM']:.1f}°, "
        f"NFTSM_1 {still['NFTSM_1']:.0f}°; at 2 m/s: printed {moving['NFTSM as printed']:.1f}°, fitted "
        f"{moving['NFTSM']:.1f}°",
    )


def eq_31() -> Finding:
    """Where on the manifold, in still air, V2 rises: f(ell) beyond pi."""
    told, fine = [], []
    for name in ("NFTSM", "NFTSM_1"):
        g = nftsm(name)
        r = np.linspace(0.1, 400.0, 4000)
        falls = np.array([math.sin(-manifold(g, math.atan(g.k1 * x))[0]) for x in r.tolist()]) <= 0.0
        fine.append(bool(falls.all()))
        told.append(
            f"{name} at every |r| up to 400 m"
            if fine[-1]
            else f"{name} up to |r| = {r[int(np.argmin(falls))]:.1f} m only"
        )
    return holds_if("Eq. (28) does", fine == [True, False], "V̇2 ≤ 0 on the manifold for " + ", ".join(told))


def eq_33() -> Finding:
    """Eq. (32), (33): the heading error on the manifold within eta."""
    worst = 0.0
    for name in ("NFTSM", "NFTSM_1"):
        g = nftsm(name)
        worst = max(
            worst,
            max(abs(manifold(g, ell)[0]) for ell in np.linspace(-g.eta, g.eta, 401).tolist())
            / boundary_heading_error(g),
        )
    bound = math.degrees(boundary_heading_error(nftsm("NFTSM")))
    return holds(worst <= 1.0 + EXACT, f"largest {worst:.4f} of the bound, which is {bound:.3f}° for NFTSM")


def inner_rate(g: Nftsm) -> float:
    """The rate at which r falls inside eta, 1/s, small r: v_a k1 alpha3 r1."""
    return float(V_A * g.k1 * g.alpha3 * (2.0 - g.beta3) * g.eta ** (g.beta3 - 1.0))


def finite_time_scalar() -> Finding:
    """Theorem 1 for the manifold alone: the way through eta is exponential."""
    g = nftsm("NFTSM")
    smaller = replace(g, eta=g.eta / 10.0)
    return holds_if(
        "zero means a tolerance",
        inner_rate(g) > 0.0,
        f"inside |ℓ| ≤ η, |r| ≤ {1000.0 * math.tan(g.eta) / g.k1:.0f} mm, the manifold is linear in r and r falls as "
        f"e^(−{inner_rate(g):.2f} t): never zero, but a factor 10 each {math.log(10.0) / inner_rate(g):.2f} s (η ten "
        f"times smaller: {math.log(10.0) / inner_rate(smaller):.2f} s)",
    )
