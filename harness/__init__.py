"""Flies a guidance law on a kinematic and on a 6-DOF aircraft, and measures whether coordinated flight holds.

A flight is a frozen value: make one with `Flight` and `law`, or read one with `load_flight`; change a copy with
`dataclasses.replace`. `simulate(flight)` flies it and gives a `FlightLog`, which has `.frame()`, `.metrics` and
`.plot()`; `record` writes it for the Rerun viewer, `read_flight` reads it back.

`run(path, out=...)` flies a matrix of flights, `load_results(dir)` reads its table, `compare(dir)` compares the flights
that differ only in the plant.

Inside, everything is SI and radians; the world is north-east-down from the flight's origin, headings are clockwise from
north, a wind is the velocity of the air (towards). Paths are `str` or `Path`. The harness's errors have the
base `HarnessError`.

>>> import math, dataclasses, harness
>>> flight = harness.Flight(
...     plant="sixdof",
...     law=harness.law("nftsm", max_heading_rate=math.radians(10.0)),
...     wind=harness.Wind(steady=(3.0, 0.0)),
... )
>>> log = harness.simulate(flight)
>>> log.plot(harness.simulate(dataclasses.replace(flight, plant="kinematic")))
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from autopilot.estimator import Estimator
    from autopilot.guidance import Context, Guidance, Law, Observation
    from harness.comparison import compare
    from harness.error import ArgumentError, HarnessError, RecordingError, SettingsError
    from harness.flight import Flight, InnerLoop, MetricSettings
    from harness.flight_errors import Errors
    from harness.interface import law, metrics, read_flight, record, run, show, simulate
    from harness.log import FlightLog
    from harness.margins import Assess
    from harness.plants.plant import Outcome, PlantError, Start
    from harness.review.viewer import ViewerError
    from harness.runs.journal import StoreError
    from harness.runs.results import load_results
    from harness.runs.workers import WorkersError
    from harness.settings import load_flight
    from harness.verdict.comparison import Comparison
    from harness.verdict.pairs import CompareError
    from harness.world.target import Segment, Target
    from harness.world.track import TrackError
    from harness.world.wind import Gust, Wind

__all__ = [
    "ArgumentError",
    "Assess",
    "CompareError",
    "Comparison",
    "Context",
    "Errors",
    "Estimator",
    "Flight",
    "FlightLog",
    "Guidance",
    "Gust",
    "HarnessError",
    "InnerLoop",
    "Law",
    "MetricSettings",
    "Observation",
    "Outcome",
    "PlantError",
    "RecordingError",
    "Segment",
    "SettingsError",
    "Start",
    "StoreError",
    "Target",
    "TrackError",
    "ViewerError",
    "Wind",
    "WorkersError",
    "compare",
    "law",
    "load_flight",
    "load_results",
    "metrics",
    "read_flight",
    "record",
    "run",
    "show",
    "simulate",
]

# The module of each name, which is imported at its first use: `harness --help` needs none of them.
_HOMES = {
    "autopilot.estimator": ["Estimator"],
    "autopilot.guidance": ["Context", "Guidance", "Law", "Observation"],
    "harness.comparison": ["compare"],
    "harness.error": ["ArgumentError", "HarnessError", "RecordingError", "SettingsError"],
    "harness.flight": ["Flight", "InnerLoop", "MetricSettings"],
    "harness.flight_errors": ["Errors"],
    "harness.interface": ["law", "metrics", "read_flight", "record", "run", "show", "simulate"],
    "harness.log": ["FlightLog"],
    "harness.margins": ["Assess"],
    "harness.plants.plant": ["Outcome", "PlantError", "Start"],
    "harness.review.viewer": ["ViewerError"],
    "harness.runs.results": ["load_results"],
    "harness.runs.store": ["StoreError"],
    "harness.runs.workers": ["WorkersError"],
    "harness.settings": ["load_flight"],
    "harness.verdict.comparison": ["Comparison"],
    "harness.verdict.pairs": ["CompareError"],
    "harness.world.target": ["Segment", "Target"],
    "harness.world.track": ["TrackError"],
    "harness.world.wind": ["Gust", "Wind"],
}


if not TYPE_CHECKING:  # to a type checker any name would be there

    def __getattr__(name: str) -> Any:
        for home, names in _HOMES.items():
            if name in names:
                if message := import_module("harness.neighbours").in_the_way():
                    raise ImportError(message)
                value = globals()[name] = getattr(import_module(home), name)
                return value
        raise AttributeError(f"module 'harness' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})
