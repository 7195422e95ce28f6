"""What is wrong with a flight beyond what each of its fields says of itself: rates, wind, target, airframe."""

import math
from pathlib import Path
from typing import NamedTuple

import aircraft
from harness.error import did_you_mean
from harness.flight import Flight, plant_of
from harness.plants.plant import PlantError
from harness.world.air import Air
from harness.world.target import Target
from harness.world.track import TrackError, load_track
from harness.world.wind import HIGHEST, LOWEST

MOST_PERIODS = 4_000_000  # of a flight: its log takes 2 GB
MOST_STEPS = 40_000_000  # of a flight: its gusts take 2 GB


class Problem(NamedTuple):
    """Something wrong with a value: the dotted name of the field, and what is wrong."""

    name: str
    message: str


def try_start(flight: Flight) -> None:
    """Puts the aircraft to its start in the steady wind. Raises `PlantError` when it cannot fly so."""
    plant_of(flight).start(flight.start, Air(steady=flight.wind.steady))


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
        known = aircraft.names()
        allowed = f"must be one of {', '.join(known)}, or a folder"
        raise ValueError(f"is {name[:60]!r}, {allowed}{did_you_mean(name, known)}") from None
    aircraft.limits(airframe)
    return airframe


def _aircraft_problems(flight: Flight) -> list[Problem]:
    try:
        airframe_of(flight.aircraft)
    except ValueError as error:
        return [Problem("aircraft", str(error))]
    try:
        plant_of(flight)
    except PlantError as error:
        return [Problem(error.key, str(error))]
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
