"""What the paper claims of sliding manifolds in formulas (3.2, 3.4), decided by closed forms, grids and quadrature."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from autopilot.nftsm import Nftsm, reaching
from harness.studies.paper.claims_of_geometry import EXACT, V_A, nftsm
from harness.studies.paper.decision import Decision, all_less, below, decide, every, largest, less
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


def exponential_mode_numbers() -> tuple[float]:
    """X after 2 s of x' = -x from 5: 5 e^-2."""
    return (_mode(5.0, 1.0, 1.0, 2.0),)


def exponential_mode(x: float) -> Decision:
    """`x` after 2 s."""
    off = abs(x / (5.0 * math.exp(-2.0)) - 1.0)
    return decide(less(off, 1e-6), f"x(2 s) = {x:.5f} from 5, {below(off)} off 5 e^-2")


def _mode(x0: float, alpha: float, beta: float, time: float) -> float:
    """X after a time of x' = -alpha sig^beta(x), integrated."""
    from scipy.integrate import solve_ivp

    def slope(_: float, x: Array) -> Array:
        return np.asarray(-alpha * np.maximum(x, 0.0) ** beta)

    return float(solve_ivp(slope, (0.0, time), [x0], rtol=1e-10, atol=1e-12).y[0, -1])


def terminal_mode_numbers() -> tuple[float, float, float]:
    """0 < beta < 1: the time to zero, and x just before and just after."""
    time = tsm_time(5.0, 1.0, 0.5)
    return time, _mode(5.0, 1.0, 0.5, 0.99 * time), _mode(5.0, 1.0, 0.5, 1.01 * time)


def terminal_mode(time: float, before: float, after: float) -> Decision:
    """X `before` and `after` the `time`, s."""
    return decide(
        every(less(1e-5, before), less(after, 1e-5)),
        f"β1 = 0.5, α1 = 1, from 5: {time:.3f} s by the formula; x is {before:.1g} at 99 % of it, {below(abs(after))} "
        "at 101 %",
    )


def steep_mode_numbers() -> tuple[float, float, float]:
    """Beta = 2 and 1 after 0.5 s, and beta = 2 after 100 s."""
    return _mode(5.0, 1.0, 2.0, 0.5), _mode(5.0, 1.0, 1.0, 0.5), _mode(5.0, 1.0, 2.0, 100.0)


def steep_mode(steep: float, linear: float, late: float) -> Decision:
    """X with beta = 2 and with beta = 1 after 0.5 s; with beta = 2 after 100 s."""
    return decide(
        every(less(steep, linear), less(1e-3, late)),
        f"β1 = 2 from 5: {steep:.2f} after 0.5 s (β1 = 1: {linear:.2f}), {late:.4f} after 100 s",
    )


def rate_over_distance_numbers() -> tuple[float, float]:
    """The relative rate of convergence, alpha |x|^(beta-1), at 0.1 and at 1, for beta = 2, 1/s."""
    near, far = (1.0 * x ** (2.0 - 1.0) for x in (0.1, 1.0))
    return near, far


def rate_over_distance(near: float, far: float) -> Decision:
    """The rates `near` zero and `far` from it."""
    return decide(less(far, near), f"the rate |x|^(β1−1) is {near:g} /s at 0.1, {far:g} /s at 1 for β1 = 2")


_ALPHAS = (0.5, 1.0, 2.0, 4.0)


def monotone_in_alpha_numbers() -> tuple[float, ...]:
    """Remark 3's times as alpha rises."""
    return tuple(tsm_time(5.0, alpha, 0.5) for alpha in _ALPHAS)


def monotone_in_alpha(*times: float) -> Decision:
    """The `times` as alpha rises, s."""
    return decide(
        every(*(less(later, earlier) for earlier, later in pairwise(times))),
        f"α1 = {', '.join(f'{alpha:g}' for alpha in _ALPHAS)}: " + ", ".join(f"{t:.2f}" for t in times) + " s",
    )


def remark_3_numbers() -> tuple[float]:
    """The closed form off quadrature, as a share."""
    from scipy.integrate import quad

    worst = 0.0
    for x0 in (0.5, 5.0):
        for alpha in (0.5, 2.0):
            for beta in (0.2, 0.5, 0.8):
                integral, _ = quad(lambda u, e=1.0 - beta, a=alpha: 1.0 / (a * e), 0.0, x0 ** (1.0 - beta))
                worst = largest(worst, abs(tsm_time(x0, alpha, beta) / integral - 1.0))
    return (worst,)


def remark_3(off: float) -> Decision:
    """`off` the integral."""
    return decide(less(off, EXACT), f"{below(off)} off the integral")


def figure_3_numbers() -> tuple[float, float, float]:
    """The times of s1, s2, s3 from 6, s."""
    return tsm_time(6.0, 1.0, 0.5), ftsm_time(6.0, 1.0, 3.0, 1.0, 0.5), ftsm_time(6.0, 1.0, 1.0, 1.0, 0.5)


def figure_3(s1: float, s2: float, s3: float) -> Decision:
    """The times of the three modes, s."""
    return decide(every(less(s2, s1), less(s3, s1)), f"from 6: s1 {s1:.2f} s, s2 {s2:.2f} s, s3 {s3:.2f} s")


_TABLE_2 = ("NFTSM_1", "NFTSM", "NFTSM as printed")


_NEAR, _FAR = 1e-3, 1.5  # |ell|: close to zero, and close to its largest value, pi/2


def dominance_numbers() -> tuple[float, ...]:
    """The alpha3 term over the alpha2 term of Eq. (12), for each set of `_TABLE_2` at `_NEAR`, then at `_FAR`."""
    sets = [nftsm(name) for name in _TABLE_2]
    return tuple(g.alpha3 * ell**g.beta3 / (g.alpha2 * ell**g.beta2) for ell in (_NEAR, _FAR) for g in sets)


def dominance(*ratios: float) -> Decision:
    """The alpha3 term over the alpha2 term: three sets of gains near zero, then far from it."""
    near, far = ratios[:3], ratios[3:]
    sets = [
        f"{name} (β2 = {nftsm(name).beta2:g}) {a:.2g} and {b:.2g}"
        for name, a, b in zip(_TABLE_2, near, far, strict=True)
    ]
    steep = every(less(1.0, near[0]), less(1.0, near[1]), all_less(far[:2], 1.0))  # beta2 > beta3
    return decide(
        every(steep, less(1.0, near[2]), less(far[2], 1.0)),
        f"the α3 term over the α2 term at |ℓ| = {_NEAR:g} and {_FAR:g}: " + ", ".join(sets),
        under={"β2 > β3": steep},
    )


def without_the_fast_term_numbers() -> tuple[float]:
    """With alpha2 = 0 the manifold of Eq. (12) off that of Eq. (11), outside eta, rad."""
    g = replace(nftsm("NFTSM"), alpha2=0.0)
    return (largest(*(abs(manifold(g, x)[0] - g.alpha3 * x**g.beta3) for x in (0.002, 0.1, 1.0, 1.5))),)


def without_the_fast_term(off: float) -> Decision:
    """`off` Eq. (11), rad."""
    return decide(less(off, EXACT), f"{below(off)} off α3 sig^β3 outside η")


def remark_4_numbers() -> tuple[float, float, float]:
    """The closed form as printed, the corrected one, and quadrature, s."""
    from scipy.integrate import quad

    integral, _ = quad(lambda u: 2.0 / (u**5 + 1.0), 0.0, math.sqrt(6.0))  # dx / (x^3 + x^0.5) in u = x^0.5
    return printed_ftsm_time(6.0, 1.0, 3.0, 1.0, 0.5), ftsm_time(6.0, 1.0, 3.0, 1.0, 0.5), integral


def remark_4(printed: float, corrected: float, integral: float) -> Decision:
    """The time as `printed`, as `corrected`, and the `integral`, s."""
    return decide(
        less(abs(printed - integral), 1e-6),
        f"s2 of Figure 3 from 6: printed {printed:.4f} s, the integral {integral:.4f} s; the form with its limit at 0 "
        f"taken off gives {corrected:.4f} s",
    )


def hypergeometric_examples_numbers() -> tuple[float]:
    """The largest error of the three special values after Remark 4."""
    from scipy.special import hyp2f1

    off: list[float] = []
    for z in (0.1, 0.5, 0.9):
        off.append(float(hyp2f1(-3.0, 0.7, 0.7, -z)) - (1.0 + z) ** 3)
        off.append(float(hyp2f1(1.0, 1.0, 2.0, -z)) - math.log(1.0 + z) / z)
        off.append(float(hyp2f1(0.5, 1.0, 1.5, -z * z)) - math.atan(z) / z)
    return (largest(*map(abs, off)),)


def hypergeometric_examples(off: float) -> Decision:
    """`off` the special values."""
    return decide(less(off, EXACT), f'{below(off)} off, reading "ln 1+z / z" as ln(1 + z)/z')


def singular_tsm_numbers() -> tuple[float, float, float]:
    """The slope of Eq. (13) at x = 1e-3, 1e-6, 1e-9."""
    a, b, c = ((2.0 / 3.0) * x ** (2.0 / 3.0 - 1.0) for x in (1e-3, 1e-6, 1e-9))
    return a, b, c


def singular_tsm(far: float, near: float, nearest: float) -> Decision:
    """The slopes."""
    return decide(
        every(less(9.0 * far, near), less(9.0 * near, nearest)),
        f"the slope is {far:.0f}, {near:.0f}, {nearest:.0f} at x = 1e-3, 1e-6, 1e-9",
    )


def manifold(g: Nftsm, ell: float) -> tuple[float, float]:
    """f(ell) of Section 3.3 and its slope, as the law has them."""
    _, rest, f = reaching(g)((math.tan(ell) / g.k1, 1.0, 0.0, 0.0, 0.0))
    reached = g.k2 * f + g.k3 * math.copysign(abs(f) ** g.gamma1, f)
    return f, -(rest + reached) / (g.k1 * math.cos(ell) ** 2)


def nonsingular_numbers() -> tuple[float, float, float]:
    """The slope of the manifold at |ell| = 1e-9, for each set of `_TABLE_2`."""
    a, b, c = (manifold(nftsm(name), 1e-9)[1] for name in _TABLE_2)
    return a, b, c


def nonsingular(nftsm_1: float, fitted: float, printed: float) -> Decision:
    """The slopes with three sets of gains."""
    sets = zip(_TABLE_2, (nftsm_1, fitted, printed), strict=True)
    return decide(
        all_less((nftsm_1, fitted, printed), 10.0),
        "slope of the manifold at ℓ = 1e-9: "
        + ", ".join(f"{name} (β2 = {nftsm(name).beta2:g}) {slope:.3g}" for name, slope in sets),
        under={"β2 ≥ 1": all_less((nftsm_1, fitted), 10.0)},
    )


def continuous_slope_numbers() -> tuple[float, float]:
    """Jumps of sigma and of its slope at +eta and -eta, as shares: the largest as corrected, the slope's as printed.

    Printed is r1 + 2 r2 x for negative x too.
    """
    g = nftsm("NFTSM")
    eta, beta3 = g.eta, g.beta3
    jumps = []
    for sign in (1.0, -1.0):
        inside, outside = (manifold(g, sign * eta * (1.0 + side * 1e-9)) for side in (-1.0, 1.0))
        jumps += [abs(inside[0] / outside[0] - 1.0), abs(inside[1] / outside[1] - 1.0)]
    r1, r2 = (2.0 - beta3) * eta ** (beta3 - 1.0), (beta3 - 1.0) * eta ** (beta3 - 2.0)
    printed, outer = r1 + 2.0 * r2 * -eta, beta3 * eta ** (beta3 - 1.0)
    return largest(*jumps), abs(printed / outer - 1.0)


def continuous_slope(corrected: float, printed: float) -> Decision:
    """The jumps as `corrected` and as `printed`, shares."""
    return decide(
        every(less(corrected, 1e-6), less(printed, 1e-6)),
        f"with |x| in r1 + 2 r2 |x| the jumps at ±η are {below(corrected)}; as printed the slope of σ at −η is off "
        f"that outside η by {100.0 * printed:.3g} %",
        under={"Eq. (16) has |x| in r1 + 2 r2 x": less(corrected, 1e-6)},
    )


# Section 3.4


def lemma_1_numbers() -> tuple[float]:
    """Eq. (22) off the integral of dV / (a V + b V^c), as a share."""
    from scipy.integrate import quad

    worst = 0.0
    for a, b, c, V0 in ((1.0, 2.0, 0.5, 3.0), (24.0, 11.6, 0.95, 1.0), (0.3, 0.1, 0.2, 10.0)):
        bound = math.log((a * V0 ** (1.0 - c) + b) / b) / (a * (1.0 - c))
        integral, _ = quad(lambda u, a=a, b=b, c=c: 1.0 / ((1.0 - c) * (a * u + b)), 0.0, V0 ** (1.0 - c))
        worst = largest(worst, abs(bound / integral - 1.0))
    return (worst,)


def lemma_1(off: float) -> Decision:
    """`off` the integral, a share."""
    return decide(less(off, EXACT), f"with equality in (21) it is off the time itself by {below(off)}")


def reaching_bound_numbers() -> tuple[float, float]:
    """Eq. (25) off quadrature of Eq. (18), as a share; and the time from s = 1 rad, s."""
    from scipy.integrate import quad

    g, worst = nftsm("NFTSM"), 0.0
    for s0 in (0.1, 1.0, 3.0):
        integral, _ = quad(lambda u: 1.0 / ((1.0 - g.gamma1) * (g.k2 * u + g.k3)), 0.0, s0 ** (1.0 - g.gamma1))
        worst = largest(worst, abs(reaching_time(g, s0) / integral - 1.0))
    return worst, reaching_time(g, 1.0)


def reaching_bound(off: float, time: float) -> Decision:
    """`off` the reaching time, a share; the `time` from 1 rad, s."""
    return decide(less(off, 1e-8), f"it is off the reaching time itself by {below(off)}: {time:.3f} s from s = 1 rad")


def eq_28_numbers() -> tuple[float, float, float]:
    """The reach of the manifolds of `_TABLE_2`, rad."""
    a, b, c = (manifold_reach(nftsm(name)) for name in _TABLE_2)
    return a, b, c


def eq_28(nftsm_1: float, fitted: float, printed: float) -> Decision:
    """The reach with three sets of gains, rad."""
    sets = zip(_TABLE_2, (nftsm_1, fitted, printed), strict=True)
    return decide(
        all_less((nftsm_1, fitted, printed), math.pi + EXACT),
        f"{', '.join(f'{name} {x:.2f}' for name, x in sets)} rad against π",
        under={"NFTSM_1 is left out": all_less((fitted, printed), math.pi + EXACT)},
    )


def eq_30_numbers() -> tuple[float, float, float, float, float]:
    """The reach plus arcsin xi, deg: a target at rest for each set of `_TABLE_2`; one at 2 m/s, fitted and printed."""
    reach = [manifold_reach(nftsm(name)) for name in _TABLE_2]
    rest = [math.degrees(x) for x in reach]
    moving = [math.degrees(math.asin(2.0 / V_A) + x) for x in reach[1:]]
    return rest[0], rest[1], rest[2], moving[0], moving[1]


def eq_30(nftsm_1: float, fitted: float, printed: float, moving_fitted: float, moving_printed: float) -> Decision:
    """The left sides of Eq. (30), deg."""
    return decide(
        all_less((nftsm_1, fitted, printed, moving_fitted, moving_printed), 90.0),
        f"against 90°, target at rest: printed {printed:.1f}°, fitted {fitted:.1f}°, NFTSM_1 {nftsm_1:.0f}°; at 2 m/s: "
        f"printed {moving_printed:.1f}°, fitted {moving_fitted:.1f}°",
        under={
            "the gains are not NFTSM_1's": all_less((fitted, printed, moving_fitted, moving_printed), 90.0),
            "the gains are those printed for NFTSM, or the fitted ones and the target rests": all_less(
                (fitted, printed, moving_printed), 90.0
            ),
        },
    )


def eq_31_numbers() -> tuple[float, float]:
    """Up to which |r| V2 falls on the manifold, in still air, for NFTSM and NFTSM_1, m; inf up to 400 m."""
    falls_to = []
    for name in ("NFTSM", "NFTSM_1"):
        g = nftsm(name)
        r = np.linspace(0.1, 400.0, 4000)
        falls = np.array([math.sin(-manifold(g, math.atan(g.k1 * x))[0]) for x in r.tolist()]) <= 0.0
        falls_to.append(math.inf if falls.all() else float(r[int(np.argmin(falls))]))
    return falls_to[0], falls_to[1]


def eq_31(fitted: float, nftsm_1: float) -> Decision:
    """Up to which |r| V2 falls, with the fitted gains, within Eq. (28), and with NFTSM_1's, beyond it; m."""

    def span(x: float) -> str:
        return "at every |r| up to 400 m" if x == math.inf else f"up to |r| = {x:.1f} m only"

    return decide(
        every(less(400.0, fitted), less(400.0, nftsm_1)),
        f"V̇2 ≤ 0 on the manifold for NFTSM {span(fitted)}, NFTSM_1 {span(nftsm_1)}",
        under={"Eq. (28) does, as with NFTSM's gains": less(400.0, fitted)},
    )


def eq_33_numbers() -> tuple[float, float]:
    """Eq. (32), (33): the largest heading error within eta over the bound; the bound for NFTSM, rad."""
    worst = 0.0
    for name in ("NFTSM", "NFTSM_1"):
        g = nftsm(name)
        errors = [abs(manifold(g, ell)[0]) for ell in np.linspace(-g.eta, g.eta, 401).tolist()]
        worst = largest(worst, largest(*errors) / boundary_heading_error(g))
    return worst, boundary_heading_error(nftsm("NFTSM"))


def eq_33(worst: float, bound: float) -> Decision:
    """The largest heading error over the `bound`, and the bound, rad."""
    return decide(
        less(worst, 1.0 + EXACT),
        f"largest {worst:.4f} of the bound, which is {math.degrees(bound):.3f}° for NFTSM",
    )


def inner_rate(g: Nftsm) -> float:
    """The rate at which r falls inside eta, 1/s, small r: v_a k1 alpha3 r1."""
    return float(V_A * g.k1 * g.alpha3 * (2.0 - g.beta3) * g.eta ** (g.beta3 - 1.0))


def finite_time_scalar_numbers() -> tuple[float, float, float, float]:
    """Theorem 1 for the manifold alone: the edge of eta, m; what is left of it after 20 s, m; the rates inside, 1/s.

    The second rate is that with an eta ten times smaller.
    """
    g = nftsm("NFTSM")
    edge, rate = math.tan(g.eta) / g.k1, inner_rate(g)
    return edge, edge * math.exp(-rate * 20.0), rate, inner_rate(replace(g, eta=g.eta / 10.0))


def finite_time_scalar(edge: float, left: float, rate: float, rate_smaller: float) -> Decision:
    """The `edge` of eta and what is `left` after 20 s, m; the `rate` inside, and with a smaller eta, 1/s."""
    tenfold, smaller = (math.log(10.0) / x if x else math.inf for x in (rate, rate_smaller))
    return decide(
        None if math.isnan(left) else left == 0.0,
        f"inside |ℓ| ≤ η, |r| ≤ {1000.0 * edge:.0f} mm, the manifold is linear in r and r falls as e^(−{rate:.2f} t), "
        f"by a factor 10 each {tenfold:.2f} s (η ten times smaller: {smaller:.2f} s), to {left:.1g} m in 20 s",
        under={"zero means a tolerance": less(left, 1e-6)},
    )
