"""The columns of the ledgers: on which aircraft, and in what condition, the paper's experiments are flown."""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np

import aircraft
from autopilot.guidance import Law
from autopilot.laws import LAWS as KINDS
from autopilot.nftsm import Nftsm
from autopilot.smc import Smc
from harness.flight import Flight
from harness.log.metric import measure
from harness.loop import simulate
from harness.plants.turn import bank_of_turn, rate_of_turn
from harness.studies.paper.experiments import EKF, LAWS, Reading, Trace, ending, flight, flown

PAPERS_AIRSPEED = 13.0  # m/s, Table 1
HELD = 0.05  # s, for which a command is held on an airframe unless a claim is about that time

_STEP = 0.005  # s
_LONG = tuple(0.5 * n for n in range(2, 41))
EVERY_PERIOD = (*(n * _STEP for n in range(1, 101)), *_LONG)  # s, tried by claims about sampling
SOME_PERIODS = (0.005, 0.01, 0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5)


class EndedEarlyError(Exception):
    """A flight ended before its time: on the ground, departed. That is a result."""


class FlightFailedError(Exception):
    """A flight has no result: its numbers are not finite, or its law raised an error."""


class Column(NamedTuple):
    """What flies the claims' experiments: a column of a ledger.

    Claims speak in the paper's size. An aircraft of another airspeed flies the similar experiment, all its lengths and
    speeds larger by `scale` and its times and rates the same, and what it flew is told in the paper's size again.
    """

    name: str
    about: str
    change: Callable[[Flight], Flight]  # of the paper's flight, in the paper's size
    tolerance: float  # m: nearer than this counts as converged
    aircraft: str = ""  # the airframe on the 6-DOF plant; without one the kinematic aircraft
    scale: float = 1.0
    period: float | None = None  # s, for which a command is held; None: as the experiment's reading has it
    periods: tuple[float, ...] = EVERY_PERIOD  # s, tried by claims about sampling

    def real(self, paper_flight: Flight) -> Flight:
        """The flight as it is flown here."""
        paper_flight = scaled(self.change(paper_flight), self.scale)
        return replace(paper_flight, plant="sixdof", aircraft=self.aircraft) if self.aircraft else paper_flight

    def held(self, paper_flight: Flight) -> Flight:
        """The flight with its command held as long as it is here."""
        return paper_flight if self.period is None else replace(paper_flight, guidance_period=self.period, step=_STEP)

    def sampled(self, paper_flight: Flight) -> Trace:
        """That flight here, its command held as long as it says. Raises `EndedEarlyError`."""
        trace = flown(self.real(paper_flight))
        if trace.ended:
            raise early(paper_flight, trace.ended, trace.failed)
        return trace if self.scale == 1.0 else _in_papers_size(trace, self.change(paper_flight), self.scale)

    def measured(self, paper_flight: Flight) -> Mapping[str, float | None]:
        """The metrics of that flight here, airspeeds in the paper's size. Raises `EndedEarlyError`."""
        values, ended, failed = _measured(self.real(self.held(paper_flight)))
        if ended:
            raise early(paper_flight, ended, failed)
        off = values["airspeed_deviation_rms_mps"]
        return {**values, "airspeed_deviation_rms_mps": None if off is None else off / self.scale}

    def fly(self, paper_flight: Flight) -> Trace:
        """That flight here. Raises `EndedEarlyError`."""
        return self.sampled(self.held(paper_flight))

    def paper(self, experiment: str, law: str, reading: Reading | None = None, duration: float | None = None) -> Trace:
        """An experiment of the paper's here, under its reading unless told another. Raises `EndedEarlyError`."""
        return self.fly(flight(experiment, law, reading, duration))

    @property
    def limit(self) -> float:
        """What the paper's 5 deg/s are here, deg/s."""
        return math.degrees(self.change(flight("30", "NFTSM")).law.max_heading_rate)

    @property
    def limited(self) -> str:
        """The same in words."""
        return f"{self.limit:.3g} deg/s"


@lru_cache(maxsize=4)
def _measured(paper_flight: Flight) -> tuple[Mapping[str, float | None], str, bool]:
    """The metrics of a flight, how it ended where it did before its time, and whether it failed: asked for twice."""
    log = simulate(paper_flight)
    return measure(log), ending(log), log.outcome.failed


def early(paper_flight: Flight, how: str, failed: bool) -> Exception:
    """What to raise when this flight ended so."""
    kind = FlightFailedError if failed else EndedEarlyError
    return kind(f"the flight of {label(paper_flight.law)} over {paper_flight.duration:g} s ended: {how}")


def label(law: Law) -> str:
    """The law's name in the ledger."""
    assert isinstance(law, Nftsm | Smc)
    return next(
        name for name, (kind, gains) in LAWS.items() if isinstance(law, KINDS[kind].value) and law.gains == gains
    )


_LENGTHS = ("north", "east", "range_error", "target_north", "target_east", "target_velocity_north",
            "target_velocity_east")  # fmt: skip


def scaled(paper_flight: Flight, scale: float) -> Flight:
    """The similar flight: lengths and speeds times `scale`, times and rates as they are; gains in 1/m over it."""
    if scale == 1.0:
        return paper_flight
    law, start, target = paper_flight.law, paper_flight.start, paper_flight.target
    if isinstance(law, Nftsm):
        law = replace(law, standoff=scale * law.standoff, k1=law.k1 / scale)
    elif isinstance(law, Smc):
        law = replace(law, standoff=scale * law.standoff, c2=law.c2 / scale)
    return replace(
        paper_flight,
        law=law,
        start=replace(start, position=_times(scale, start.position), airspeed=scale * start.airspeed),
        target=replace(
            target,
            position=_times(scale, target.position),
            speed=scale * target.speed,
            segments=tuple(replace(each, acceleration=scale * each.acceleration) for each in target.segments),
        ),
        wind=replace(paper_flight.wind, steady=_times(scale, paper_flight.wind.steady)),
    )


def _times(scale: float, vector: tuple[float, float]) -> tuple[float, float]:
    return (scale * vector[0], scale * vector[1])


def _in_papers_size(trace: Trace, paper_flight: Flight, scale: float) -> Trace:
    columns = {name: x / scale if name in _LENGTHS else x for name, x in trace.columns.items()}
    return Trace(paper_flight, columns, trace.ended)


def _same(paper_flight: Flight) -> Flight:
    return paper_flight


def _estimating(paper_flight: Flight) -> Flight:
    return replace(paper_flight, estimator=EKF)


def _windy(paper_flight: Flight) -> Flight:
    if any(paper_flight.wind.steady):
        return paper_flight
    return replace(paper_flight, wind=replace(paper_flight.wind, steady=(2.0, 0.0)))


def _turbulent(paper_flight: Flight) -> Flight:
    return replace(paper_flight, wind=replace(paper_flight.wind, turbulence="moderate"))


def _steep(paper_flight: Flight, limit: float, standoff: float | None = None) -> Flight:
    """The limit, where there is one, raised to this one, rad/s; and another circle, m."""
    law = paper_flight.law
    assert isinstance(law, Nftsm | Smc)
    if not math.isinf(law.max_heading_rate):
        law = replace(law, max_heading_rate=limit)
    return replace(paper_flight, law=replace(law, standoff=standoff or law.standoff))


# The paper's aircraft, as the paper has it.
COLUMNS = (
    Column("kinematic, truth", "the paper's aircraft, Eq. (1), each experiment under its one reading", _same, 1e-4),
    Column("kinematic, EKF", "the same, the law seeing the target through the EKF with the paper's noise, seed 0",
           _estimating, 1.0),
)  # fmt: skip


class Aircraft(NamedTuple):
    """What flies in the ledger of the airframes."""

    name: str
    airspeed: float  # m/s
    steep: float  # rad/s, of a coordinated turn at 45 deg of bank


def _circling(airspeed: float) -> float:
    """The bank, deg, on a circle that is 60 m in the paper's size."""
    return math.degrees(bank_of_turn(airspeed, PAPERS_AIRSPEED / 60.0))


_STEEP_BANK = math.radians(45.0)


def _aircraft(name: str, airspeed: float) -> Aircraft:
    return Aircraft(name, airspeed, float(rate_of_turn(np.array(airspeed), np.array(_STEEP_BANK))))


BASELINE = _aircraft("kinematic", PAPERS_AIRSPEED)
AIRFRAMES = tuple(  # the slowest first
    sorted(
        (_aircraft(name, aircraft.limits(aircraft.folder(name)).design_airspeed) for name in aircraft.names()),
        key=lambda each: each.airspeed,
    )
)


def _for_each_airspeed(value: Callable[[Aircraft], float], unit: str) -> str:
    """A value at each airspeed flown, in words."""
    by_airspeed = {each.airspeed: value(each) for each in (BASELINE, *AIRFRAMES)}
    return ", ".join(f"{value:.3g}{unit} at {airspeed:g} m/s" for airspeed, value in by_airspeed.items())


CONDITIONS = {
    "still air": "the paper's experiments as they are; the law knows the target as in the experiment's reading",
    "wind": "a steady 2 m/s of 13 towards north; an experiment with a wind of its own keeps it",
    "turbulence": "moderate, MIL-F-8785C, not made similar: the same air for all; seed 0, one draw",
    "EKF": "still air, the law seeing the target through the EKF with the paper's noise, not made similar; seed 0",
    "45° of bank": "limits of 5 and 10 deg/s raised to a coordinated turn at 45°: "
    + _for_each_airspeed(lambda each: math.degrees(each.steep), " deg/s"),
    "45° at 60 m": "the same on a circle of 60 m, which takes a bank to hold too, round a target at rest "
    + _for_each_airspeed(lambda each: _circling(each.airspeed), "°"),
}


def _change(condition: str, limit: float) -> Callable[[Flight], Flight]:
    changes: dict[str, Callable[[Flight], Flight]] = {
        "still air": _same,
        "wind": _windy,
        "turbulence": _turbulent,
        "EKF": _estimating,
        "45° of bank": partial(_steep, limit=limit),
        "45° at 60 m": partial(_steep, limit=limit, standoff=60.0),
    }
    return changes[condition]


def column(condition: str, flown_on: Aircraft) -> Column:
    """An aircraft in a condition."""
    return Column(
        f"{condition}, {flown_on.name}",
        CONDITIONS[condition],
        _change(condition, flown_on.steep),
        1.0,
        aircraft="" if flown_on == BASELINE else flown_on.name,
        scale=flown_on.airspeed / PAPERS_AIRSPEED,
        period=HELD,
        periods=SOME_PERIODS,
    )


# Every aircraft in every condition: the ledger of the airframes, and its kinematic baseline.
GRID = tuple(column(condition, each) for condition in CONDITIONS for each in (BASELINE, *AIRFRAMES))
