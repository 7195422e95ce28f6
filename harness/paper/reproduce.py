"""The paper's experiments flown anew: its numbers beside ours, and how ours move with what the paper leaves open."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

import numpy as np

from autopilot.estimator import Estimator
from autopilot.guidance import Law
from autopilot.laws import law
from harness.flight import Flight
from harness.flight_log import FlightLog
from harness.plant import Start
from harness.simulation import simulate
from harness.target import Segment, Target
from harness.wind import Wind

CONVERGED = 1e-4  # m, Table 3
SETTLED_FOR = 1.0  # s that must be left: less tells nothing of "for good"


@dataclass(frozen=True, slots=True)
class Reading:
    """What the paper does not say: how long a command is held, the wind, who is limited, what the law knows."""

    period: float = 0.001  # s; at the paper's sampling of 0.5 s its own gains cannot converge
    wind: tuple[float, float] = (0.0, 0.0)
    limited: bool | None = None  # to 5 deg/s; None: those that the experiment limits
    known: Literal["truth", "ekf"] = "truth"


VARIANTS: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {
        "held 5 ms": {"period": 0.005},
        "held 50 ms": {"period": 0.05},
        "held 0.5 s": {"period": 0.5},
        "wind": {"wind": (0.1, 0.2)},  # Table 1
        "all limited": {"limited": True},
        "no limit": {"limited": False},
        "EKF": {"known": "ekf"},
    }
)

LAWS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "NFTSM": ("nftsm", "identified"),
        "NFTSM as printed": ("nftsm", "paper"),
        "NFTSM_1": ("nftsm", "paper_1"),
        "SMC": ("smc", "paper"),
    }
)


class Experiment(NamedTuple):
    """One of Section 4's simulations."""

    title: str
    heading_deg: float
    duration: float
    target: Target
    reading: Reading = Reading()
    unlimited: frozenset[str] = frozenset()  # laws flown without the limit of Eq. (2)


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

EXPERIMENTS: Mapping[str, Experiment] = MappingProxyType(
    {
        "30": Experiment("Stationary target, from 30 deg", 30.0, 80.0, Target()),
        "130": Experiment("Stationary target, from 130 deg", 130.0, 100.0, Target()),
        "S": Experiment("S-shape", 70.0, 330.0, replace(STRAIGHT, segments=S_SHAPE), Reading(period=0.005)),
        "S, whole": Experiment("S-shape", 70.0, 2000.0, replace(STRAIGHT, segments=S_SHAPE), Reading(period=0.02)),
        "straight": Experiment(
            "Before the manoeuvres",
            30.0,
            299.0,
            STRAIGHT,
            Reading(period=0.005),
            unlimited=frozenset({"NFTSM", "SMC"}),
        ),
        "manoeuvres": Experiment(
            "Manoeuvring target",
            30.0,
            900.0,
            replace(STRAIGHT, segments=MANOEUVRES),
            Reading(period=0.005),
            unlimited=frozenset({"NFTSM", "SMC"}),
        ),
    }
)


def flight(experiment: str, label: str, reading: Reading) -> Flight:
    """One law in one experiment under one reading."""
    e = EXPERIMENTS[experiment]
    name, gains = LAWS[label]
    limited = label not in e.unlimited if reading.limited is None else reading.limited
    steering: Law = law(name, gains, max_heading_rate=math.radians(5.0) if limited else math.inf)
    return Flight(
        plant="kinematic",
        law=steering,
        duration=e.duration,
        guidance_period=reading.period,
        step=min(0.005, reading.period),
        start=Start(heading=math.radians(e.heading_deg)),
        target=e.target,
        wind=Wind(steady=reading.wind),
        estimator=Estimator(kind=reading.known),
    )


@lru_cache(maxsize=8)
def flown(experiment: str, label: str, reading: Reading) -> FlightLog:
    """The log of that flight; the latest are kept, since neighbours in `NUMBERS` ask for the same."""
    return simulate(flight(experiment, label, reading))


def settled(log: FlightLog, tolerance: float = CONVERGED) -> float | None:
    """The first tenth of a second after which |r| stays below the tolerance; None when it does not for a second."""
    outside = np.flatnonzero(~(np.abs(log["range_error"]) < tolerance))
    first = outside[-1] + 1 if outside.size else 0
    time = log["time"]
    if first >= len(time) or time[-1] - time[first] < SETTLED_FOR:
        return None
    return math.ceil(10.0 * float(time[first]) - 1e-6) / 10.0


def settled_to_1_m(log: FlightLog) -> float | None:
    """The same for 1 m."""
    return settled(log, 1.0)


def first_free(log: FlightLog) -> float | None:
    """When the command first is within the limit, s."""
    free = np.flatnonzero(np.abs(log["unlimited_command"]) <= log.flight.law.max_heading_rate)
    return float(log["time"][free[0]]) if free.size else None


def error_after_320_s(log: FlightLog) -> float | None:
    """The size of r at 320 s, m."""
    return float(abs(log["range_error"][np.searchsorted(log["time"], 320.0)]))


def peak_while_accelerating(log: FlightLog) -> float | None:
    """The largest |r| from 300 s to 350 s, m."""
    return _peak(log, 300.0, 350.0)


def peak_in_all_manoeuvres(log: FlightLog) -> float | None:
    """The largest |r| from 300 s on, m."""
    return _peak(log, 300.0, math.inf)


def back_after_acceleration(log: FlightLog) -> float | None:
    """How long after 350 s |r| stays below 1 m until the next manoeuvre, s."""
    between = (log["time"] >= 350.0) & (log["time"] < 400.0)
    outside = np.flatnonzero(np.abs(log["range_error"][between]) >= 1.0)
    return float(log["time"][between][outside[-1]] - 350.0) if outside.size else 0.0


def _peak(log: FlightLog, begin: float, end: float) -> float:
    during = (log["time"] >= begin) & (log["time"] <= end)
    return float(np.abs(log["range_error"][during]).max())


def final_error(log: FlightLog) -> float | None:
    """R at the end, m."""
    return float(log["range_error"][-1])


class Number(NamedTuple):
    """A number that the paper prints, and how to find it in a log."""

    where: str
    law: str
    what: str
    printed: str
    value: float | None  # None: "does not converge"
    places: int  # decimals printed
    experiment: str
    measure: Callable[[FlightLog], float | None]
    at_most: bool = False  # the paper gives a bound

    def agrees(self, ours: float | None) -> bool:
        """Whether our number rounds to the printed one."""
        if ours is None or self.value is None:
            return ours is self.value
        return ours <= self.value if self.at_most else round(ours, self.places) == self.value


_FROM_30, _FROM_130 = "converges to 1e-4 m, from 30 deg", "converges to 1e-4 m, from 130 deg"
NUMBERS = (
    Number("Table 3", "NFTSM", _FROM_30, "31.2 s", 31.2, 1, "30", settled),
    Number("Table 3", "SMC", "error after 80 s, from 30 deg", "-0.742 m", -0.742, 3, "30", final_error),
    Number("Table 3", "NFTSM_1", _FROM_30, "37.3 s", 37.3, 1, "30", settled),
    Number("Table 3", "NFTSM", _FROM_130, "72.9 s", 72.9, 1, "130", settled),
    Number("Table 3", "SMC", _FROM_130, "not in 100 s", None, 1, "130", settled),
    Number("Table 3", "NFTSM_1", _FROM_130, "shock", None, 1, "130", settled),
    Number("Table 3", "NFTSM as printed", _FROM_30, "31.2 s", 31.2, 1, "30", settled),
    Number("Table 3", "NFTSM as printed", _FROM_130, "72.9 s", 72.9, 1, "130", settled),
    Number("4.1", "NFTSM", "restricted until, from 130 deg", "17 s", 17.0, 0, "130", first_free),
    Number("4.1", "NFTSM", "restricted until, from 30 deg", "(8 s)", 8.0, 0, "30", first_free),
    Number("4.2", "NFTSM", "converges to 1e-4 m", "38.8 s", 38.8, 1, "S", settled),
    Number("4.2", "NFTSM_1", "converges to 1e-4 m", "81.6 s", 81.6, 1, "S", settled),
    Number("4.2", "SMC", "error after 320 s", "0.18 m", 0.18, 2, "S", error_after_320_s),
    Number("4.3", "NFTSM", "converges to 1e-4 m, before 300 s", "24.3 s", 24.3, 1, "straight", settled),
    Number("4.3", "NFTSM_1", "converges to 1e-4 m, before 300 s", "34.2 s", 34.2, 1, "straight", settled),
    Number("4.3", "SMC", "converges to 1 m, before 300 s", "113.6 s", 113.6, 1, "straight", settled_to_1_m),
    Number("4.3", "SMC", "peak while accelerating", "17.4 m", 17.4, 1, "manoeuvres", peak_while_accelerating),
    Number(
        "4.3", "SMC", "back within 1 m after 350 s, delay", "10.3 s", 10.3, 1, "manoeuvres", back_after_acceleration
    ),
    Number("4.3", "NFTSM", "peak in all manoeuvres", "<= 0.1 m", 0.1, 1, "manoeuvres", peak_in_all_manoeuvres, True),
)


class Reproduced(NamedTuple):
    """A printed number beside ours, under the experiment's reading and under others."""

    number: Number
    reading: Reading
    ours: float | None
    agrees: bool
    otherwise: Mapping[str, float | None]  # by what is read differently


def _under(number: Number, reading: Reading) -> float | None:
    return number.measure(flown(number.experiment, number.law, reading))


def reproduce() -> Iterator[Reproduced]:
    """Every number of `NUMBERS`, one by one."""
    yield from map(reproduced, NUMBERS)


def reproduced(number: Number) -> Reproduced:
    """One number under its experiment's reading, and with one thing at a time read differently."""
    reading = EXPERIMENTS[number.experiment].reading
    ours = _under(number, reading)
    otherwise = {name: _under(number, replace(reading, **changed)) for name, changed in VARIANTS.items()}
    return Reproduced(number, reading, ours, number.agrees(ours), otherwise)


def shown(number: Number, value: float | None) -> str:
    """A value of ours with as many decimals as the paper prints, or a dash for none."""
    return "-" if value is None else f"{value:.{number.places}f}"


def table(results: list[Reproduced]) -> list[str]:
    """The numbers in lines: the paper's, ours, whether they agree, and ours when one thing is read differently."""
    header = f"{'where':8}{'law':18}{'what':36}{'paper':>13}{'ours':>8} agrees" + "".join(f"{v:>12}" for v in VARIANTS)
    lines = [header]
    for r in results:
        n = r.number
        others = "".join(f"{shown(n, value):>12}" for value in r.otherwise.values())
        agrees = "yes" if r.agrees else "no"
        lines.append(f"{n.where:8}{n.law:18}{n.what:36}{n.printed:>13}{shown(n, r.ours):>8} {agrees:>6}{others}")
    return lines
