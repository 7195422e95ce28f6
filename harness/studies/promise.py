"""Do laws that know the inner loop keep the paper's promise? `python -m harness.studies.promise` writes promise.md.

`make promise` does it. Every condition states what it asks; the page says where that is met.
"""

import csv
import io
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import click
import numpy as np

import aircraft
from autopilot.estimator import Estimator
from autopilot.laws import LAWS, law
from harness.flight import Flight, context_of
from harness.flight_errors import Errors
from harness.log.metric import METRICS
from harness.loop import simulate
from harness.plants.ladder import BASELINE
from harness.plants.plant import Outcome, Start
from harness.settings.gains import by_rule
from harness.studies.command import counted, out_option, run, write
from harness.template import template
from harness.world.target import Target
from harness.world.wind import Wind

KNOWING = {"nftsm_lead": "by_lag", "lq_orbit": "by_airspeed"}  # law: its gains by rule
AIRFRAMES = tuple(aircraft.names())
SEEDS = (1, 2, 3)
ERROR, ACTIVITY, SETTLED, SATURATED = (
    "range_error_rms_m",
    "command_activity_deg_s2",
    "convergence_time_s",
    "saturation_fraction",
)
_PAPER = 13.0  # m/s: to it the speeds and lengths of a condition belong, and grow with the airspeed


class Bound(NamedTuple):
    """A metric may be at most `at_most`, or that many times the one of NFTSM on `kinematic` and `more`."""

    metric: str
    at_most: float
    law: str = ""  # for it alone
    of_kinematic: bool = False
    more: float = 0.0

    def allowed(self, kinematic: float) -> float:
        return self.at_most * kinematic + self.more if self.of_kinematic else self.at_most


@dataclass(frozen=True, kw_only=True)
class Situation:
    """What is flown, and what is asked. Speeds, m/s, are those at 13 m/s, and grow with the airspeed."""

    name: str
    bounds: tuple[Bound, ...]
    plant: str = "sixdof"
    wind: float = 0.0  # of the airspeed
    turbulence: str = "none"
    limit: float = 8.0  # deg/s
    target: float = 0.0  # its speed; the wind is then 3 m/s
    period: float = 0.05
    duration: float = 200.0
    errors: Errors = field(default_factory=Errors)
    estimator: Estimator = field(default_factory=Estimator)
    airspeed: str = "ground"
    modelled: bool = False  # the law predicts though the plant answers at once

    @property
    def seeds(self) -> tuple[int, ...]:
        return SEEDS if self.turbulence != "none" or self.estimator.filters else SEEDS[:1]

    def flight(self, name: str, gains: str, airframe: str, seed: int) -> Flight:
        """The flight of a law with these gains, a set or a rule."""
        airspeed = aircraft.limits(aircraft.folder(airframe)).design_airspeed
        scale = airspeed / _PAPER
        steady = 3.0 * scale if self.target else self.wind * airspeed
        kind = LAWS[name]
        base = kind.rules[gains].base if gains in kind.rules else gains
        limit = math.radians(self.limit)
        own: Any = law(name, base, standoff=200.0 * scale, max_heading_rate=limit, airspeed=self.airspeed)
        flight = Flight(
            plant=self.plant,
            law=replace(own, gains=gains),
            aircraft=airframe,
            duration=self.duration,
            guidance_period=self.period,
            seed=seed,
            start=Start(position=(-200.0 * scale, 200.0 * scale), airspeed=airspeed),
            target=Target(position=(10.0 * scale, 10.0 * scale), speed=self.target * scale, heading=math.radians(45.0)),
            wind=Wind(steady=(steady, 0.0), turbulence=self.turbulence),
            estimator=self.estimator,
            errors=self.errors,
        )
        return by_rule(flight, ())


def _calm(error: float, *more: Bound) -> tuple[Bound, ...]:
    return Bound(ERROR, error), Bound(SATURATED, 0.0), *more


_AS_KINEMATIC = Bound(ACTIVITY, 1.1, of_kinematic=True, more=0.02)
_STILL = Bound(ACTIVITY, 0.05)
CONDITIONS = (
    Situation(
        name="still air",
        bounds=_calm(
            0.001,
            _STILL,
            Bound(SETTLED, 1.0, "nftsm_lead", of_kinematic=True),
            Bound(SETTLED, 20.0, "lq_orbit"),
        ),
    ),
    Situation(name="wind of 30 %", wind=0.3, bounds=_calm(0.005, _AS_KINEMATIC)),
    Situation(name="wind of 60 %", wind=0.6, limit=15.0, bounds=_calm(0.015, _AS_KINEMATIC)),
    Situation(name="target at 2 m/s, wind of 3 m/s", target=2.0, bounds=_calm(0.005)),
    Situation(
        name="response told half as quick",
        errors=Errors(response_speed=0.5),
        bounds=(Bound(ERROR, 0.015), Bound(ACTIVITY, 0.6)),
    ),
    Situation(
        name="response told twice as quick",
        errors=Errors(response_speed=2.0),
        bounds=(Bound(ERROR, 0.015), Bound(ACTIVITY, 0.6)),
    ),
    Situation(
        name="100 ms of delay",
        errors=Errors(command_delay=0.1),
        bounds=(Bound(ERROR, 0.01), Bound(ACTIVITY, 0.1)),
    ),
    Situation(
        name="wind of 60 %, its estimate wrong by 1 m/s",
        wind=0.6,
        limit=15.0,
        errors=Errors(wind=1.0, wind_heading=math.radians(45.0)),
        bounds=(Bound(ERROR, 0.05),),
    ),
    Situation(name="guidance every 0.1 s", period=0.1, bounds=(Bound(ACTIVITY, 0.15),)),
    Situation(name="kinematic, predicted all the same", plant=BASELINE, modelled=True, bounds=(Bound(ACTIVITY, 0.01),)),
    Situation(
        name="moderate turbulence",
        turbulence="moderate",
        duration=150.0,
        bounds=(
            Bound(ERROR, 0.12, "nftsm_lead"),
            Bound(ACTIVITY, 8.5, "nftsm_lead"),
            Bound(ERROR, 0.15, "lq_orbit"),
            Bound(ACTIVITY, 5.5, "lq_orbit"),
        ),
    ),
    Situation(
        name="moderate, response told half as quick",
        turbulence="moderate",
        duration=150.0,
        errors=Errors(response_speed=0.5),
        bounds=(Bound(ERROR, 0.40, "nftsm_lead"), Bound(ERROR, 0.22, "lq_orbit")),
    ),
    Situation(
        name="moderate, response told twice as quick",
        turbulence="moderate",
        duration=150.0,
        errors=Errors(response_speed=2.0),
        bounds=(Bound(ERROR, 0.40, "nftsm_lead"), Bound(ERROR, 0.22, "lq_orbit")),
    ),
    Situation(
        name="wind of 60 %, moderate turbulence",
        wind=0.6,
        limit=15.0,
        turbulence="moderate",
        duration=150.0,
        bounds=(Bound(ERROR, 0.22),),
    ),
    Situation(name="severe turbulence", turbulence="severe", duration=150.0, bounds=(Bound(ERROR, 0.35),)),
)


class Asked(NamedTuple):
    """One law in one condition: per airframe the means over the seeds of what is bounded, and whether it is allowed."""

    condition: str
    law: str
    metric: str
    values: Mapping[str, float]  # by airframe; NaN where a flight was lost or did not converge
    allowed: Mapping[str, float]

    @property
    def is_met(self) -> bool:
        return all(self.values[airframe] <= self.allowed[airframe] for airframe in self.values)

    @property
    def at_most(self) -> str:
        """What is allowed, once where it is the same for all airframes."""
        return ", ".join(dict.fromkeys(number(value) for value in self.allowed.values()))

    @property
    def heading(self) -> str:
        """The metric's heading and unit."""
        return f"{METRICS[self.metric].heading}, {METRICS[self.metric].label}"


def means(condition: Situation, name: str, gains: str, airframe: str, times: float = 1.0) -> Mapping[str, float]:
    """Over the seeds, of all metrics that a bound may ask for, with so many times k2 and k3; NaN where one has none."""
    every = []
    for seed in condition.seeds:
        flight = condition.flight(name, gains, airframe, seed)
        if times != 1.0:
            own: Any = flight.law
            flight = replace(flight, law=replace(own, k2=times * own.k2, k3=times * own.k3))
        every.append(measured(condition, flight))
    return {metric: float(np.mean([one[metric] for one in every])) for metric in every[0]}


def measured(condition: Situation, flight: Flight) -> Mapping[str, float]:
    """The metrics of one flight; all NaN of one that did not last."""
    context = context_of(flight)._replace(at_once=False) if condition.modelled else None
    log = simulate(flight, context=context)
    found = log.metrics if log.outcome is Outcome.COMPLETED else {}
    return {
        metric: math.nan if (value := found.get(metric)) is None else float(value)
        for metric in (ERROR, ACTIVITY, SETTLED, SATURATED)
    }


def lines(conditions: Sequence[Situation] = CONDITIONS, airframes: Sequence[str] = AIRFRAMES) -> Iterator[Asked]:
    """Every bound of every condition, for each law that it binds."""
    for condition in conditions:
        beside = {}
        if any(bound.of_kinematic for bound in condition.bounds):
            on_kinematic = replace(condition, plant=BASELINE)
            beside = {airframe: means(on_kinematic, "nftsm", "fitted", airframe) for airframe in airframes}
        for name, gains in KNOWING.items():
            found = {airframe: means(condition, name, gains, airframe) for airframe in airframes}
            for bound in condition.bounds:
                if bound.law in ("", name):
                    yield Asked(
                        condition.name,
                        name,
                        bound.metric,
                        {airframe: found[airframe][bound.metric] for airframe in airframes},
                        {
                            airframe: bound.allowed(beside[airframe][bound.metric] if beside else math.nan)
                            for airframe in airframes
                        },
                    )


class Beside(NamedTuple):
    """What another law or setting does where those of the table do well: means over the seeds, by airframe."""

    what: str
    error: Mapping[str, float]
    activity: Mapping[str, float]


def beside(airframes: Sequence[str] = AIRFRAMES) -> Iterator[Beside]:
    """The counterparts: the paper's law near its border, the nominal airspeed, a higher limit, and the filter."""
    delay = next(condition for condition in CONDITIONS if condition.errors.command_delay)
    gusty = next(condition for condition in CONDITIONS if condition.wind and condition.turbulence != "none")
    moderate = next(condition for condition in CONDITIONS if condition.name == "moderate turbulence")
    filtered = replace(moderate, turbulence="none", estimator=Estimator(kind="ekf"))
    nominal, wide = replace(gusty, airspeed="nominal"), replace(moderate, limit=20.0)
    still = replace(delay, errors=Errors())
    beyond = {
        "200 ms of delay": replace(still, errors=Errors(command_delay=0.2)),
        "100 ms of delay, response told 1.6 times as quick": replace(
            still, errors=Errors(command_delay=0.1, response_speed=1.6)
        ),
        "course with 0.3 ° of noise": replace(still, errors=Errors(course_noise=math.radians(0.3))),
    }
    near = 0.95 / 0.5  # the rule `behind_inner_loop` is half of the border
    flown = [
        ("`nftsm` at 0.95 of its border, 100 ms of delay", delay, "nftsm", "behind_inner_loop", near),
        *((f"`{name}`, {gusty.name}, nominal airspeed", nominal, name, rule, 1.0) for name, rule in KNOWING.items()),
        *((f"`{name}`, {moderate.name}, limit 20 °/s", wide, name, rule, 1.0) for name, rule in KNOWING.items()),
        *(
            (f"`{name}`, still air, target through the filter", filtered, name, gains, 1.0)
            for name, gains in {"nftsm": "fitted", "smc": "paper", **KNOWING}.items()
        ),
        *(
            (f"`{name}`, {what}", condition, name, gains, 1.0)
            for what, condition in beyond.items()
            for name, gains in {"nftsm": "behind_inner_loop", **KNOWING}.items()
        ),
    ]
    for what, condition, name, gains, times in flown:
        found = {airframe: means(condition, name, gains, airframe, times) for airframe in airframes}
        error, activity = ({a: found[a][metric] for a in airframes} for metric in (ERROR, ACTIVITY))
        yield Beside(what, error, activity)


def page(found: Sequence[Asked], others: Sequence[Beside]) -> str:
    """The page."""
    shown = template("harness.studies", "promise.md.jinja").render(
        lines=found, others=others, airframes=AIRFRAMES, number=number, seeds=SEEDS
    )
    return shown + "\n"


def number(value: float) -> str:
    """Three digits, small values as a bound."""
    return "none" if math.isnan(value) else "< 1e-6" if 0.0 < value < 1e-6 else f"{value:.3g}"


def table(found: Sequence[Asked]) -> str:
    """Every bound, a line each, as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(
        ("condition", "law", "metric", "met", *AIRFRAMES, *(f"{airframe}: allowed" for airframe in AIRFRAMES))
    )
    for line in found:
        cells = [f"{each[airframe]:.4g}" for each in (line.values, line.allowed) for airframe in AIRFRAMES]
        writer.writerow((line.condition, line.law, line.metric, line.is_met, *cells))
    return text.getvalue()


@click.command()
@out_option
def main(out: Path) -> None:
    """Fly the conditions, and write OUT/promise.md with its table. Takes two minutes."""
    total = sum(sum(bound.law in ("", name) for bound in one.bounds) for one in CONDITIONS for name in KNOWING)
    found = list(counted(lines(), total, "flying the conditions"))
    write(out, {"promise.md": page(found, list(beside())), "promise.csv": table(found)})


if __name__ == "__main__":
    run(main, "harness.studies.promise")
