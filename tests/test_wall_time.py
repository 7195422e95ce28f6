"""How long a run still takes, replayed from durations that were measured: no test waits, or depends on the machine."""

import csv
import heapq
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from autopilot.estimator import Estimator
from harness.flight import Flight
from harness.runs.wall_time import TimeLeft, typical_wall_time
from harness.world.wind import Wind
from tests.builders import FLIGHT

# Measured by `harness run` with two workers, in the order of the matrix: flights of 30, of 100 and of 200 s, the last
# in turbulence, on every plant, with and without a filter. The first flights of a worker import libraries.
MEASURED = Path(__file__).with_name("durations.csv")


def measured() -> Iterator[tuple[Flight, float]]:
    with MEASURED.open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            wind, estimator = Wind(turbulence=row["wind.turbulence"]), Estimator(kind=row["estimator.kind"])
            flight = replace(FLIGHT, plant=row["plant"], duration=float(row["duration_s"]))
            yield replace(flight, wind=wind, estimator=estimator), float(row["seconds"])


@pytest.mark.parametrize("workers", [1, 2, 4])
@pytest.mark.parametrize("slower", [1.0, 6.0])
@pytest.mark.parametrize("between", [0.0, 0.3])
def test_the_time_left_is_told_within_a_factor_of_one_and_a_half_once_a_tenth_is_flown(
    workers: int, slower: float, between: float
) -> None:
    """`slower` is the machine; `between` is what a worker spends beside each flight, as a share of it."""
    flights = [(flight, seconds * slower) for flight, seconds in measured()]
    typical: dict[str, float] = {}
    for flight, _ in flights:
        typical[flight.plant] = typical.get(flight.plant, 0.0) + typical_wall_time(flight)
    left = TimeLeft(typical, workers)
    free, back = [0.0] * workers, []
    for flight, seconds in flights:  # each worker takes the next flight when it is free
        end = heapq.heappop(free) + seconds * (1.0 + between)
        heapq.heappush(free, end)
        back.append((end, flight, seconds))
    back.sort(key=lambda one: one[0])
    end = back[-1][0]
    assert left.seconds(0.0) is None
    told = []
    for number, (now, flight, seconds) in enumerate(back, 1):
        left.learn(flight, seconds, now)
        if len(back) // 10 <= number <= len(back) * 9 // 10:
            told.append((left.seconds(now) or 0.0) / (end - now))
    assert max(told) < 1.5
    assert min(told) > 1.0 / 1.5
    assert left.seconds(end) == pytest.approx(0.0, abs=1e-9)
