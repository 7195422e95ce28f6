"""What a 6-DOF flight costs beside bare JSBSim: `python -m benchmarks.performance [PAIRS [SECONDS]]`.

Every case is flown beside a bare loop of as many steps of the same model with its inner loop, in turn, in processor
time. Writes docs/performance.md.
"""

import os
import platform
import statistics
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain, islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import jsbsim
import numpy as np

import aircraft
from autopilot.estimator import Estimator, Measurement
from autopilot.laws import law
from benchmarks.flight_speed import bare_loop, seconds, spread
from benchmarks.in_vain import least, section
from benchmarks.measured import busy
from harness import loop
from harness.adoption.adopt import adopt
from harness.adoption.adoption import Wish
from harness.compiled import engine
from harness.files import write_text
from harness.flight import Flight, air_of, context_of
from harness.log import COLUMNS
from harness.loop import simulate
from harness.plants.model import Fdm, node
from harness.plants.sixdof import READ, SixDof
from harness.settings import load_flight
from harness.tables import markdown
from harness.world.wind import Wind

PAGE = Path("docs/performance.md")
AIRFRAME = "ultra_stick_25e"


class Timed(NamedTuple):
    """The processor times of a flight and of the bare loop beside it, s."""

    flown: list[float]
    bare: list[float]
    compiled: list[float]  # by compiled steps

    def ratios(self, flown: Sequence[float]) -> list[float]:
        return [f / b for f, b in zip(flown, self.bare, strict=True)]

    def over(self, other: "Timed | None" = None) -> float:
        """How much longer the flight takes than bare JSBSim, or by how much more than another flight does, s."""
        more = statistics.median(f - b for f, b in zip(self.flown, self.bare, strict=True))
        return more - (other.over() if other else 0.0)


def cases(duration: float) -> dict[str, tuple[Flight, str]]:
    """The flights, and what is asked of each."""
    plain = Flight(plant="sixdof", aircraft=AIRFRAME, law=law("nftsm", "paper_1"), duration=duration)
    turbulent, filtered = Wind(turbulence="moderate"), Estimator(kind="ekf")
    return {
        "still air, target known, 20 Hz": (plain, "1.12"),
        "moderate turbulence at every step": (replace(plain, wind=turbulent), ""),
        "EKF at 2 Hz": (replace(plain, estimator=filtered), ""),
        "moderate turbulence and EKF": (replace(plain, wind=turbulent, estimator=filtered), "1.2"),
        "still air, target known, 50 Hz": (replace(plain, guidance_period=0.02), "1.35"),
    }


def timed(flight: Flight, pairs: int) -> Timed:
    """The flight and the bare loop, in turn; each with another seed, so that no air or estimate is known before."""
    found = Timed([], [], [])
    assert not engine.why_plain(flight)
    for i in range(pairs):
        found.bare.append(bare_loop(flight))
        found.flown.append(seconds(partial(simulate, replace(flight, seed=2 * i))))
        found.compiled.append(seconds(partial(engine.simulate, replace(flight, seed=2 * i + 1))))
    return found


class Adopted(NamedTuple):
    """Processor times of an adopted aircraft, s: of a flight, and of as many steps of bare JSBSim."""

    name: str
    flown: list[float]
    looped: list[float]  # the model with its inner loop
    model: list[float]  # the model with its inner loop off

    def over(self, bare: Sequence[float]) -> str:
        """Times the bare loop."""
        return spread([f / b for f, b in zip(self.flown, bare, strict=True)])


def adopted(name: str, pairs: int, duration: float) -> Adopted:
    """Adopts a model that comes with JSBSim, and times its flight on the circle that suits it, without its start."""
    with TemporaryDirectory(prefix="harness-") as folder:
        for _ in adopt(name, Path(folder), Wish()):
            pass
        flight = replace(load_flight(Path(folder) / name / "circle.toml"), duration=duration)
        plant = SixDof(aircraft.folder(flight.aircraft), flight.step, rate_trim=True)
        found = Adopted(name, [], [], [])
        for _ in range(pairs):
            starting = seconds(partial(plant.start, flight.start, air_of(flight)))
            found.flown.append(seconds(partial(simulate, flight)) - starting)
            for times, engaged in ((found.looped, 1.0), (found.model, 0.0)):
                fdm = plant.start(flight.start, air_of(flight)).fdm
                fdm["inner-loop/engaged"] = fdm["actuators/engaged"] = engaged
                times.append(seconds(partial(_run, fdm, round(duration / flight.step))))
    return found


def _run(fdm: Fdm, steps: int) -> None:
    for _ in range(steps):
        fdm.run()


def page_of_adopted(found: Sequence[Adopted]) -> Iterator[str]:
    """The section on adopted aircraft, in Markdown."""
    yield "\n## Adopted aircraft\n"
    yield "Models that come with JSBSim, by `harness adopt`, on the circle that suits them, 20 Hz, without the start."
    yield "*With* and *without*: times as many steps of bare JSBSim with the inner loop running, and with it off.\n"
    rows = [(each.name, each.over(each.looped), each.over(each.model), spread(each.flown)) for each in found]
    yield from markdown(("model", "times with, 1.3 asked at most", "times without", "s"), rows, "lr")


def page(
    flights: Mapping[str, tuple[Flight, str]], found: Mapping[str, Timed], starts: list[float], load: str
) -> Iterator[str]:
    """The page, in Markdown; `load` is what the machine did beside them."""
    (plain, _), *_ = flights.values()
    still, turbulent, filtered, _, quick = found.values()
    steps = round(plain.duration / plain.step)
    filterings = round(plain.duration / plain.estimator.period)
    periods = plain.periods
    more_periods = round(plain.duration / 0.02) - periods
    yield "# What a flight costs"
    yield "\n`make bench` measures it; `python -m benchmarks.performance` writes this page (a few minutes).\n"
    yield (
        f"Machine: {os.cpu_count()} processors, {platform.machine()}, Python {platform.python_version()}, "
        f"NumPy {np.__version__}, JSBSim {jsbsim.__version__}; {load}."
    )
    yield (
        f"A flight of `{AIRFRAME}` with `nftsm` for {plain.duration:g} s, in steps of {plain.step:g} s, that logs "
        f"{len(COLUMNS)} channels at every guidance period."
    )
    yield "Beside it a bare loop that does nothing but `fdm.run()`, as often, on the same trimmed model in still air."
    yield f"Processor time, in turn; medians and ranges of {len(still.flown)} pairs.\n"
    rows = [
        (name, asked, spread(each.ratios(each.compiled)), spread(each.ratios(each.flown)), spread(each.flown))
        for (name, (_, asked)), each in zip(flights.items(), found.values(), strict=True)
    ]
    yield from markdown(("flight", "asked at most", "times the bare loop, compiled", "in Python", "s"), rows, "lr")
    yield "\n*Compiled*: with [compiled steps](guide/many_flights.md#compiled-flights), as many flights are flown; one"
    yield "flight is flown in Python."
    yield f"\nBuilding, loading and trimming takes {spread(starts, 1e3)} ms; 2.5 ms are asked."
    yield "[Compiled flights](guide/many_flights.md#compiled-flights) are those of the other plants;"
    yield "[other simulators](answers/other_simulators.md) fly beside this one on a page of their own.\n"
    yield "## Where the time goes\n"
    yield "From differences of the medians above, in Python:\n"
    parts = (
        (f"JSBSim, a step of {1e3 * plain.step:g} ms", statistics.median(still.bare) / steps),
        ("observation, law, command and record, a guidance period", still.over() / periods),
        ("the same, of the further periods at 50 Hz", quick.over(still) / more_periods),
        ("turbulence, a step: made before the flight, and written to JSBSim", turbulent.over(still) / steps),
        ("measurement and EKF, an update, with its share of the periods between", filtered.over(still) / filterings),
    )
    yield from markdown(("part", "µs"), [(name, f"{1e6 * value:.2f}") for name, value in parts], "lr")


def calls_alone(flight: Flight) -> float:
    """Processor time of what JSBSim, filterpy and NumPy are asked for in this flight, and of nothing else, s.

    The air is made and the filter updated; at each step the heading is read, six numbers are written, JSBSim steps; at
    each period the state is read and the command of the flight is written. There is no law, no observation, no log.
    """
    commands = engine.simulate(flight)["heading_rate_command"].tolist()
    fdm = SixDof(aircraft.folder(flight.aircraft), flight.step, rate_trim=True).start(flight.start, air_of(flight)).fdm
    gusts = [f"atmosphere/gust-{axis}-fps" for axis in ("north", "east", "down")]
    a, b, c, d, e, f = (node(fdm, name).set_double_value for name in (*gusts, *(f"gust/{x}-rad_sec" for x in "pqr")))
    heading, command = node(fdm, "attitude/psi-rad"), node(fdm, "inner-loop/command/heading-rate-rad_s")
    psi, give, run = heading.get_double_value, command.set_double_value, fdm.run
    # the state, and the velocity north and east for the heading now and a step before
    readers = [node(fdm, name).get_double_value for name in (*READ, *4 * ("velocities/v-north-fps",))]
    filterings, steps = round(flight.duration / flight.estimator.period), round(flight.guidance_period / flight.step)
    again = replace(flight, seed=flight.seed + 1)  # the air of this one is known by now

    def fly() -> None:
        kalman = flight.estimator.start()
        for _ in range(filterings):
            kalman.update(Measurement(100.0, 0.3))
        air = air_of(again)
        table = np.column_stack([air.gusts, air.rotation(1.0)])[:, :6]
        rows = chain.from_iterable(
            zip(*table[k : k + 1000].T.tolist(), strict=True) for k in range(0, len(table), 1000)
        )
        for rate in commands[1:]:
            give(rate)
            for W_x, W_y, W_z, p, q, r in islice(rows, steps):
                psi()
                a(W_x)
                b(W_y)
                c(W_z)
                d(p)
                e(q)
                f(r)
                run()
            for read in readers:
                read()

    return seconds(fly)


def least_of_turbulence(flight: Flight, pairs: int) -> str:
    """What a flight in turbulence with an EKF takes at least, in Markdown."""
    ratios = []
    for i in range(pairs):
        bare = bare_loop(flight)
        ratios.append(calls_alone(replace(flight, seed=100 + 2 * i)) / bare)
    return (
        "\nA loop that only asks JSBSim, filterpy and NumPy for what the flight with turbulence and EKF asks them for, "
        f"without law, observation and log, takes {spread(ratios)} times the bare loop. A flight with "
        "these calls cannot take less. JSBSim's Python package reads and writes one number at a time."
    )


def alone(flight: Flight) -> Iterator[str]:
    """The parts of a guidance period, each again and again, in Markdown."""
    flying = SixDof(aircraft.folder(flight.aircraft), flight.step, rate_trim=True).start(flight.start, air_of(flight))
    target, wind = flight.target.start()(0.0), flight.wind.steady
    law = loop.begun(flight.law, context_of(flight))
    seen = loop.observe(flying.state, flight.start.airspeed, wind, target)
    row, answer = bytearray(loop._ROW_BYTES), law(seen)
    parts: dict[str, Callable[[], object]] = {
        "reading the state from JSBSim": partial(flying.read, 0.0),
        "observation": partial(loop.observe, flying.state, flight.start.airspeed, wind, target),
        "law": partial(law, seen),
        "record": lambda: loop._write_row(row, 0, 0.0, *flying.state, *target, *answer),
    }
    times = {name: least(work, 4000) for name, work in parts.items()}
    yield "\nThe parts of a guidance period, each again and again, so that the processor's cache holds what it needs:\n"
    yield from markdown(("part", "µs"), [(name, f"{time:.2f}") for name, time in times.items()], "lr")
    yield "\nIn a flight they take longer, since they run between two stretches of JSBSim, which needs the cache, too."


def main(
    pairs: int = 5, duration: float = 900.0, *, path: Path = PAGE, models: Sequence[str] = ("c172p", "T38", "dr1")
) -> None:
    """Measures, and writes the page."""
    flights, load = cases(duration), busy()
    found = {}
    for name, (flight, _) in flights.items():
        found[name] = timed(flight, pairs)
        print(f"{name}: {spread(found[name].ratios(found[name].compiled))} times the bare loop, compiled", flush=True)
    (plain, _), _, _, (both, _), _ = flights.values()
    plant = SixDof(aircraft.folder(AIRFRAME), plain.step, rate_trim=True)
    starts = [seconds(partial(plant.start, plain.start, air_of(plain))) for _ in range(20)][1:]
    lines = [
        *page(flights, found, starts, load),
        *alone(plain),
        least_of_turbulence(both, pairs),
        *section(plain, pairs),
        *page_of_adopted([adopted(name, pairs, duration) for name in models]),
    ]
    write_text(path, "\n".join(lines) + "\n")
    print(path)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
