"""What the paper claims of its law in flight, Sections 1 to 3, and its sampling: asked of a column's flights."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np

from autopilot.guidance import Law
from autopilot.nftsm import Nftsm
from harness.checks import problems
from harness.flight import Flight
from harness.studies.paper.claims_of_the_manifold import inner_rate, manifold
from harness.studies.paper.columns import Column, EndedEarlyError
from harness.studies.paper.decision import Decision, decide, every, less, metres, within
from harness.studies.paper.experiments import STRAIGHT, Reading, flight, own, paper_law
from harness.studies.paper.measures import ON_THE_CIRCLE, azimuth, peak, rms, settled, turns
from harness.studies.paper.theory import longest_stable_period, reaching_time
from harness.world.target import Target
from harness.world.wind import Wind

_STEP = 0.005  # s
NEARLY_AS_FAST = 12.0  # m/s of 13: a target that is slower than the aircraft by less than a tenth


# Abstract, introduction, Section 2


def circles_a_moving_target(on: Column) -> Decision:
    """NFTSM round the S, until 330 s."""
    log = on.paper("S", "NFTSM", duration=330.0)
    time = settled(log, 1.0)
    return decide(
        time is not None and turns(log, time) > 1.0,
        f"within 1 m of the circle round the S {'never' if time is None else f'from {time:g} s on'}, "
        f"{turns(log, time or 100.0):.1f} turns till 330 s, r "
        f"{metres(rms(log, 100.0))} rms after 100 s",
    )


def smc_takes_for_ever(on: Column) -> Decision:
    """The traditional law, 400 s round a stationary target: does the error go on falling?"""
    log = on.paper("30", "SMC", Reading(period=0.005), 400.0)
    at = [abs(float(log["range_error"][np.searchsorted(log["time"], t)])) for t in (100.0, 200.0, 300.0, 400.0)]
    return decide(
        at[-1] < ON_THE_CIRCLE and all(later < earlier for earlier, later in pairwise(at)),
        "|r| " + ", ".join(f"{x:.2g}" for x in at) + " m after 100, 200, 300, 400 s",
    )


def _quantity(x: float | None, unit: str, digits: str = ".2g") -> str:
    return "not measured" if x is None else f"{round(x, 6):{digits}} {unit}"


def tracks_its_commands(on: Column) -> Decision:
    """NFTSM from 30 deg: heading rate, airspeed, altitude. The kinematic aircraft has no altitude to lose."""
    metrics = on.measured(flight("30", "NFTSM", Reading(period=0.05)))
    rate, speed, height = (
        metrics[name]
        for name in ("heading_rate_error_rms_deg_s", "airspeed_deviation_rms_mps", "altitude_deviation_peak_m")
    )
    most = 0.05 * on.limit
    return decide(
        every(less(rate, most), less(speed, 0.13), less(height, 2.0)),
        f"heading rate {_quantity(rate, 'deg/s')} rms off, airspeed {_quantity(speed, 'm/s')} rms, altitude "
        f"{_quantity(height, 'm')} at the most (allowed: {most:.3g}, 0.13, 2)",
    )


def coordinated(on: Column) -> Decision:
    """NFTSM from 30 deg: does it turn as a coordinated aircraft does?"""
    metrics = on.measured(flight("30", "NFTSM", Reading(period=0.05)))
    ratio, sideslip = metrics["turn_ratio"], metrics["sideslip_peak_deg"]
    if not on.aircraft:
        return decide(True, "the kinematic aircraft is the model itself: it has neither bank nor sideslip")
    off = None if ratio is None else abs(ratio - 1.0)
    return decide(
        every(less(off, 0.05), less(sideslip, 2.0)),
        f"heading rate {_quantity(ratio, 'times g tan φ / V', '.3f')}, sideslip up to {_quantity(sideslip, '°')} "
        "(allowed: 5 % and 2°)",
    )


def flies_by_course(on: Column) -> Decision:
    """NFTSM in 3.6 m/s of wind, by heading and by course, limited to 10 deg/s."""
    by_heading = replace(own("NFTSM", Target(), 100.0, 10.0), wind=Wind(steady=(3.0, 2.0)))
    by_course = replace(by_heading, law=paper_law("NFTSM", max_heading_rate=math.radians(10.0), command="course_rate"))
    times = [settled(on.fly(each), 1.0) for each in (by_heading, by_course)]
    return decide(
        times[1] is not None,
        f"in 3.6 m/s of wind within 1 m {within(times[1])} by ground speed and course, {within(times[0])} by "
        "airspeed and heading",
    )


def _straight(speed: float) -> Target:
    return replace(STRAIGHT, speed=speed)


def _held(on: Column, speed: float, limit_deg_s: float) -> bool:
    try:
        return peak(on.fly(own("NFTSM", _straight(speed), 300.0, limit_deg_s)), 200.0) < ON_THE_CIRCLE
    except EndedEarlyError:
        return False


def _fastest(paper_flight: Flight) -> float:
    """The fastest straight target whose circle the limit allows, by (v_a + w)^2 / (v_a R_d), w = |wind - v_t|; m/s."""
    v_a = paper_flight.start.airspeed
    w = math.sqrt(paper_flight.law.max_heading_rate * v_a * paper_flight.law.standoff) - v_a
    (W_x, W_y), psi_t = paper_flight.wind.steady, STRAIGHT.heading
    along, across = W_x * math.cos(psi_t) + W_y * math.sin(psi_t), W_y * math.cos(psi_t) - W_x * math.sin(psi_t)
    return along + math.sqrt(w * w - across * across) if w > abs(across) else 0.0


def remark_1_is_enough(on: Column) -> Decision:
    """The fastest straight target round which NFTSM keeps within 1 m, to 0.1 m/s, with the limit and without."""
    fastest = []  # m/s, with the limit and without
    for limit in (5.0, math.inf):
        low, high = 0, 130  # tenths of a metre per second
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if _held(on, middle / 10.0, limit) else (low, middle)
        fastest.append(low / 10.0)
    bound = _fastest(on.change(own("NFTSM", _straight(0.0), 300.0, 5.0)))
    limited, free = fastest
    fast_limited, fast_free = (f"up to v_t = {most:.1f} m/s" if most else "not at 0.1 m/s" for most in fastest)
    return decide(
        min(fastest) > NEARLY_AS_FAST,
        f"within 1 m of the circle {fast_limited} at {on.limited} (the formula: {bound:.2f}), {fast_free} without a "
        "limit",
        under={"the limit allows (v_a + w)²/(v_a R_d)": free > NEARLY_AS_FAST and limited > 0.0},
    )


def faster_target_flees(on: Column) -> Decision:
    """A target at 13.5 m/s."""
    log = on.fly(own("NFTSM", _straight(13.5), 600.0))
    away = [float(log["range_error"][np.searchsorted(log["time"], t)]) for t in (200.0, 400.0, 600.0)]
    return decide(
        away[2] > away[1] > away[0] > 1.0,
        "r " + ", ".join(f"{x:.0f}" for x in away) + " m after 200, 400, 600 s at v_t = 13.5 m/s",
    )


def definition_1(on: Column) -> Decision:
    """The three conditions: r and r' at the end, and for how long r r' > 0, from both starts."""
    sentences, fine = [], []
    for experiment, label in (("30", "NFTSM"), ("30", "NFTSM_1"), ("130", "NFTSM")):
        log = on.paper(experiment, label)
        r, time = log["range_error"], log["time"]
        r_dot = np.gradient(r, time)
        away = float(np.mean((r * r_dot > 0.0) & (np.abs(r) > on.tolerance))) * float(time[-1])
        fine.append(away < 0.1 and abs(r[-1]) < on.tolerance)
        sentences.append(
            f"{label} from {experiment}°: r {metres(abs(r[-1]))}, ṙ {metres(abs(r_dot[-1]))}/s at the end, r ṙ "
            f"> 0 for {away:.1f} s"
        )
    return decide(
        all(fine),
        "; ".join(sentences),
        under={"there is no overshoot and the start is not turned away": fine[0]},
    )


# Section 3


def goes_round(on: Column) -> Decision:
    """The azimuth of a slow target: does it go one way?"""
    log = on.paper("S", "NFTSM", duration=330.0)
    rate = np.diff(azimuth(log)[log["time"] > 100.0])
    one_way = bool((rate < 0.0).all())
    return decide(
        one_way, f"{turns(log, 100.0):.2f} turns in 230 s round 2 m/s, {'never' if one_way else 'at times'} back"
    )


def follows_behind(on: Column) -> Decision:
    """A target at 11 m/s, straight, without a limit: how the aircraft goes round it."""
    log = on.fly(own("NFTSM", _straight(11.0), 700.0))
    late = log["time"] > 200.0
    seen = np.degrees(azimuth(log)[late]) + 45.0  # from the target's heading; clockwise
    rate = np.abs(np.gradient(seen, log["time"][late]))
    behind = np.abs(np.mod(seen - 180.0 + 180.0, 360.0) - 180.0) < 45.0
    slowest = float(np.mod(seen[int(np.argmin(rate))] + 180.0, 360.0) - 180.0)
    round_ = turns(log, 200.0)
    once = 500.0 / max(round_, 1e-9)
    return decide(
        round_ < 0.5,
        f"at 11 of 13 m/s once round in {once:.0f} s, slowest ({rate.min():.2f} deg/s) "
        f"at {slowest:.0f}° from the target's heading (90° is abeam), fastest ({rate.max():.1f}); within 45° "
        "of straight "
        f"behind {100.0 * behind.mean():.0f} % of the time",
    )


def v1_falls(on: Column) -> Decision:
    """V1 = s^2/2 along the paper's flights, free and at the limit."""
    sentences, free_fine, limited_fine = [], True, True
    for experiment, label in (("30", "NFTSM"), ("130", "NFTSM"), ("30", "NFTSM_1")):
        log = on.paper(experiment, label)
        V1, period = 0.5 * log["sliding_variable"] ** 2, log.flight.guidance_period
        free = np.abs(log["unlimited_command"][:-1]) < log.flight.law.max_heading_rate
        rises = (np.diff(V1) > 0.0) & (V1[:-1] > 1e-12)
        while_free, at_limit = period * (rises & free).sum(), period * (rises & ~free).sum()
        free_fine, limited_fine = free_fine and not while_free, limited_fine and not at_limit
        sentences.append(f"{label} from {experiment}° {while_free:.2g} s while free, {at_limit:.2g} s at the limit")
    number = "V1 rises: " + ", ".join(sentences)
    return decide(free_fine and limited_fine, number, under={"the command is not at its limit": free_fine})


def eq_25_bounds_the_flight(on: Column) -> Decision:
    """When |s| is down to 1e-3 rad, against Eq. (25), without a limit and with the paper's."""
    sentences: list[str] = []
    times, bound = [], 0.0
    for limit in (math.inf, 5.0):
        log = on.fly(own("NFTSM", Target(), 60.0, limit, 0.001 if on.tolerance < 1e-3 else 0.05))
        s = np.abs(log["sliding_variable"])
        beyond = np.flatnonzero(s > 1e-3)
        times.append(math.inf if s[-1] > 1e-3 else float(log["time"][beyond[-1]]))
        steering = log.flight.law
        assert isinstance(steering, Nftsm)
        bound = reaching_time(steering, float(s[0]))
        sentences.append(
            f"{'never' if math.isinf(times[-1]) else f'{times[-1]:.2f} s'} "
            f"{f'at {on.limited}' if sentences else 'without a limit'}"
        )
    number = f"the bound is {bound:.2f} s; |s| is below 1e-3 after " + ", ".join(sentences)
    return decide(max(times) <= bound, number, under={"there is no limit": times[0] <= bound})


def reaches_zero(on: Column) -> Decision:
    """Theorem 1 in flight: the way from 10 mm to 1e-6 m."""
    log = on.fly(own("NFTSM", Target(), 60.0, 5.0, 0.001 if on.tolerance < 1e-3 else 0.05))
    r, time = np.abs(log["range_error"]), log["time"]
    falling = (r < 1e-3) & (r > 1e-5)
    g = log.flight.law
    assert isinstance(g, Nftsm)
    rate = -float(np.polyfit(time[falling], np.log(r[falling]), 1)[0]) if falling.sum() >= 10 else math.nan
    falls = "" if math.isnan(rate) else f", inside η as e^(−{rate:.2f} t) ({inner_rate(g):.2f} by the manifold's slope)"
    return decide(
        bool(r[-1] == 0.0),
        f"1e-4 m {within(settled(log))}, {metres(float(r[-1]))} at the end, {metres(rms(log, 40.0))} rms from 40 s on"
        f"{falls}",
        under={"zero means a tolerance": bool(r[-1] < 1e-3 and abs(rate / inner_rate(g) - 1.0) < 0.05)},
    )


# Section 4


def sampling(on: Column, label: str) -> Decision:
    """The longest guidance period, of those that the column tries, at which the law converges from 30 deg."""
    limited = _converging(on, label, flight("30", label).law)
    sentences = [f"from 30° to {tolerance:g} m {_longest(each)}" for tolerance, each in limited.items()]
    free = paper_law(label, max_heading_rate=math.inf)
    if isinstance(free, Nftsm):
        unlimited = _converging(on, label, free)
        for i, (tolerance, each) in enumerate(unlimited.items()):
            bound = longest_stable_period(free, manifold(free, math.atan(free.k1 * tolerance))[0])
            sentences[i] += f", unlimited {_longest(each)} (the bound from k2 and k3: {_period(bound)})"
    return decide(limited[1.0][0.5], "; ".join(sentences))


def _converging(on: Column, label: str, steering: Law) -> dict[float, dict[float, bool]]:
    """By tolerance (1 m, the column's) and guidance period: whether |r| is below in the last tenth of the flight."""
    duration, longest = (600.0, 20.0) if label == "SMC" else (80.0, 2.0)
    converged: dict[float, dict[float, bool]] = {1.0: {}, on.tolerance: {}}
    for period in (each for each in on.periods if each <= longest):
        length = period * round(duration / period)
        paper_flight = replace(flight("30", label), law=steering, guidance_period=period, step=_STEP, duration=length)
        if problems(on.change(paper_flight)):  # the column's measurements do not fit this period
            continue
        late = _late_error(on, paper_flight)
        for tolerance, each in converged.items():
            each[period] = late < tolerance
    return converged


def _late_error(on: Column, paper_flight: Flight) -> float:
    """The largest |r| in the last tenth of the flight, m."""
    try:
        return peak(on.sampled(paper_flight), 0.9 * paper_flight.duration)
    except EndedEarlyError:
        return math.inf


def _longest(converged: dict[float, bool]) -> str:
    """Up to which period it converges without a gap, and the longest at all."""
    periods = list(converged)
    gapless = list(converged.values()).index(False) if False in converged.values() else len(periods)
    longest = max((period for period, fine in converged.items() if fine), default=0.0)
    if not longest:
        return f"not at {_period(periods[0])}"
    if not gapless:
        return f"at some up to {_period(longest)}"
    through = periods[gapless - 1]
    return f"up to {_period(through)}" + (f" (with gaps {_period(longest)})" if longest > through else "")


def _period(seconds: float) -> str:
    return f"{1000.0 * seconds:.0f} ms" if seconds < 1.0 else f"{seconds:g} s"


def nftsm_sampling(on: Column) -> Decision:
    """NFTSM with the fitted gains."""
    return sampling(on, "NFTSM")


def nftsm_1_sampling(on: Column) -> Decision:
    """NFTSM_1."""
    return sampling(on, "NFTSM_1")


def printed_sampling(on: Column) -> Decision:
    """NFTSM with the gains of Table 2."""
    return sampling(on, "NFTSM as printed")


def smc_sampling(on: Column) -> Decision:
    """The traditional law."""
    return sampling(on, "SMC")
