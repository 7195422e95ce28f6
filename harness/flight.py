"""A flight as a value: everything that decides it, and what is wrong or remarkable about that."""

import math
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

from annotated_types import Ge, Gt, Le

import aircraft
from autopilot.estimator import Estimator
from autopilot.guidance import Law
from autopilot.quantities import About, Metres, Seconds
from autopilot.standoff import holding_course_rate
from harness.air import Air
from harness.plant import Plant, Start
from harness.plants.kinematic import Kinematic
from harness.target import Target, TargetState
from harness.track import TrackError, load_track
from harness.wind import HIGHEST, LOWEST, Wind

IDENTIFIED_PLANTS = ("lagged", "coordinated")  # they fly by what `harness identify` left beside the airframe
MOST_PERIODS = 4_000_000  # of a flight: its log takes 2 GB
MOST_STEPS = 40_000_000  # of a flight: its gusts take 2 GB


@dataclass(frozen=True, slots=True, kw_only=True)
class InnerLoop:
    """Settings of the 6-DOF plant's inner loop."""

    rate_trim: Annotated[bool, About("slow integrator that removes the turn-rate shortfall of a bank-only turn")] = True


@dataclass(frozen=True, slots=True, kw_only=True)
class MetricSettings:
    """What counts as converged, and as lost."""

    tolerance: Annotated[Metres, Gt(0), About("|range error| below it for good is convergence")] = 1.0
    monitoring_range: Annotated[Metres | None, Gt(0), About("beyond it the target is lost")] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Flight:
    """One flight. Defaults are the paper's stationary case (Table 1)."""

    plant: Annotated[
        Literal["kinematic", "lagged", "coordinated", "sixdof"], About("everything below the heading-rate command")
    ]
    law: Law
    aircraft: Annotated[str, About("an airframe by name, or its folder")] = "ultra_stick_25e"
    duration: Annotated[Seconds, Gt(0), Le(1e6), About("length of the flight")] = 100.0
    guidance_period: Annotated[Seconds, Gt(0), Le(1e3), About("the law's command is held in between")] = 0.05
    step: Annotated[
        Seconds, Ge(1e-5), Le(0.05), About("of the 6-DOF simulation; periods are whole multiples of it")
    ] = 0.005
    seed: Annotated[int, Ge(0), Le(10**15), About("of everything random")] = 0
    start: Start = field(default_factory=Start)
    target: Target = field(default_factory=Target)
    wind: Wind = field(default_factory=Wind)
    estimator: Estimator = field(default_factory=Estimator)
    inner_loop: InnerLoop = field(default_factory=InnerLoop)
    metrics: MetricSettings = field(default_factory=MetricSettings)

    @property
    def periods(self) -> int:
        """The number of guidance periods in the flight."""
        return round(self.duration / self.guidance_period)


class Problem(NamedTuple):
    """Something wrong with a value: the dotted name of the field, and what is wrong."""

    name: str
    message: str


def plant_of(flight: Flight) -> Plant:
    """The plant that the flight names."""
    if flight.plant == "kinematic":
        return Kinematic()
    airframe = aircraft.folder(flight.aircraft)
    if flight.plant == "sixdof":
        from harness.plants.sixdof import SixDof  # JSBSim is loaded by those who fly it

        return SixDof(airframe, flight.step, flight.inner_loop.rate_trim)
    from harness.plants.identified import identified  # and so is scipy

    one = identified(airframe, flight.start.airspeed)
    return one.lagged if flight.plant == "lagged" else one.coordinated


def try_start(flight: Flight) -> None:
    """Puts the aircraft to its start in the steady wind. Raises `PlantError` when it cannot fly so."""
    plant_of(flight).start(flight.start, Air(steady=flight.wind.steady))


def air_of(flight: Flight) -> Air:
    """The air that the flight meets: the same for every plant, law and guidance period."""
    return flight.wind.start(
        airspeed=flight.start.airspeed,
        altitude=flight.start.altitude,
        step=flight.step,
        duration=flight.duration,
        seed=flight.seed,
    )


def problems(flight: Flight) -> list[Problem]:
    """What makes the flight impossible as it is set, beyond what each field says of itself; empty when it can start."""
    found = []
    for name, period, unit_name, unit in (
        ("guidance_period", flight.guidance_period, "step_s", flight.step),
        ("duration", flight.duration, "guidance_period_s", flight.guidance_period),
    ):
        if not _is_multiple(period, unit):
            found.append(Problem(name, f"{period:g} s is no whole multiple of {unit_name}, {unit:g} s"))
            break
    for what, period, most in (
        ("guidance periods", flight.guidance_period, MOST_PERIODS),
        ("steps", flight.step, MOST_STEPS),
    ):
        if not found and flight.duration / period > most:
            many = f"takes {flight.duration / period:.3g} {what} of {period:g} s, must be {most:g} at most"
            found.append(Problem("duration", many))
    sample, guidance = flight.estimator.period, flight.guidance_period
    if flight.estimator.kind == "ekf":
        if not _is_multiple(sample, flight.step):
            found.append(Problem("estimator.period", f"{sample:g} s is no whole multiple of step_s, {flight.step:g} s"))
        elif not (_is_multiple(sample, guidance) or _is_multiple(guidance, sample)):
            neither = f"{sample:g} s is neither a whole multiple nor a whole part of guidance_period_s, {guidance:g} s"
            found.append(Problem("estimator.period", neither))
    speed = math.hypot(*flight.wind.steady)
    if speed >= flight.start.airspeed:
        found.append(
            Problem("wind.steady", f"wind of {speed:g} m/s, must be below the airspeed, {flight.start.airspeed:g} m/s")
        )
    found += [
        Problem(f"wind.gusts.{i}.to", f"{gust.to:g} s, must be after from_s, {gust.from_:g} s")
        for i, gust in enumerate(flight.wind.gusts)
        if gust.to <= gust.from_
    ]
    altitude = flight.start.altitude
    if flight.wind.turbulence != "none" and not LOWEST <= altitude <= HIGHEST:
        holds = f"the low-altitude model holds from {LOWEST:g} to {HIGHEST:g} m; the flight starts at {altitude:g} m"
        found.append(Problem("wind.turbulence", holds))
    found += _target_problems(flight)
    found += _aircraft_problems(flight)
    return found


def airframe_of(name: str) -> Path:
    """The folder of a sound airframe, by its name or itself. Raises ValueError with what is wrong and allowed."""
    try:
        airframe = aircraft.folder(name)
    except (OSError, ValueError):  # no folder, or no path at all
        if aircraft.is_folder(name):
            must = f"{name}: the folder must hold airframe.toml and a JSBSim model, {Path(name).name}.xml"
            raise ValueError(must) from None
        near = get_close_matches(name, aircraft.names(), n=1)
        hint = f" - did you mean {near[0]!r}?" if near else ""
        allowed = ", ".join(aircraft.names())
        raise ValueError(f"is {name[:60]!r}, must be one of {allowed}, or a folder{hint}") from None
    aircraft.limits(airframe)
    return airframe


def _aircraft_problems(flight: Flight) -> list[Problem]:
    try:
        airframe = airframe_of(flight.aircraft)
    except ValueError as error:
        return [Problem("aircraft", str(error))]
    if flight.plant in IDENTIFIED_PLANTS:
        from harness.plants.identified import IdentifiedError, identified

        try:
            identified(airframe, flight.start.airspeed)
        except IdentifiedError as error:
            return [Problem("start.airspeed", str(error))]
    return []


def _target_problems(flight: Flight) -> list[Problem]:
    target = flight.target
    if target.track is not None:
        default = Target()
        found = [
            Problem(f"target.{name}", "is set beside a track, which alone says where the target is: leave it out")
            for name in ("position", "speed", "heading", "segments")
            if getattr(target, name) != getattr(default, name)
        ]
        try:
            end = load_track(Path(target.track)).end
        except TrackError as error:
            return [*found, Problem("target.track", str(error))]
        if flight.duration > end * (1.0 + 1e-9):
            ends = f"{target.track} ends at {end:g} s, must last as long as duration_s, {flight.duration:g} s"
            found.append(Problem("target.track", ends))
        return found
    found = [
        Problem(f"target.segments.{i}.to", f"{segment.to:g} s, must be after from_s, {segment.from_:g} s")
        for i, segment in enumerate(target.segments)
        if segment.to <= segment.from_
    ]
    slowest = min(leg.speed for leg in target.legs())
    if slowest < -1e-9:
        found.append(Problem("target.segments", f"slow the target down to {slowest:g} m/s, must stay at or above 0"))
    return found


def _is_multiple(period: float, unit: float) -> bool:
    return round(period / unit) >= 1 and math.isclose(round(period / unit) * unit, period, rel_tol=1e-9)


def _target_states(flight: Flight) -> list[TargetState]:
    """The target during the flight, at its breakpoints and twice a second."""
    at = flight.target.start()
    if flight.target.track is None and not flight.target.speed and not flight.target.segments:
        return [at(0.0)]  # at rest
    times = {*flight.target.breakpoints(), *(0.5 * k for k in range(int(2 * flight.duration) + 1))}
    return [at(t) for t in times if 0.0 <= t <= flight.duration]


def relative_speed(flight: Flight) -> float:
    """The largest |wind - target velocity| of the flight, m/s, at the target's breakpoints and twice a second."""
    W_x, W_y = flight.wind.steady
    return max(math.hypot(W_x - s.target_velocity_north, W_y - s.target_velocity_east) for s in _target_states(flight))


def needed_rate(flight: Flight) -> float:
    """The largest rate that holding the circle takes of what the law limits, rad/s.

    Heading rate: (v_a + w)^2 / (v_a R_d). Course rate, which a tail wind raises less: (v_a + w) / R_d at rest.
    """
    v_a = flight.start.airspeed
    if flight.law.command == "course_rate":
        velocities = {(s.target_velocity_north, s.target_velocity_east) for s in _target_states(flight)}
        return max(holding_course_rate(flight.law.standoff, v_a, *flight.wind.steady, *v) for v in velocities)
    return (v_a + relative_speed(flight)) ** 2 / (v_a * flight.law.standoff)


def feasibility_margin(flight: Flight) -> float:
    """The limit minus what holding the circle takes, rad/s; negative: the circle cannot be held."""
    return flight.law.max_heading_rate - needed_rate(flight)


def feasibility_line(flight: Flight) -> str:
    """Whether the circle can be held, and by what margin."""
    margin, needed = (math.degrees(rate) for rate in (feasibility_margin(flight), needed_rate(flight)))
    of = " of course" if flight.law.command == "course_rate" else ""
    verdict = "feasible" if margin >= 0 else "INFEASIBLE"
    return (
        f"circle {verdict}: holding it takes up to {needed:.2f} deg/s{of}, "
        f"the limit is {math.degrees(flight.law.max_heading_rate):g} deg/s (margin {margin:+.2f})"
    )


def warnings(flight: Flight) -> list[str]:
    """What the user should know before trusting the flight; it is flown all the same."""
    said = []
    v_a = flight.start.airspeed
    fastest = max(math.hypot(s.target_velocity_north, s.target_velocity_east) for s in _target_states(flight))
    ratio = (fastest + math.hypot(*flight.wind.steady)) / v_a
    if ratio >= 1.0:
        said.append(f"Remark 1 asks for v_t + v_w < v_a; here it is {ratio * v_a:.3g} m/s of {v_a:g} m/s")
    if feasibility_margin(flight) < 0:
        said.append("the circle is infeasible: the limit is below what holding it takes")
    airframe = aircraft.folder(flight.aircraft)
    if flight.plant in IDENTIFIED_PLANTS:
        from harness.plants.identified import is_stale

        if is_stale(airframe):
            said.append(f"{airframe.name} has changed since it was identified: run harness identify {flight.aircraft}")
        if not flight.inner_loop.rate_trim:
            said.append(f"rate_trim = false changes sixdof only: {flight.plant} has no shortfall to leave")
    if flight.plant in ("coordinated", "sixdof"):
        limits = aircraft.limits(airframe)
        if not limits.slowest <= v_a <= limits.fastest:
            envelope = f"{limits.slowest:g} to {limits.fastest:g} m/s"
            said.append(f"{v_a:g} m/s is outside the airframe's envelope, {envelope}")
        needed = math.atan(v_a * flight.law.max_heading_rate / 9.80665)
        if needed > limits.bank:
            said.append(
                f"the heading-rate limit takes {math.degrees(needed):.0f} deg of bank, the inner loop allows "
                f"{math.degrees(limits.bank):.0f}"
            )
    return said + flight.law.broken_conditions(ratio)
