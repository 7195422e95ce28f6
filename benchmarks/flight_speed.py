"""The cost of a flight beside the bare simulation: `python -m benchmarks.flight_speed [PAIRS [SECONDS]]`.

A 6-DOF flight of 900 s, or as long as asked (0.005 s steps, 20 Hz guidance, every channel logged at 20 Hz), against a
bare loop of as many steps of the same trimmed model with its inner loop engaged, in turn; a kinematic flight of 100 s;
building and trimming. Processor time, so that other processes on the machine disturb less; the median and the range of
the pairs are printed.
"""

import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import aircraft
from autopilot.laws import law
from harness.flight import Flight, air_of
from harness.log import COLUMNS
from harness.loop import simulate
from harness.plants.model import load
from harness.plants.sixdof import SixDof, engage, trim

AIRFRAMES = ("ultra_stick_25e", "skywalker_x8")


def seconds(work: Callable[[], object]) -> float:
    """Processor time of one call."""
    begin = time.process_time()
    work()
    return time.process_time() - begin


def bare_loop(flight: Flight) -> float:
    """Processor time of the flight's steps with nothing but JSBSim in the loop."""
    fdm = load(aircraft.folder(flight.aircraft), flight.step)
    engage(fdm, trim(fdm, flight.start, air_of(flight)), flight.start, rate_trim=True)
    steps = round(flight.duration / flight.step)

    def run() -> None:
        for _ in range(steps):
            fdm.run()

    return seconds(run)


def spread(values: list[float], scale: float = 1.0) -> str:
    """Median and range."""
    return f"{scale * statistics.median(values):.3f} ({scale * min(values):.3f} to {scale * max(values):.3f})"


def main(pairs: int = 5, duration: float = 900.0) -> None:
    """Print the ratios and times."""
    sixdof = Flight(plant="sixdof", law=law("nftsm", "paper_1"), duration=duration)
    kinematic = replace(sixdof, plant="kinematic", duration=100.0)
    print(f"{pairs} pairs, {len(COLUMNS)} channels")
    for name in AIRFRAMES:
        flight = replace(sixdof, aircraft=name)
        bare, flown = [], []
        for _ in range(pairs):
            bare.append(bare_loop(flight))
            flown.append(seconds(partial(simulate, flight)))
        ratios = [f / b for f, b in zip(flown, bare, strict=True)]
        print(f"{name}: {duration:g} s flight / bare loop {spread(ratios)}; flight {spread(flown)} s")
        plant = SixDof(aircraft.folder(name), flight.step, rate_trim=True)
        built = [seconds(partial(plant.start, flight.start, air_of(flight))) for _ in range(20)]
        print(f"{name}: build, load and trim {spread(built[1:], 1e3)} ms after the first ({1e3 * built[0]:.1f} ms)")
    simulate(kinematic)
    print(
        f"kinematic: 100 s flight {spread([seconds(partial(simulate, kinematic)) for _ in range(4 * pairs)], 1e3)} ms"
    )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
