"""How near the circle can any law stay in turbulence? `python -m harness.studies.floor` writes floor.md and floor.csv.

Flights give the disturbance; `floor_model` has the least range error that any law can have in it.
"""

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal, NamedTuple

import click
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.signal import welch
from scipy.stats import t as student

import aircraft
from autopilot.guidance import Context, Guidance, LawStep, Observation
from autopilot.laws import law
from autopilot.response import Response
from autopilot.standoff import relative_motion
from harness.drawing import COLOURS, draw
from harness.flight import Flight, air_of, plant_of
from harness.log import FlightLog
from harness.loop import simulate
from harness.plants.identified import identified
from harness.plants.lagged import Lagged
from harness.plants.plant import Flying, Start
from harness.pool import computed
from harness.studies.command import counted, out_option, run, write
from harness.studies.floor_model import (
    ORDER,
    PERIOD,
    Autoregression,
    Circle,
    CircleModel,
    Optimum,
    error_at,
    fitted,
    front,
    model,
    optimal,
)  # fmt: skip
from harness.studies.paper.job import workers
from harness.template import template
from harness.world.air import Air
from harness.world.target import Target
from harness.world.wind import Wind

Array = NDArray[np.float64]

SEVERITY = "moderate"
SEEDS = 8
DURATION, BEGIN = 300.0, 20.0  # s; what comes before is the start
ACTIVITIES = (1.5, 2.0, 3.0, 5.0, 10.0, 20.0)  # deg/s^2, of the page's table
CHECKED = (1.0, 1e2, 1e4)  # of them, flown
COLUMNS = ("airframe", "turbulence", "activity deg/s2", "error m rms", "low", "high")  # of floor.csv
_QUIET = {"k2": 1.0, "k3": 0.5}  # of NFTSM: without a limit cycle on each airframe


class HeldTurn(NamedTuple):
    """What turbulence does to an airframe whose command is held at the turn of its circle."""

    disturbance: Array  # rad/s, each the mean of a period
    speed: float  # m/s, mean, over the ground


def flight_of(name: str, seed: int, plant: str = "sixdof", duration: float = DURATION) -> Flight:
    """A quiet law on the circle, from its start on: the paper's, at 25 m/s as much wider."""
    airspeed = aircraft.limits(aircraft.folder(name)).design_airspeed
    standoff = 200.0 * airspeed / 13.0
    return Flight(
        plant=plant,
        law=law("nftsm", "fitted", **_QUIET, standoff=standoff, max_heading_rate=math.radians(15.0)),
        aircraft=name,
        duration=duration,
        guidance_period=PERIOD,
        seed=seed,
        start=Start(position=(0.0, standoff), heading=0.0, airspeed=airspeed),
        target=Target(position=(0.0, 0.0)),
        wind=Wind(turbulence=SEVERITY),
    )


def held(flight: Flight) -> HeldTurn:
    """The disturbance with the command held, so that no law has a part in it."""
    flying, standoff = plant_of(flight).start(flight.start, air_of(flight)), flight.law.standoff
    velocity = []
    for _ in range(flight.periods):
        flying.advance(-flight.start.airspeed / standoff, flight.guidance_period)
        velocity.append((flying.state.velocity_north, flying.state.velocity_east))
    north, east = np.array(velocity)[round(BEGIN / flight.guidance_period) :].T
    speed, rate = np.hypot(north, east), np.diff(np.unwrap(np.arctan2(east, north))) / flight.guidance_period
    return HeldTurn(rate + 0.5 * (speed[1:] + speed[:-1]) / standoff, float(speed.mean()))


def under_law(log: FlightLog, response: Response) -> Array:
    """The same from a flight of a law: what the model leaves of the rate of its heading error, rad/s."""
    flight = log.flight
    circle = Circle(response, flight.start.airspeed, flight.law.standoff, flight.guidance_period)
    of = model(circle, Autoregression(np.zeros(1), 0.0, np.zeros(0)))
    theta, e = np.unwrap(log["heading_error"]), log["range_error"]
    u = log["heading_rate_command"] + circle.speed / circle.standoff
    z, left = np.zeros(len(of.F)), np.zeros(len(u) - 1)
    kept = of.known - 7
    for k, change in enumerate(np.diff(u, prepend=0.0)[:-1]):
        z[:2], z[7 + kept :] = (e[k], theta[k]), 0.0
        z = of.F @ z + of.g * change
        left[k] = (theta[k + 1] - z[1]) / circle.period
    return left[round(BEGIN / circle.period) :]


@dataclass(frozen=True, slots=True)
class Planted:
    """The plant `lagged` with a planted disturbance: its heading turns by so much more in each period."""

    lagged: Lagged
    rates: tuple[float, ...]  # rad/s, one for each period

    def start(self, start: Start, air: Air) -> Flying:
        return _PlantedFlying(self.lagged.start(start, air), self.rates)


class _PlantedFlying:
    def __init__(self, flying: Any, rates: Sequence[float]) -> None:
        self._flying, self._rates = flying, iter(rates)

    @property
    def state(self) -> Any:
        return self._flying.state

    def advance(self, heading_rate: float, period: float) -> None:
        half = 0.5 * period * next(self._rates)  # before and after: the position is exact to the third order
        self._turn(half)
        self._flying.advance(heading_rate, period)
        self._turn(half)

    def _turn(self, angle: float) -> None:
        flying, state = self._flying, self._flying.state
        v_a, psi = state.airspeed, state.heading + angle
        flying.moved = flying.moved._replace(heading=psi)
        flying.state = state._replace(
            heading=psi, velocity_north=v_a * math.cos(psi), velocity_east=v_a * math.sin(psi)
        )


@dataclass(frozen=True, slots=True, eq=False)
class Omniscient:
    """The optimal law in flight: it knows the planted disturbance, and the response by its own commands."""

    of: CircleModel
    gains: Array
    rates: Array  # rad/s, one for each period, and before them as many as the autoregression looks back
    speed: float
    standoff: float
    max_heading_rate: float = math.radians(60.0)
    command: Literal["heading_rate"] = "heading_rate"

    def start(self, context: Context) -> LawStep:
        known, order = self.of.known, len(self.of.F) - self.of.known
        z, turn, k = np.zeros(len(self.of.F)), -self.speed / self.standoff, order - 1

        def step(o: Observation) -> Guidance:
            nonlocal z, k
            r, _, _, heading_error, _ = relative_motion(o, self.standoff, self.speed, o.heading)
            z[:2], z[known:] = (r, heading_error), self.rates[k::-1][:order]
            change = -float(self.gains @ z)
            z, k = self.of.F @ z + self.of.g * change, k + 1
            u = turn + float(z[7])
            return Guidance(u, r, math.nan, heading_error, turn, u)

        return step

    def broken_conditions(self, speed_ratio: float) -> list[str]:
        return []


class Check(NamedTuple):
    """An optimal law flown on `lagged` with the planted disturbance, beside what the closed form says."""

    predicted: Optimum
    error: tuple[float, float]  # m rms, mean of the seeds and its 95 % interval's half width
    activity: tuple[float, float]  # deg/s^2


def checked(name: str, disturbance: Autoregression, weight: float, seeds: int = SEEDS) -> Check:
    """The optimal law of this weight (rho over V^2) flown, from the circle on."""
    flight = flight_of(name, 0, "lagged")
    speed, standoff = flight.start.airspeed, flight.law.standoff
    response = identified(aircraft.folder(name), speed).heading_rate
    of = model(Circle(response, speed, standoff), disturbance)
    point, order = optimal(of, weight * speed**2), len(disturbance.coefficients)
    numbers = []
    for seed in range(seeds):
        rates = disturbance.drawn(flight.periods + order, seed)
        flown = replace(flight, wind=Wind(), seed=seed, law=Omniscient(of, point.gains, rates, speed, standoff))
        log = simulate(flown, plant=Planted(Lagged(response), tuple(rates[order - 1 :].tolist())))
        first = round(BEGIN / PERIOD)
        e, u = log["range_error"][first:], log["heading_rate_command"][first:]
        numbers.append((np.mean(e**2), np.degrees(np.abs(np.diff(u)).mean() / PERIOD)))
    (square, activity), halves = np.mean(numbers, axis=0).tolist(), _half_width(np.array(numbers)).tolist()
    error = math.sqrt(square)
    return Check(point, (error, 0.5 * halves[0] / error), (activity, halves[1]))


def _half_width(of_seeds: Array) -> Array:
    """Of the 95 % interval of the mean; seeds in rows."""
    n = len(of_seeds)
    return np.asarray(student.ppf(0.975, n - 1) * of_seeds.std(axis=0, ddof=1) / math.sqrt(n))


class FloorAt(NamedTuple):
    """A point of an airframe's floor, and the 95 % interval of its error at this activity, over the seeds."""

    airframe: str
    activity: float  # deg/s^2
    error: float  # m rms
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Floor:
    """The floor of an airframe, and what speaks for it."""

    airframe: str
    speed: float  # m/s, mean over the ground
    standoff: float
    disturbance: Autoregression
    measured: Sequence[Array]  # rad/s, what it was fitted to, by seed
    points: Sequence[Optimum]
    without_one: Sequence[Sequence[Optimum]]  # the floor without the first seed, without the second, and so on
    under_law: Sequence[Optimum]  # the floor of the disturbance that flights of a law show
    checks: Sequence[Check]

    def level(self, activity: float) -> FloorAt:
        """The floor at this activity; its interval by leaving out one seed at a time (jackknife)."""
        error, n = error_at(self.points, activity), len(self.without_one)
        logs = np.log([error_at(points, activity) for points in self.without_one])
        scatter = math.sqrt((n - 1) / n * float(np.sum((logs - logs.mean()) ** 2)))
        factor = math.exp(float(student.ppf(0.975, n - 1)) * scatter)
        return FloorAt(self.airframe, activity, error, error / factor, error * factor)

    @property
    def memory(self) -> float:
        """The largest correlation of what is new in a period with that of up to 2 s before; of white noise below it."""
        x = self.disturbance.residual
        return max(abs(float(x[:-k] @ x[k:] / (x @ x))) for k in range(1, ORDER + 1))

    @property
    def moved_by_law(self) -> float:
        """The largest relative difference of the floor from flights of a law, at `ACTIVITIES`."""
        ratios = [error_at(self.under_law, x) / error_at(self.points, x) for x in ACTIVITIES]
        return max(abs(ratio - 1.0) for ratio in ratios)


def floor(name: str) -> Floor:
    """Flies, fits, computes and checks the floor of an airframe."""
    flights = [flight_of(name, seed) for seed in range(SEEDS)]
    flown, standoff = [held(flight) for flight in flights], flights[0].law.standoff
    series, speed = [each.disturbance for each in flown], float(np.mean([each.speed for each in flown]))
    response = identified(aircraft.folder(name), flights[0].start.airspeed).heading_rate
    circle, disturbance = Circle(response, speed, standoff), fitted(series)
    return Floor(
        airframe=name,
        speed=speed,
        standoff=standoff,
        disturbance=disturbance,
        measured=series,
        points=front(circle, disturbance),
        without_one=[front(circle, fitted(series[:i] + series[i + 1 :])) for i in range(SEEDS)],
        under_law=front(circle, fitted([under_law(simulate(flight), response) for flight in flights])),
        checks=[checked(name, disturbance, weight) for weight in CHECKED],
    )


def paint(figure: Figure, floors: Sequence[Floor]) -> None:
    """The floors, and the spectra of the disturbance that they rest on."""
    left, right = figure.subplots(1, 2)
    for each, colour, line in zip(floors, COLOURS, ("-", "--", "-."), strict=False):
        _, *numbers = zip(*(each.level(point.activity) for point in each.points), strict=True)
        activity, error, low, high = map(np.array, numbers)
        left.fill_between(activity, low, high, color=colour, alpha=0.25, linewidth=0.0)
        left.loglog(activity, error, line, color=colour, label=each.airframe)
        for check in each.checks:
            left.plot(check.activity[0], check.error[0], "o", color=colour, markersize=4.0)
        hertz, density = welch(np.array(each.measured), 1.0 / PERIOD, nperseg=1024, detrend="constant")
        edges = np.geomspace(hertz[1], hertz[-1], 40)
        bands = [(hertz >= a) & (hertz < b) for a, b in pairwise(edges)]
        inside = [band for band in bands if band.any()]
        mean = np.degrees(1.0) ** 2 * density.mean(axis=0)
        right.loglog([hertz[b].mean() for b in inside], [mean[b].mean() for b in inside], ".", color=colour)
        fit = np.degrees(1.0) ** 2 * each.disturbance.spectrum(hertz[1:], PERIOD)
        right.loglog(hertz[1:], fit, line, color=colour, linewidth=1.0, label=each.airframe)
    left.set(xlabel="command activity, °/s²", ylabel="range error, m rms", xlim=(0.5, 30.0), ylim=(0.005, 3.0))
    left.set(title="The floor; dots: flown on lagged")
    right.set(xlabel="Hz", ylabel="(°/s)²/Hz", title="What it rests on: d; dots: flown on sixdof")
    _plain_ticks(left)
    left.legend(fontsize=8)


def _plain_ticks(axes: Axes) -> None:
    axes.xaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_major_formatter("{x:g}")


def floor_csv(floors: Sequence[Floor]) -> str:
    """Each airframe's floor, a line for each point."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for each in floors:
        for point in each.points:
            airframe, *numbers = each.level(point.activity)
            writer.writerow((airframe, SEVERITY, *(f"{number:.4g}" for number in numbers)))
    return text.getvalue()


def read_floor(path: Path) -> dict[str, list[FloorAt]]:
    """The floor of each airframe, from `floor.csv`."""
    levels: dict[str, list[FloorAt]] = {}
    with path.open(encoding="utf-8", newline="") as file:
        for airframe, _, *numbers in list(csv.reader(file))[1:]:
            levels.setdefault(airframe, []).append(FloorAt(airframe, *map(float, numbers)))
    return levels


def page(floors: Sequence[Floor]) -> str:
    """The page."""
    fields = {
        "floors": floors,
        "activities": ACTIVITIES,
        "seeds": SEEDS,
        "duration": DURATION,
        "severity": SEVERITY,
        "order": ORDER,
        "period": PERIOD,
        "degrees": math.degrees,
        "std": lambda series: math.degrees(float(np.std(np.concatenate(series)))),
        "quiet": _QUIET,
        "least": max(each.points[-1].activity for each in floors),
    }
    return template("harness.studies", "floor.md.jinja").render(fields) + "\n"


@click.command()
@out_option
def main(out: Path) -> None:
    """Fly the airframes in turbulence, and write OUT/floor.md with its figure and table. Takes a minute."""
    names = aircraft.names()
    found = counted(computed([partial(floor, name) for name in names], workers()), len(names), "computing floors")
    floors = sorted(found, key=lambda each: each.airframe)
    write(
        out,
        {
            "floor.svg": draw(partial(paint, floors=floors), 9.0, 3.6),
            "floor.csv": floor_csv(floors),
            "floor.md": page(floors),
        },
    )


if __name__ == "__main__":
    run(main, "harness.studies.floor")
