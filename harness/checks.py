"""Checks of a flight that involve more than one field: time steps, wind, target, airframe."""

import math
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import aircraft
from harness.child import MEMORY, ChildError, limited
from harness.error import did_you_mean
from harness.flight import Flight, plant_of
from harness.plants.ladder import PLANTS
from harness.plants.plant import Plant, PlantError, Start
from harness.toml_text import shown
from harness.world.air import Air
from harness.world.target import Target
from harness.world.track import TrackError, load_track
from harness.world.wind import HIGHEST, LOWEST

_START_WITHIN = 15.0  # s: time limit of the trial of a start, which takes milliseconds
MOST_PERIODS = 4_000_000  # guidance periods of a flight: its log then takes 2 GB
MOST_STEPS = 40_000_000  # steps of a flight: its gusts then take 2 GB


class Problem(NamedTuple):
    """A mistake in a flight: the dotted name of the field, and what is wrong with its value."""

    name: str
    message: str
    others: tuple[str, ...] = ()  # the other fields that make it one


_OF_PLANT = ("plant", "aircraft", "step", "start.airspeed", "inner_loop.rate_trim", "errors")


def start_problems(flight: Flight) -> list[Problem]:
    """Why the flight cannot start, which is tried in the steady wind. Airframe mistakes are reported by `problems`.

    A third-party model may crash the process that loads it, so this is tried in a child process.
    """
    if list(_airframe_problems(flight)):
        return []
    plant, start, wind = plant_of(flight), flight.start, flight.wind.steady
    if (model := model_of_another(flight)) is None:
        problem = _cannot_start(plant, start, wind)
    else:
        problem = _cannot_start_apart(plant, start, wind, model, _changed(model))
    return [Problem(*problem, (*_OF_PLANT, "start.altitude", "wind.steady"))] if problem else []


def model_of_another(flight: Flight) -> Path | None:
    """The third-party JSBSim model of the flight, which may crash or hang; None for the harness's own airframes.

    Raises FileNotFoundError for an unknown airframe.
    """
    if not PLANTS[flight.plant].has_body or flight.aircraft in aircraft.names():
        return None
    return aircraft.model(aircraft.folder(flight.aircraft))


def _changed(file: Path) -> float:
    """When the file was changed, s."""
    return file.stat().st_mtime if file.exists() else math.nan


def _cannot_start(plant: Plant, start: Start, wind: tuple[float, float]) -> tuple[str, str] | None:
    """The setting to change, and why."""
    try:
        plant.start(start, Air(steady=wind))
    except PlantError as error:
        return error.key, str(error)
    return None


@lru_cache(maxsize=4096)  # flights of a matrix share their start
def _cannot_start_apart(
    plant: Plant, start: Start, wind: tuple[float, float], model: Path, changed: float
) -> tuple[str, str] | None:
    from harness.plants.model import ModelError, parsed  # imported when used: only this plant needs JSBSim

    try:
        parsed(model)
        return limited("the start of the model", _START_WITHIN, MEMORY, _cannot_start, plant, start, wind)
    except (ModelError, ChildError) as error:
        return "aircraft", str(error)


def problems(flight: Flight) -> list[Problem]:
    """All mistakes that involve more than one field; empty for a flight that can be simulated."""
    return [
        *_period_problems(flight),
        *_estimator_problems(flight),
        *_error_problems(flight),
        *_wind_problems(flight),
        *_target_problems(flight),
        *_airframe_problems(flight),
    ]


def _period_problems(flight: Flight) -> Iterator[Problem]:
    """Mistakes of step, guidance period and duration: each must be a multiple of the one before, and not too long."""
    step, period, duration = flight.step, flight.guidance_period, flight.duration
    if not _is_multiple(period, step):
        yield Problem("guidance_period", _no_multiple(period, "step_s", step), ("step",))
        return
    if not _is_multiple(duration, period):
        yield Problem("duration", _no_multiple(duration, "guidance_period_s", period), ("guidance_period",))
        return
    for what, field, length, most in (
        ("guidance periods", "guidance_period", period, MOST_PERIODS),
        ("steps", "step", step, MOST_STEPS),
    ):
        if duration / length > most:
            many = f"takes {duration / length:.3g} {what} of {length:g} s, must be {most:g} at most"
            yield Problem("duration", many, (field,))
            return


def _estimator_problems(flight: Flight) -> Iterator[Problem]:
    sample, guidance, step = flight.estimator.period, flight.guidance_period, flight.step
    if not flight.estimator.filters:
        return
    if not _is_multiple(sample, step):
        yield Problem("estimator.period", _no_multiple(sample, "step_s", step), ("estimator.kind", "step"))
    elif not (_is_multiple(sample, guidance) or _is_multiple(guidance, sample)):
        neither = f"{sample:g} s is neither a whole multiple nor a whole fraction of guidance_period_s, {guidance:g} s"
        yield Problem("estimator.period", neither, ("estimator.kind", "guidance_period"))


def _error_problems(flight: Flight) -> Iterator[Problem]:
    delay, lag, step = flight.errors.command_delay, flight.errors.actuator_lag, flight.step
    if delay and not _is_multiple(delay, step):
        yield Problem("errors.command_delay", _no_multiple(delay, "step_s", step), ("step",))
    if 0.0 < lag < 0.5 * step:
        quick = f"{lag:g} s is too short for steps of {step:g} s: 0 or half a step"
        yield Problem("errors.actuator_lag", quick, ("step",))


def _wind_problems(flight: Flight) -> Iterator[Problem]:
    wind, airspeed, altitude = flight.wind, flight.start.airspeed, flight.start.altitude
    speed = math.hypot(*wind.steady)
    if speed >= airspeed:
        strong = f"wind of {speed:g} m/s, must be below the airspeed, {airspeed:g} m/s"
        yield Problem("wind.steady", strong, ("start.airspeed",))
    for i, gust in enumerate(wind.gusts):
        if gust.to <= gust.from_:
            yield Problem(f"wind.gusts.{i}.to", f"{gust.to:g} s, must be after from_s, {gust.from_:g} s")
    if wind.turbulence != "none" and not LOWEST <= altitude <= HIGHEST:
        holds = f"the low-altitude model holds from {LOWEST:g} to {HIGHEST:g} m; the flight starts at {altitude:g} m"
        yield Problem("wind.turbulence", holds, ("start.altitude",))


def airframe_of(name: str) -> Path:
    """The folder of an airframe with valid files, by name or path. Raises ValueError with what is wrong and allowed."""
    try:
        airframe = aircraft.folder(name)
    except (OSError, ValueError):  # not an airframe, or not even a path
        if aircraft.is_folder(name):
            must = f"{name}: the folder must hold airframe.toml and a JSBSim model, {Path(name).name}.xml"
            raise ValueError(must) from None
        if name.endswith(".toml"):
            raise ValueError(f"{name}: there is no such file") from None
        known = aircraft.names()
        allowed = f"must be one of {', '.join(known)}, a folder, or a file of harness assess --fit"
        raise ValueError(f"is {shown(name)}, {allowed}{did_you_mean(name, known)}") from None
    aircraft.limits(airframe)
    if aircraft.is_stale(airframe):
        model, again = aircraft.model(airframe).name, f"python -m aircraft.write_models {aircraft.argument(airframe)}"
        anew = "run `harness adopt` again, or" if aircraft.adopted(airframe) else f"run `{again}`, or"
        raise ValueError(
            f"{airframe}: {model} was not written from airframe.toml and inner_loop.toml as they are: {anew} "
            f"`{again} --keep` to fly {model} as it is"
        )
    return airframe


def _airframe_problems(flight: Flight) -> Iterator[Problem]:
    try:
        airframe_of(flight.aircraft)
    except ValueError as error:
        yield Problem("aircraft", str(error))
        return
    try:
        plant_of(flight)
    except PlantError as error:
        yield Problem(error.key, str(error), _OF_PLANT)


def _target_problems(flight: Flight) -> Iterator[Problem]:
    target = flight.target
    if target.track is not None:
        yield from _track_problems(flight, Path(target.track))
        return
    for i, segment in enumerate(target.segments):
        if segment.to <= segment.from_:
            yield Problem(f"target.segments.{i}.to", f"{segment.to:g} s, must be after from_s, {segment.from_:g} s")
    slowest = min(leg.speed for leg in target.legs())
    if slowest < -1e-9:
        slow = f"slow the target down to {slowest:g} m/s, must keep its speed at or above 0"
        yield Problem("target.segments", slow, ("target.speed",))


def _track_problems(flight: Flight, track: Path) -> Iterator[Problem]:
    default = Target()
    for name in ("position", "speed", "heading", "segments"):
        if getattr(flight.target, name) != getattr(default, name):
            beside = "is set beside a track, which alone defines the motion of the target: leave it out"
            yield Problem(f"target.{name}", beside)
    try:
        end = load_track(track).end
    except TrackError as error:
        yield Problem("target.track", str(error))
        return
    if flight.duration > end * (1.0 + 1e-9):
        ends = f"{flight.target.track} ends at {end:g} s, must last as long as duration_s, {flight.duration:g} s"
        yield Problem("target.track", ends, ("duration",))


def _no_multiple(period: float, unit_name: str, unit: float) -> str:
    return f"{period:g} s is not a whole multiple of {unit_name}, {unit:g} s"


def _is_multiple(period: float, unit: float) -> bool:
    times = period / unit
    return math.isfinite(times) and round(times) >= 1 and math.isclose(round(times) * unit, period, rel_tol=1e-9)
