"""Feasibility: the heading rate needed to hold the circle, against its limit; and warnings before a flight."""

import math

import numpy as np
from numpy.typing import NDArray

import aircraft
from harness.flight import Flight, setup_of
from harness.plants.ladder import PLANTS
from harness.plants.turn import bank_of_turn
from harness.world.target import TargetState

Array = NDArray[np.float64]

_POINTS = 72  # points on the circle
_AT_ONCE = 1000  # rows computed at once


def target_states(flight: Flight) -> list[TargetState]:
    """The states of the target during the flight, at its breakpoints and twice a second; one state if it is at rest."""
    at = flight.target.start()
    if flight.target.track is None and not flight.target.speed and not flight.target.segments:
        return [at(0.0)]  # at rest
    times = {*flight.target.breakpoints(), *(0.5 * k for k in range(int(2 * flight.duration) + 1))}
    return [at(t) for t in times if 0.0 <= t <= flight.duration]


def relative_speed(flight: Flight) -> float:
    """The largest |wind - target velocity| of the flight, m/s, at the target's breakpoints and twice a second."""
    W_x, W_y = flight.wind.steady
    return max(math.hypot(W_x - s.target_velocity_north, W_y - s.target_velocity_east) for s in target_states(flight))


def is_outrun(flight: Flight) -> bool:
    """Whether the wind relative to the target reaches the airspeed.

    No law can circle such a target: in the headwind the aircraft makes no progress.
    """
    return relative_speed(flight) >= flight.start.airspeed * (1.0 - 1e-9)  # less is rounding


def needed_rate(flight: Flight) -> float:
    """The largest rate needed to hold the circle, rad/s, of the quantity that the law limits; infinite if none does."""
    velocities = {(s.target_velocity_north, s.target_velocity_east) for s in target_states(flight)}
    return float(needed_rates(flight, np.array(flight.wind.steady), np.array(sorted(velocities))).max())


def needed_rates(flight: Flight, wind: Array, target_velocity: Array) -> Array:
    """The largest rate needed to hold the circle in each of these winds and at each velocity of the target, m/s.

    Both have rows of (north, east), or one is a single pair. The rate is of the quantity that the law limits, rad/s,
    and infinite where no rate holds the circle. The heading rate is (v_a + w)^2 / (v_a R_d), with w the relative
    speed. The course rate needed is smaller: with a target at rest it is (v_a + w) / R_d.
    """
    v_a, R_d = flight.start.airspeed, flight.law.standoff
    wind, target_velocity = np.broadcast_arrays(np.atleast_2d(wind), np.atleast_2d(target_velocity))
    w = np.hypot(*(wind - target_velocity).T)
    rates = (v_a + w) ** 2 / (v_a * R_d)
    held = w < v_a * (1.0 - 1e-9)  # more is rounding
    if flight.law.command == "course_rate":
        for rows in np.array_split(np.flatnonzero(held), 1 + len(w) // _AT_ONCE):
            rates[rows] = _holding_course_rates(R_d, v_a, wind[rows], target_velocity[rows])
    return np.where(held, rates, np.inf)


def _holding_course_rates(R_d: float, v_a: float, wind: Array, target_velocity: Array) -> Array:
    """The largest course rate on the circle, by Eq. (3), (5), (7), of targets of steady velocity. Needs w < v_a."""
    (W_x, W_y), (w_x, w_y) = wind.T[..., np.newaxis], (wind - target_velocity).T[..., np.newaxis]
    lam = np.arctan2(w_y, w_x) + math.tau * np.arange(_POINTS) / _POINTS
    across = w_x * np.sin(lam) - w_y * np.cos(lam)
    towards = np.sqrt(v_a * v_a - across * across)  # v_a cos(bar psi_a^d)
    psi_a = lam + np.arcsin(across / v_a)
    along = v_a * (W_x * np.cos(psi_a) + W_y * np.sin(psi_a))
    ratio = (v_a * v_a + along) / (v_a * v_a + W_x * W_x + W_y * W_y + 2.0 * along)  # L(psi_a) of Eq. (3)
    rate = (towards + w_x * np.cos(lam) + w_y * np.sin(lam)) ** 2 / (towards * R_d) * ratio  # |lam_dot + psi_a_d_dot| L
    i, each = np.argmax(rate, axis=1), np.arange(len(rate))
    before, most, after = (rate[each, (i + k) % _POINTS] for k in (-1, 0, 1))
    bend = np.maximum(2.0 * most - before - after, 1e-300)
    return np.asarray(most + 0.125 * (after - before) ** 2 / bend)  # of the parabola through three points


def margins_in_flight(flight: Flight, wind: Array, target_velocity: Array) -> Array:
    """The limit minus the rate needed to hold the circle in each wind round each target, as `needed_rates`."""
    needed = needed_rates(flight, wind, target_velocity)
    least = np.full_like(needed, -np.inf)
    return np.subtract(flight.law.max_heading_rate, needed, out=least, where=np.isfinite(needed))


def feasibility_margin(flight: Flight) -> float:
    """The limit minus the rate needed to hold the circle, rad/s; negative if the circle cannot be held.

    Minus infinity where no rate holds it, even without a limit.
    """
    needed = needed_rate(flight)
    return flight.law.max_heading_rate - needed if math.isfinite(needed) else -math.inf


def feasibility_line(flight: Flight) -> str:
    """One line: whether the circle can be held, and by what margin."""
    if is_outrun(flight):
        return f"The circle is INFEASIBLE: {_outrun(flight)}."
    margin, needed = (math.degrees(rate) for rate in (feasibility_margin(flight), needed_rate(flight)))
    rate = flight.law.command.replace("_", " ")
    return (
        f"The circle is {'feasible' if margin >= 0 else 'INFEASIBLE'}: holding it requires a {rate} of up to "
        f"{needed:.2f} deg/s, the limit is {math.degrees(flight.law.max_heading_rate):g} deg/s "
        f"(margin {margin:+.2f} deg/s)."
    )


def warnings(flight: Flight, *, of_circle: bool = True) -> list[str]:
    """Warnings on the conditions of the flight, which can still be flown.

    With `of_circle` also that the circle is infeasible, which `feasibility_line` reports.
    """
    sentences = []
    v_a = flight.start.airspeed
    fastest = max(math.hypot(s.target_velocity_north, s.target_velocity_east) for s in target_states(flight))
    ratio = (fastest + math.hypot(*flight.wind.steady)) / v_a
    if ratio >= 1.0:
        sentences.append(
            f"Remark 1 requires v_t + v_w < v_a; here v_t + v_w is {ratio * v_a:.3g} m/s and v_a is {v_a:g} m/s"
        )
    if of_circle and is_outrun(flight):
        sentences.append(f"the circle is infeasible: {_outrun(flight)}")
    elif of_circle and feasibility_margin(flight) < 0:
        sentences.append("the circle is infeasible: holding it requires more than the heading-rate limit")
    if flight.wind.gusts and (gusty := _strongest_wind(flight)) >= v_a:
        sentences.append(f"wind and gusts reach {gusty:.3g} m/s, the airspeed is {v_a:g} m/s")
    estimator = flight.estimator
    if (estimator.lost_share or estimator.lost_for) and not estimator.filters:
        sentences.append(f'no measurement is lost: estimator.kind = "{estimator.kind}" needs none')
    plant = PLANTS[flight.plant]
    setup = setup_of(flight)
    sentences += plant.warnings(setup)
    if not plant.has_body:
        bodily = ", ".join(name for name, kind in PLANTS.items() if kind.has_body)
        sentences += [f"errors.{name} changes the plant {bodily} only" for name in flight.errors.of_aircraft]
    if plant.banks:
        limits = aircraft.limits(setup.airframe)
        if not limits.slowest <= v_a <= limits.fastest:
            envelope = f"{limits.slowest:g} to {limits.fastest:g} m/s"
            sentences.append(f"the airspeed, {v_a:g} m/s, is outside the airframe's envelope, {envelope}")
        needed = bank_of_turn(v_a, flight.law.max_heading_rate)
        if needed > limits.bank:
            sentences.append(
                f"the heading-rate limit needs {math.degrees(needed):.0f} deg of bank, the inner loop allows "
                f"{math.degrees(limits.bank):.0f} deg"
            )
    if broken := flight.law.broken_conditions(ratio):
        sentences.append(f"the law is flown outside its conditions: {'; '.join(broken)}")
    return sentences


def _outrun(flight: Flight) -> str:
    return (
        "it cannot be held at any heading rate, since the wind relative to the target reaches "
        f"{relative_speed(flight):.5g} m/s and the airspeed is {flight.start.airspeed:g} m/s"
    )


def _strongest_wind(flight: Flight) -> float:
    """The largest speed of steady wind and discrete gusts together, m/s."""
    wind = flight.wind
    times = np.concatenate([[0.0], *(np.linspace(gust.from_, gust.to, 101) for gust in wind.gusts)])
    times = times[times <= flight.duration]
    velocity = wind.gust(times) + np.array([*wind.steady, 0.0])
    return float(np.linalg.norm(velocity, axis=1).max())
