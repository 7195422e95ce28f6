"""How often the test for a limit cycle errs: `python -m harness.studies.chatter` writes docs/answers/chatter.md.

Flights that cannot be in a limit cycle (SMC, and NFTSM with half the gains at the predicted border) count false alarms;
flights with gains above the border count the cycles that are seen. About two minutes on one processor.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType

import click
from scipy.stats import beta

import aircraft
from autopilot.estimator import Estimator
from autopilot.laws import law
from harness.chatter import FEWEST_CYCLES, LEAST_CORRELATION, REMEMBERED, SHORTEST, SLOWEST, VISIBLE
from harness.flight import Flight
from harness.limit_cycle.prediction import Loop, boundary
from harness.log.signals import Signals
from harness.loop import simulate
from harness.plants.identified import identified
from harness.plants.plant import Start
from harness.studies.command import counted, out_option, run, write
from harness.template import template
from harness.world.randomness import stream
from harness.world.target import Target
from harness.world.wind import Wind

AIRFRAMES = ("ultra_stick_25e", "skywalker_x8", "aerosonde")
DURATION = 150.0  # s
FLIGHTS = MappingProxyType({"calm": 600, "cycling": 240, "disturbed": 120})
_LIMITS_DEG_S = (5.0, 10.0, 20.0)
_ABOVE = (1.1, 1.5, 2.5, 5.0)  # times the gains at the border
_BELOW = 0.5

AIR = MappingProxyType(
    {
        "still air": (Wind(), "truth"),
        "wind of 2.2 m/s": (Wind(steady=(2.0, 1.0)), "truth"),
        "light turbulence": (Wind(steady=(1.0, 0.0), turbulence="light"), "truth"),
        "moderate turbulence": (Wind(steady=(1.0, 1.0), turbulence="moderate"), "truth"),
        "target estimated (EKF)": (Wind(), "ekf"),
        "light turbulence, target estimated": (Wind(turbulence="light"), "ekf"),
    }
)


@dataclass(frozen=True, slots=True)
class Case:
    """A flight of known kind, and the words for where it belongs in the tables."""

    kind: str  # a key of `FLIGHTS`
    air: str  # a key of `AIR`
    flight: Flight


@dataclass(frozen=True, slots=True)
class Told:
    """What the metrics tell of a case."""

    case: Case
    chatters: bool | None
    amplitude: float  # rad/s, of the strongest oscillation of the flown heading rate, limit cycle or not


def cases(kind: str, count: int) -> Iterator[Case]:
    """The first so many cases of a kind, the same whenever it is asked."""
    draw = stream(0, f"chatter {kind}")
    airs = {"calm": list(AIR), "cycling": ["still air"], "disturbed": list(AIR)[1:5]}[kind]
    plants = ("lagged", "lagged", "kinematic", "sixdof") if kind == "calm" else ("lagged", "sixdof")
    for seed in range(count):
        plant, airframe = str(draw.choice(plants)), str(draw.choice(AIRFRAMES))
        period = 0.05 if plant == "sixdof" else float(draw.choice([0.05, 0.05, 0.25]))
        limit = math.radians(float(draw.choice(_LIMITS_DEG_S)))
        power = float(draw.choice([0.5, 0.5, 0.0]))  # k3 over k2
        times = _BELOW if kind == "calm" else float(draw.choice(_ABOVE))
        azimuth, beyond, off = draw.uniform(0.0, math.tau), draw.uniform(-0.1, 0.3), draw.uniform(-0.3, 0.3)
        speed = aircraft.limits(aircraft.folder(airframe)).design_airspeed
        standoff = 200.0 * speed / 13.0
        nominal: dict[str, float | str] = {"airspeed": "nominal", "standoff": standoff, "max_heading_rate": limit}
        k2 = times * border(airframe, period, limit, power)
        if kind == "calm" and draw.random() < 0.3:
            flown = law("smc", "paper", **nominal)
        else:
            flown = law("nftsm", "fitted", **nominal, k2=k2, k3=power * k2)
        distance, name = standoff * (1.0 + beyond), airs[seed % len(airs)]
        wind, estimator = AIR[name]
        flight = Flight(
            plant=plant,
            law=flown,
            aircraft=airframe,
            duration=DURATION,
            guidance_period=period,
            seed=seed,
            start=Start(
                position=(distance * math.cos(azimuth), distance * math.sin(azimuth)),
                heading=azimuth - 0.5 * math.pi + off,
                airspeed=speed,
            ),
            target=Target(position=(0.0, 0.0)),
            wind=wind,
            estimator=Estimator(kind="ekf") if estimator == "ekf" else Estimator(),
        )
        yield Case(kind, name, flight)


@lru_cache(maxsize=256)
def border(airframe: str, period: float, limit: float, power: float) -> float:
    """The k2, 1/s, with k3 = `power` k2 at which the limit cycle of NFTSM is predicted to begin."""
    speed = aircraft.limits(aircraft.folder(airframe)).design_airspeed
    response = identified(aircraft.folder(airframe), speed).heading_rate

    def loop(k2: float) -> Loop:
        standoff = 200.0 * speed / 13.0
        nominal: dict[str, float | str] = {"airspeed": "nominal", "standoff": standoff, "max_heading_rate": limit}
        nftsm = law("nftsm", "fitted", **nominal, k2=k2, k3=power * k2)
        return Loop(nftsm, response, speed, period)

    return boundary(loop, 3.0)


def tell(case: Case) -> Told:
    """The case flown and judged."""
    oscillation = Signals(simulate(case.flight)).oscillation
    if oscillation is None:
        return Told(case, None, math.nan)
    return Told(case, oscillation.chatters, oscillation.heading_rate)


def false_alarms(told: Sequence[Told]) -> tuple[int, int, float]:
    """Alarms, calm flights that could be judged, and the upper end of the one-sided 95 % interval (Clopper's)."""
    calm = [entry for entry in told if entry.case.kind == "calm" and _is_judged(entry)]
    alarms = sum(entry.chatters is True for entry in calm)
    return alarms, len(calm), float(beta.ppf(0.95, alarms + 1, len(calm) - alarms))


def _is_judged(told: Told) -> bool:
    return not math.isnan(told.amplitude)


def seen(told: Sequence[Told]) -> tuple[int, int, float]:
    """Cycles told, flights that cycle by `VISIBLE` or more, and the lower end of the one-sided 95 % interval."""
    cycling = [entry for entry in told if entry.case.kind == "cycling" and entry.amplitude >= VISIBLE]
    hits = sum(entry.chatters is True for entry in cycling)
    return hits, len(cycling), float(beta.ppf(0.05, hits, len(cycling) - hits + 1))


def missed(told: Sequence[Told]) -> list[str]:
    """The cycles of `seen` that were not told, in words."""
    cycling = [entry for entry in told if entry.case.kind == "cycling" and entry.amplitude >= VISIBLE]
    flights = [entry.case.flight for entry in cycling if not entry.chatters]
    return [f"{f.aircraft} on {f.plant}, limit {math.degrees(f.law.max_heading_rate):.0f} °/s" for f in flights]


def document(told: Sequence[Told]) -> str:
    """The page: what the test is, and its error rates."""
    rows = [
        (kind, air, [entry.chatters for entry in told if (entry.case.kind, entry.case.air) == (kind, air)])
        for kind in FLIGHTS
        for air in AIR
    ]
    plants = {
        name: sum(entry.case.flight.plant == name for entry in told) for name in ("kinematic", "lagged", "sixdof")
    }
    page = template("harness.studies", "chatter.md.jinja").render(
        rows=[row for row in rows if row[2]],
        alarms=false_alarms(told),
        swinging=sum(entry.chatters is not False for entry in told if entry.case.kind == "calm" and _is_judged(entry)),
        seen=seen(told),
        missed=missed(told),
        plants=plants,
        visible=math.degrees(VISIBLE),
        cycles=REMEMBERED,
        correlation=LEAST_CORRELATION,
        slowest=SLOWEST,
        fewest=FEWEST_CYCLES,
        shortest=SHORTEST,
    )
    return page + "\n"


@click.command()
@out_option
def main(out: Path) -> None:
    """Fly calm and cycling flights and count the test's errors; write OUT/chatter.md. Takes two minutes."""
    every = [case for kind, count in FLIGHTS.items() for case in cases(kind, count)]
    write(out, {"chatter.md": document(list(counted(map(tell, every), len(every), "flying")))})


if __name__ == "__main__":
    run(main, "harness.studies.chatter")
