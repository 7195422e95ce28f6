"""What the paper claims of relative motion in formulas (2.1 to 3.1, 3.3), decided on grids and along a motion."""

import math
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from autopilot.guidance import Observation
from autopilot.nftsm import Nftsm
from autopilot.standoff import course_rate_ratio, ground_speed, relative_motion
from harness.studies.estimator import MEASURED, SEEDS, STATES, band, examine, fitting_case
from harness.studies.paper.decision import Answer, Decision, below, decide, every, largest, less
from harness.studies.paper.experiments import paper_law
from harness.studies.paper.theory import manifold_reach

Array = NDArray[np.float64]

V_A, R_D = 13.0, 200.0
_WINDS = (0.0, 1.0, 5.0, 9.0, 12.9)
_ANGLES = np.linspace(-math.pi, math.pi, 25).tolist()
EXACT = 1e-9


def nftsm(label: str, max_heading_rate: float = math.inf) -> Nftsm:
    """One of the paper's NFTSM laws."""
    g = paper_law(label, max_heading_rate=max_heading_rate)
    assert isinstance(g, Nftsm)
    return g


# Section 2.1


def _winds() -> Iterator[tuple[float, float, float]]:
    """Heading, wind north, wind east."""
    for speed in _WINDS:
        for towards in _ANGLES:
            for psi in _ANGLES:
                yield psi, speed * math.cos(towards), speed * math.sin(towards)


def ground_speed_relation_numbers() -> tuple[float]:
    """The largest difference from the wind triangle, m/s."""
    worst = 0.0
    for psi, W_x, W_y in _winds():
        v_x, v_y = V_A * math.cos(psi) + W_x, V_A * math.sin(psi) + W_y
        worst = largest(worst, abs(ground_speed(V_A, math.atan2(v_y, v_x), W_x, W_y) - math.hypot(v_x, v_y)))
    return (worst,)


def ground_speed_relation(off: float) -> Decision:
    """`off` the wind triangle, m/s."""
    return decide(less(off, 1e-6), f"{below(off)} m/s off the wind triangle, winds up to {_WINDS[-1]:g} m/s")


def course_rate_relation_numbers() -> tuple[float]:
    """The largest difference from the derivative of the course by the heading, in differences."""
    worst, h = 0.0, 1e-6
    for psi, W_x, W_y in _winds():
        if math.hypot(W_x, W_y) > 9.0:  # close to standing still the differences are too coarse
            continue
        ends = [math.atan2(V_A * math.sin(a) + W_y, V_A * math.cos(a) + W_x) for a in (psi - h, psi + h)]
        slope = math.remainder(ends[1] - ends[0], math.tau) / (2.0 * h)
        worst = largest(worst, abs(slope - course_rate_ratio(V_A, psi, W_x, W_y)))
    return (worst,)


def course_rate_relation(off: float) -> Decision:
    """`off` the derivative."""
    return decide(less(off, 1e-6), f"{below(off)} off the derivative")


def no_wind_ratio_numbers() -> tuple[float]:
    """The largest |L - 1| without wind."""
    return (largest(*(abs(course_rate_ratio(V_A, psi, 0.0, 0.0) - 1.0) for psi in _ANGLES)),)


def no_wind_ratio(off: float) -> Decision:
    """`off` 1."""
    return decide(less(off, EXACT), f"{below(off)} off 1")


def ratio_range_numbers() -> tuple[float, float, float]:
    """L's least and largest value over headings and winds, and its value in a headwind of 5 m/s."""
    ratios = [course_rate_ratio(V_A, psi, W_x, W_y) for psi, W_x, W_y in _winds()]
    return min(ratios), max(ratios), course_rate_ratio(V_A, 0.0, -5.0, 0.0)


def ratio_range(low: float, high: float, headwind: float) -> Decision:
    """L from `low` to `high`, and in a headwind of 5 m/s."""
    return decide(
        every(less(0.5, low), less(high, 1.0 + EXACT)),
        f"L from {low:.4f} to {high:.3g} in winds up to {_WINDS[-1]:g} m/s; {headwind:.3f} in a headwind of 5 m/s",
    )


# Section 2.2


def estimator_consistent_numbers() -> tuple[float, float, float, float]:
    """Mean NEES and NIS over 200 seeds of a target that fits the model: from a known start, from a measured one."""
    numbers = []
    for known in (True, False):
        consistency = examine(fitting_case(1000.0, known))
        nis = consistency.nis
        numbers += [float(consistency.nees.mean()), float(nis[:, ~np.isnan(nis[0])].mean())]
    known_nees, known_nis, measured_nees, measured_nis = numbers
    return known_nees, known_nis, measured_nees, measured_nis


def estimator_consistent(known_nees: float, known_nis: float, measured_nees: float, measured_nis: float) -> Decision:
    """NEES and NIS from a known start, and from a measured one."""
    known = every(_is_right(known_nees, STATES), _is_right(known_nis, MEASURED))
    measured = every(_is_right(measured_nees, STATES), _is_right(measured_nis, MEASURED))
    return decide(
        every(known, measured),
        f"over {SEEDS} seeds, 1 km from the sensor: NEES {known_nees:.3g}, NIS {known_nis:.3g} from a known start "
        f"({STATES} and {MEASURED} are right), NEES {measured_nees:.3g}, NIS {measured_nis:.3g} from the first "
        "measurement; the page of the estimator has more cases",
        under={"the start is known, or near the sensor": known},
    )


def _is_right(average: float, numbers: int) -> Answer:
    low, high = band(numbers, SEEDS)
    return every(less(low, average), less(average, high))


_WIND, _TARGET_SPEED, _TARGET_TURN, _TARGET_ACCELERATION = (3.0, -1.0), 4.0, 0.03, 0.05


def _moment(t: float, wind: tuple[float, float] = _WIND, psi: float = 0.7) -> Observation:
    """An aircraft on a straight way and a target that turns and accelerates, at t from a moment."""
    v_t, psi_t = _TARGET_SPEED + _TARGET_ACCELERATION * t, -0.4 + _TARGET_TURN * t
    v_x, v_y = V_A * math.cos(psi) + wind[0], V_A * math.sin(psi) + wind[1]
    mean = -0.4 + 0.5 * _TARGET_TURN * t
    return Observation(
        north=-150.0 + v_x * t, east=190.0 + v_y * t, velocity_north=v_x, velocity_east=v_y, airspeed=V_A, heading=psi,
        heading_rate=0.0, bank=0.0, roll_rate=0.0, nominal_airspeed=V_A, wind_north=wind[0], wind_east=wind[1],
        target_north=10.0 + _TARGET_SPEED * t * math.cos(mean), target_east=10.0 + _TARGET_SPEED * t * math.sin(mean),
        target_velocity_north=v_t * math.cos(psi_t), target_velocity_east=v_t * math.sin(psi_t),
        target_acceleration=_TARGET_ACCELERATION, target_turn_rate=_TARGET_TURN,
    )  # fmt: skip


def _derivative(f: Callable[[float], float], h: float = 1e-4) -> float:
    return (f(h) - f(-h)) / (2.0 * h)


def _distance_and_azimuth(t: float, wind: tuple[float, float] = _WIND) -> tuple[float, float]:
    o = _moment(t, wind)
    x, y = o.north - o.target_north, o.east - o.target_east
    return math.hypot(x, y), math.atan2(y, x)


def range_rate_numbers() -> tuple[float]:
    """The first line of Eq. (5) off the derivative of the distance, m/s."""
    by_law = relative_motion(_moment(0.0), R_D, V_A, 0.7)[1]
    return (abs(by_law - _derivative(lambda t: _distance_and_azimuth(t)[0])),)


def range_rate(off: float) -> Decision:
    """`off` the derivative, m/s."""
    wind = math.hypot(*_WIND)
    return decide(less(off, 1e-5), f"{below(off)} m/s off the derivative along a motion in {wind:.1f} m/s of wind")


def azimuth_rate_as_printed_numbers() -> tuple[float, float, float]:
    """The second line of Eq. (5), the aircraft's heading in the target's term as printed; the target's; the truth."""
    o = _moment(0.0)
    L, theta = _distance_and_azimuth(0.0)
    lam = theta - 0.5 * math.pi
    v_t, psi_t = _TARGET_SPEED, -0.4
    v_w, psi_w = math.hypot(*_WIND), math.atan2(_WIND[1], _WIND[0])
    rest = -V_A * math.cos(0.7 - lam) - v_w * math.cos(psi_w - lam)
    printed, corrected = ((rest + v_t * math.cos(angle - lam)) / L for angle in (o.heading, psi_t))
    return printed, corrected, _derivative(lambda t: _distance_and_azimuth(t)[1])


def azimuth_rate_as_printed(printed: float, corrected: float, truth: float) -> Decision:
    """The rates as printed, with the target's heading, and in truth, rad/s."""
    return decide(
        less(abs(printed - truth), 1e-5),
        f"off by {math.degrees(abs(printed - truth)):.2f} deg/s of {math.degrees(truth):.2f}; with ψ_t in the target's "
        f"term by {below(math.degrees(abs(corrected - truth)))}",
    )


# Section 3.1


def _bars() -> Iterator[tuple[float, float]]:
    """(bar psi_a, bar psi_a^d) over (-pi/2, pi/2], rad."""
    for a in np.linspace(-0.5 * math.pi, 0.5 * math.pi, 61)[1:].tolist():
        for d in np.linspace(-0.5 * math.pi, 0.5 * math.pi, 61)[1:].tolist():
            yield a, d


def desired_heading_numbers() -> tuple[float]:
    """The rate of the distance at the desired heading, m/s."""
    o = _moment(0.0)
    error = relative_motion(o, R_D, V_A, o.heading)[3]
    return (abs(relative_motion(o, R_D, V_A, o.heading - error)[1]),)


def desired_heading(rate: float) -> Decision:
    """Eq. (7): the `rate` of the distance, m/s."""
    return decide(less(rate, EXACT), f"the distance changes by {below(rate)} m/s at that heading")


def range_rate_by_heading_error_numbers() -> tuple[float]:
    """Both forms of Eq. (8) off its left side, v_a (sin bar psi_a - sin bar psi_a^d), m/s."""
    worst = 0.0
    for a, d in _bars():
        exact = V_A * (math.sin(a) - math.sin(d))
        error = a - d
        first = V_A * (math.sin(d) * (math.cos(error) - 1.0) + math.cos(d) * math.sin(error))
        second = 2.0 * V_A * math.sin(0.5 * error) * math.cos(0.5 * (a + d))
        worst = largest(worst, abs(first - exact), abs(second - exact))
    return (worst,)


def range_rate_by_heading_error(off: float) -> Decision:
    """Eq. (8) `off` its left side, m/s."""
    return decide(less(off, EXACT), f"{below(off)} m/s off")


def remark_2_cosine_numbers() -> tuple[float, float]:
    """The least cos((bar psi_a + bar psi_a^d)/2) without the corner where both are 90 deg, and that in the corner."""
    return min(math.cos(0.5 * (a + d)) for a, d in _bars() if a + d < math.pi), math.cos(0.5 * math.pi)


def remark_2_cosine(least: float, at_corner: float) -> Decision:
    """The cosine at the `least`, and at the corner."""
    positive = less(0.0, least)
    return decide(
        every(positive, less(EXACT, at_corner)),
        f"{least:.3f} at the least elsewhere, {below(abs(at_corner))} where both are 90°",
        under={"not both are exactly 90°": positive},
    )


def remark_2_equivalence_numbers() -> tuple[float, float]:
    """How many points inside have unlike signs of r' and of the heading error; r' outside, m/s, the error +110 deg."""
    unlike = sum((math.sin(a) > math.sin(d)) != (a > d) for a, d in _bars() if abs(a - d) > EXACT)
    a, d = math.radians(150.0), math.radians(40.0)
    return float(unlike), V_A * (math.sin(a) - math.sin(d))


def remark_2_equivalence(unlike: float, outside: float) -> Decision:
    """Signs of r' and of the heading error: `unlike` inside so often, and r' `outside`, m/s."""
    inside = less(unlike, 0.5)
    return decide(
        every(inside, less(0.0, outside)),
        f"{unlike:.0f} exceptions in {len(list(_bars()))} points inside; outside, at ψ̄_a = 150°, ψ̄_a^d = 40°, the "
        f"heading error is +110° and r changes by {outside:+.2f} m/s",
        under={"|ψ̄_a| ≤ 90°": inside},
    )


def arctan_manifold_numbers() -> tuple[float, float, float]:
    """Points of psi_a = psi_a^d - arctan(c r) where r > 0 does not fall: all, inside 90 deg; the least target speed.

    For every c at once: over all values of the arctan. The speed, m/s, is the least at which a target is left so.
    """
    angles, targets = np.linspace(0.0, 0.5 * math.pi, 91)[1:-1], np.linspace(-0.5 * math.pi, 0.5 * math.pi, 91)
    wrong = [(d - f, d) for f in angles for d in targets if math.sin(d - f) - math.sin(d) >= 0.0]
    inside = [pair for pair in wrong if abs(pair[0]) <= 0.5 * math.pi]
    return float(len(wrong)), float(len(inside)), V_A * min((abs(math.sin(d)) for _, d in wrong), default=math.inf)


def arctan_manifold(wrong: float, inside: float, speed: float) -> Decision:
    """How many points are `wrong`, how many of them `inside`, and from which target `speed` on, m/s."""
    return decide(
        less(wrong, 0.5),
        f"{inside:.0f} exceptions there; beyond, r > 0 may grow where the target leaves at {speed:.1f} of {V_A:g} m/s "
        "or more",
        under={"|ψ̄_a| ≤ 90°": less(inside, 0.5)},
    )


def starts_in_the_regions_numbers() -> tuple[float, float, float, float]:
    """Bar psi_a at the paper's starts at 30 and 130 deg, and Eq. (30)'s bound with two sets of gains, deg."""
    lam = math.atan2(200.0 - 10.0, -200.0 - 10.0) - 0.5 * math.pi
    at_30, at_130 = (math.degrees(math.remainder(math.radians(deg) - lam, math.tau)) for deg in (30.0, 130.0))
    printed, fitted = (math.degrees(manifold_reach(nftsm(name))) for name in ("NFTSM as printed", "NFTSM"))
    return at_30, at_130, printed, fitted


def starts_in_the_regions(at_30: float, at_130: float, printed: float, fitted: float) -> Decision:
    """Bar psi_a at both starts; Eq. (30)'s bound with the printed and with the fitted gains, deg."""
    farthest = largest(abs(at_30), abs(at_130))
    return decide(
        every(less(farthest, 90.0), less(farthest, printed)),
        f"ψ̄_a is {at_30:.1f}° from 30° and {at_130:.1f}° from 130°; Remark 2 allows 90°, Eq. (30) {printed:.1f}° with "
        f"the printed gains and {fitted:.1f}° with the fitted ones",
        under={
            "the gains are the fitted ones": every(less(farthest, 90.0), less(farthest, fitted)),
            "that is Remark 2's region, |ψ̄_a| < 90°, not Eq. (30)'s": less(farthest, 90.0),
        },
    )


# Sections 3.3 and 3.4, along a motion


def reaching_law_numbers() -> tuple[float]:
    """The rate of the law's own s along a motion, unlimited, off Eq. (18), as a share of it."""
    worst = 0.0
    for name in ("NFTSM", "NFTSM_1"):
        steering = nftsm(name)
        step = steering.start()
        for psi in (-2.0, 0.4, 2.9):
            turn = step(_moment(0.0, psi=psi)).heading_rate

            def s_at(
                t: float, psi: float = psi, turn: float = turn, step: Callable[..., tuple[float, ...]] = step
            ) -> float:
                o = _moment(t, psi=psi)  # the way bends by t^2: no matter for the first derivative
                return float(step(o._replace(heading=psi + turn * t))[2])

            s = s_at(0.0)
            reached = -steering.k2 * s - steering.k3 * math.copysign(abs(s) ** steering.gamma1, s)
            worst = largest(worst, abs(_derivative(s_at, 1e-6) / reached - 1.0))
    return (worst,)


def reaching_law(off: float) -> Decision:
    """`off` Eq. (18), as a share."""
    return decide(
        less(off, 1e-4), f"with Eq. (5), (16), (20) corrected: ṡ {below(off)} off Eq. (18), wind and target turning"
    )


def desired_heading_rate_numbers() -> tuple[float, float, float]:
    """Eq. (20), its omega_w read as omega_t, off the rate of bar psi_a^d, rad/s: in wind, in still air; corrected.

    As printed it is without the wind's term.
    """
    printed, corrected = _desired_heading_rate_off(_WIND)
    return printed, _desired_heading_rate_off((0.0, 0.0))[0], corrected


def _desired_heading_rate_off(wind: tuple[float, float]) -> tuple[float, float]:
    """As printed and as corrected, rad/s."""
    o = _moment(0.0, wind)
    _, theta = _distance_and_azimuth(0.0, wind)
    lam = theta - 0.5 * math.pi
    lam_dot = _derivative(lambda t: _distance_and_azimuth(t, wind)[1])
    v_t, bar_t = _TARGET_SPEED, -0.4 - lam
    v_w, bar_w = math.hypot(*wind), math.atan2(wind[1], wind[0]) - lam
    root = math.sqrt(V_A**2 - (v_t * math.sin(bar_t) - v_w * math.sin(bar_w)) ** 2)
    printed = (_TARGET_ACCELERATION * math.sin(bar_t) + v_t * math.cos(bar_t) * (_TARGET_TURN - lam_dot)) / root
    corrected = relative_motion(o, R_D, V_A, o.heading)[4]

    def bar_d(t: float) -> float:
        at = _moment(t, wind)
        lam = _distance_and_azimuth(t, wind)[1] - 0.5 * math.pi
        return at.heading - relative_motion(at, R_D, V_A, at.heading)[3] - lam

    truth = _derivative(bar_d)
    return abs(printed - truth), abs(corrected - truth)


def desired_heading_rate(in_wind: float, in_still_air: float, corrected: float) -> Decision:
    """Eq. (20) as printed off the truth, `in_wind` and `in_still_air`, and `corrected`, rad/s."""
    return decide(
        less(in_wind, 1e-6),
        f"reading ω_w as ω_t: off by {math.degrees(in_wind):.2f} deg/s in {math.hypot(*_WIND):.1f} m/s of wind, by "
        f"{below(math.degrees(in_still_air))} in still air; with the term v_w cos(ψ̄_w) λ̇ by "
        f"{below(math.degrees(corrected))} in wind",
        under={"ω_w is ω_t, and in still air": less(in_still_air, 1e-6)},
    )


def eq_29_numbers() -> tuple[float, float]:
    """The largest |bar psi_a^d| over all directions of target and wind, and arcsin xi, rad."""
    v_t, v_w = 2.0, 3.0
    worst = largest(*(abs(math.asin((v_t * math.sin(a) - v_w * math.sin(b)) / V_A)) for a in _ANGLES for b in _ANGLES))
    return worst, math.asin((v_t + v_w) / V_A)


def eq_29(worst: float, bound: float) -> Decision:
    """The `worst` |bar psi_a^d| and its `bound`, rad."""
    return decide(
        less(worst, bound + EXACT),
        f"{math.degrees(worst):.2f}° at the most, the bound {math.degrees(bound):.2f}° (2 m/s, wind 3 m/s)",
    )
