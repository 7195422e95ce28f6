"""Made-up flights whose comparison is known: rows as `harness.load_results` gives them."""

import itertools
import math
from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd

from harness.metric import MEANING

SEEDS = 12
PLANTS = ("kinematic", "sixdof")
QUIET = {
    **dict.fromkeys(MEANING, 0.0), "convergence_time_s": 40.0, "heading_rate_gain": 1.0, "turn_ratio": 1.0,
    "heading_rate_lag_s": 0.001,
}  # fmt: skip


def flight(plant: str, seed: int = 0, metrics: Mapping[str, float] = QUIET, **settings: object) -> dict[str, object]:
    base = {
        "plant": plant, "aircraft": "ultra_stick_25e", "seed": seed, "duration_s": 100.0, "guidance_period_s": 0.05,
        "law.name": "smc", "law.gains": "paper", "law.k2": math.nan, "law.max_heading_rate_deg_s": 5.0,
        "law.airspeed": "nominal", "law.standoff_m": 200.0, "start.airspeed_mps": 13.0,
        "start.heading_deg": 30.0 + seed,
        "wind.steady_mps": (0.0, 0.0), "wind.turbulence": "none", "estimator.kind": "truth",
        **settings,
    }  # fmt: skip
    key = "-".join(map(str, base.values()))
    results = {"key": key, "outcome": "completed", "reason": "", "digest": key, "feasibility_margin_deg_s": 1.0}
    return {**results, "seconds": 0.1, **base, **metrics}


def table(rows: Iterator[dict[str, object]] | list[dict[str, object]]) -> pd.DataFrame:
    return pd.DataFrame(list(rows))


def over(**axis: list[object]) -> pd.DataFrame:
    """All flights of a matrix, quiet on every plant; each metric moves a little with the seed alone."""
    settings = {"plant": list(PLANTS), "seed": list(range(SEEDS)), **axis}
    flights = []
    for values in itertools.product(*settings.values()):
        chosen = dict(zip(settings, values, strict=True))
        flights.append(flight(**{key.replace("__", "."): value for key, value in chosen.items()}))
    return table(flights)


def moved(flights: pd.DataFrame, metric: str, by: float, scatter: float = 0.01, **where: object) -> pd.DataFrame:
    """The metric of the 6-DOF flights that are set so moves by so much, more or less."""
    flights = flights.copy()
    chosen = flights["plant"] == "sixdof"
    for key, value in where.items():
        chosen &= flights[key.replace("__", ".")] == value
    seeds = flights["seed"][chosen]
    flights.loc[chosen, metric] += by + scatter * np.random.default_rng(3).normal(size=SEEDS)[seeds]
    return flights
