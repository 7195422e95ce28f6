"""The simulations of the paper's Section 4 as flights, each under one reading of what the paper leaves open."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from autopilot.estimator import Estimator
from autopilot.guidance import Law
from autopilot.laws import law
from harness.flight import Flight
from harness.log import FlightLog
from harness.loop import simulate
from harness.plants.plant import Outcome, Start
from harness.world.target import Segment, Target
from harness.world.wind import Wind

LIMIT = math.radians(5.0)  # rad/s, Table 1

LAWS: Mapping[str, tuple[str, str]] = MappingProxyType(  # name and gain set
    {
        "NFTSM": ("nftsm", "fitted"),
        "NFTSM as printed": ("nftsm", "paper"),
        "NFTSM_1": ("nftsm", "paper_1"),
        "SMC": ("smc", "paper"),
    }
)

TRUTH = Estimator()
NO_ACCELERATION = Estimator(acceleration="unknown")
NO_TURN_RATE = Estimator(turn_rate="unknown")
NEITHER = Estimator(acceleration="unknown", turn_rate="unknown")
EKF = Estimator(kind="ekf")  # with the paper's noise

KNOWN: Mapping[Estimator, str] = MappingProxyType(
    {
        TRUTH: "knows all of the target",
        NO_ACCELERATION: "knows all of the target but its acceleration",
        NO_TURN_RATE: "knows all of the target but its turn rate",
        NEITHER: "knows position and velocity of the target",
        EKF: "knows the target through the EKF",
    }
)


@dataclass(frozen=True, slots=True)
class Reading:
    """What the paper does not say: how long a command is held, the wind, who is limited, what the law knows."""

    period: float = 0.001  # s; at the paper's sampling of 0.5 s its own gains cannot converge
    wind: tuple[float, float] = (0.0, 0.0)
    limited: bool | None = None  # to 5 deg/s; None: the laws that the paper limits in this experiment
    known: Estimator = TRUTH

    def __str__(self) -> str:
        air = "wind of Table 1" if any(self.wind) else "still air"
        return f"{air}, a command held for {1000.0 * self.period:g} ms, the law {KNOWN[self.known]}"


class PaperExperiment(NamedTuple):
    """One of Section 4's simulations."""

    title: str
    heading_deg: float
    duration: float  # s, of the paper's figures
    measured: float  # s, after which the paper gives no number
    target: Target
    reading: Reading = Reading()
    unlimited: frozenset[str] = frozenset()  # laws flown without the limit of Eq. (2)

    def in_words(self) -> str:
        """The reading in words."""
        who = f"5 deg/s on all laws but {' and '.join(sorted(self.unlimited))}" if self.unlimited else "5 deg/s"
        return f"{self.reading}; limit {who}"


STRAIGHT = Target(speed=2.0, heading=math.radians(-45.0))  # Sections 4.2 and 4.3, but for what follows
S_SHAPE = tuple(  # the paper gives no profile: bends of 0.45 deg/s, every other one the other way
    Segment(from_=500.0 * k, to=500.0 * (k + 1), turn_rate=math.radians((-0.45, 0.45)[k % 2])) for k in range(4)
)
MANOEUVRES = (  # Section 4.3
    Segment(from_=300.0, to=350.0, acceleration=5.0 / 50.0),
    Segment(from_=400.0, to=410.0, turn_rate=math.radians(-100.0 / 10.0)),
    Segment(from_=460.0, to=470.0, acceleration=4.0 / 10.0, turn_rate=math.radians(30.0 / 10.0)),
    Segment(from_=550.0, to=570.0, turn_rate=math.radians(20.0 / 20.0)),
)

EXPERIMENTS: Mapping[str, PaperExperiment] = MappingProxyType(
    {
        "30": PaperExperiment("Stationary target, from 30 deg", 30.0, 80.0, 80.0, Target()),
        "130": PaperExperiment("Stationary target, from 130 deg", 130.0, 100.0, 100.0, Target()),
        "S": PaperExperiment(
            "Target in an S", 70.0, 2000.0, 330.0, replace(STRAIGHT, segments=S_SHAPE), Reading(period=0.005)
        ),
        # The acceleration unknown, the turn rate known: only so the SMC law is sensitive to the target's speed and
        # insensitive to its turns, as the text says. The limit: "only executed by NFTSM_1", says the text.
        "manoeuvres": PaperExperiment(
            "Manoeuvring target",
            30.0,
            900.0,
            600.0,
            replace(STRAIGHT, segments=MANOEUVRES),
            Reading(period=0.005, known=NO_ACCELERATION),
            unlimited=frozenset({"NFTSM", "SMC"}),
        ),
    }
)


def paper_law(label: str, **parameters: float | str) -> Law:
    """One of the paper's laws, with the airspeed that the paper takes for constant."""
    name, gains = LAWS[label]
    return law(name, gains, **{"airspeed": "nominal", **parameters})


def flight(experiment: str, label: str, reading: Reading | None = None, duration: float | None = None) -> Flight:
    """One law in one experiment; without a reading under the experiment's own, without a duration the paper's."""
    e = EXPERIMENTS[experiment]
    reading = reading or e.reading
    limited = label not in e.unlimited if reading.limited is None else reading.limited
    steering = paper_law(label, max_heading_rate=LIMIT if limited else math.inf)
    blind = not e.target.segments and reading.known.kind == "truth"  # it has no manoeuvres to know of
    return Flight(
        plant="kinematic",
        law=steering,
        duration=duration or e.duration,
        guidance_period=reading.period,
        step=min(0.005, reading.period),
        start=Start(heading=math.radians(e.heading_deg)),
        target=e.target,
        wind=Wind(steady=reading.wind),
        estimator=TRUTH if blind else reading.known,
    )


def own(label: str, target: Target, duration: float, limit_deg_s: float = math.inf, period: float = 0.02) -> Flight:
    """A law round a target of our own, from the paper's start at 30 deg."""
    paper = flight("30", label)
    steering = paper_law(label, max_heading_rate=math.radians(limit_deg_s))
    return replace(
        paper, law=steering, target=target, duration=duration, guidance_period=period, step=min(0.005, period)
    )


KEPT = (
    "time", "north", "east", "heading", "heading_rate_command", "unlimited_command", "sliding_variable", "range_error",
    "target_north", "target_east", "target_velocity_north", "target_velocity_east",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Trace:
    """What the paper's numbers are made of: some columns of a flight's log, so that many fit into memory."""

    flight: Flight
    columns: Mapping[str, NDArray[np.float64]]
    ended: str = ""  # how and when, where it ended before its time
    failed: bool = False  # it ended without a result

    def __getitem__(self, column: str) -> NDArray[np.float64]:
        return self.columns[column]


@lru_cache(maxsize=24)
def flown(flight: Flight) -> Trace:
    """A flight, flown; the latest are kept, since much is asked of the same."""
    log = simulate(flight)
    return Trace(flight, {column: log[column].copy() for column in KEPT}, ending(log), log.outcome.failed)


def ending(log: FlightLog) -> str:
    """How and when a flight ended before its time; empty when it did not."""
    if log.outcome is Outcome.COMPLETED:
        return ""
    return f"{log.outcome} after {log['time'][-1] if len(log) else 0.0:.1f} s ({log.reason})"
