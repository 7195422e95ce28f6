"""What each rung of the ladder of plants adds, and each disturbance: mean paired differences, with sign.

Only quantities of the path are compared: on a circle a position at equal times means nothing. Along the ladder the
same scenarios count on every rung, so the steps add up to the whole.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import pairwise
from types import MappingProxyType

import numpy as np
import pandas as pd

from harness.metric import METRICS as ALL_METRICS
from harness.plants.ladder import PLANTS, rung
from harness.verdict.pairs import REFERENCE, change, ordered, pairs, settings_of, spread
from harness.verdict.statistics import Effect, effect

METRICS: Mapping[str, tuple[str, str]] = MappingProxyType(  # what the law is judged by: its heading and unit
    {m.name: (m.heading, m.label) for m in ALL_METRICS.values() if m.of_circling and m.in_short_tables}
)


@dataclass(frozen=True, slots=True)
class Disturbance:
    """Something that a setting adds to the reference conditions."""

    name: str
    keys: tuple[str, ...]  # that change with it, and nothing else
    shown: str  # the column of `spread` that tells how much


DISTURBANCES = (
    Disturbance("wind", ("wind.steady_mps",), "wind_speed_mps"),
    Disturbance("turbulence", ("wind.turbulence",), "wind.turbulence"),
    Disturbance("sampling", ("guidance_period_s",), "guidance_period_s"),
    Disturbance("estimator", ("estimator.kind",), "estimator.kind"),
    Disturbance("airspeed used", ("law.airspeed",), "law.airspeed"),
)


@dataclass(frozen=True, slots=True)
class Step:
    """What one thing adds to a metric."""

    metric: str
    what: str
    plant: str
    effect: Effect


@dataclass(frozen=True, slots=True)
class Ladder:
    """A metric from the first rung to the last."""

    metric: str
    start: float
    steps: tuple[Step, ...]
    end: float


@dataclass(frozen=True, slots=True)
class Attribution:
    """Of one airframe under one law."""

    aircraft: str
    law: str
    rungs: tuple[str, ...]
    scenarios: int  # flown on every rung
    ladders: tuple[Ladder, ...]
    disturbances: tuple[Step, ...]


def attributions(flights: pd.DataFrame) -> Iterator[Attribution]:
    """Of the flights as they enter a comparison: one for each airframe and law, in order."""
    named = spread(flights)
    law = named["law"] if "law" in named else pd.Series("", index=named.index)
    for (name, label), _ in flights.groupby([flights["aircraft"], law]):
        yield attribution(flights[(flights["aircraft"] == name) & (law == label)], str(name), str(label))


def attribution(flights: pd.DataFrame, name: str, law: str) -> Attribution:
    """Of one airframe's flights under one law."""
    rungs = tuple(plant for plant in PLANTS if plant in set(flights["plant"]))
    on = _same_scenarios(flights, rungs)
    ladders = tuple(_ladder(metric, on) for metric in METRICS) if len(rungs) > 1 and len(on[rungs[0]]) else ()
    steps = tuple(step for disturbance in DISTURBANCES for step in _disturbed(flights, disturbance, rungs))
    return Attribution(name, law, rungs, len(on[rungs[0]]) if rungs else 0, ladders, steps)


def _same_scenarios(flights: pd.DataFrame, rungs: Sequence[str]) -> dict[str, pd.DataFrame]:
    """Per rung its flights, row by row the same scenario: those that every rung has, and that circle on the first."""
    if not rungs:
        return {}
    first = flights["plant"] == rungs[0]
    if len(rungs) == 1:
        return {rungs[0]: flights[first & flights["circles"]]}
    by_rung = []
    for above in rungs[1:]:
        two = flights[first | (flights["plant"] == above)]
        by_rung.append(pairs(two, ["plant"], two["plant"] == rungs[0]))
    keys = [paired.reference["key"][paired.reference["circles"]].to_numpy() for paired in by_rung]
    common = reduce(np.intersect1d, keys)
    return {
        rungs[0]: by_rung[0].reference.set_index("key", drop=False).loc[common],
        **{
            above: paired.other.set_index(paired.reference["key"]).loc[common]
            for above, paired in zip(rungs[1:], by_rung, strict=True)
        },
    }


def _ladder(metric: str, on: Mapping[str, pd.DataFrame]) -> Ladder:
    """From the first rung to the last; a convergence time over the scenarios in which it says something on any."""
    rungs = list(on)
    if metric == "convergence_time_s":
        says = np.any([on[plant]["converged"] | on[plant]["lost"] for plant in rungs], axis=0)
        on = {plant: on[plant][says] for plant in rungs}
    values = {plant: on[plant][metric].to_numpy(float) for plant in rungs}
    seeds = on[rungs[0]]["seed"].to_numpy()
    steps = tuple(
        Step(metric, _between(below, above), above, effect(values[above] - values[below], seeds, metric))
        for below, above in pairwise(rungs)
    )
    return Ladder(metric, _seed_mean(on[rungs[0]], metric), steps, _seed_mean(on[rungs[-1]], metric))


def _between(below: str, above: str) -> str:
    """What a rung adds to one below it, rungs that were not flown included."""
    return ", ".join(kind.adds for kind in list(PLANTS.values())[rung(below) + 1 : rung(above) + 1])


def _seed_mean(flights: pd.DataFrame, metric: str) -> float:
    """The mean over the seeds' means, as in an `Effect`."""
    return float(flights.groupby("seed")[metric].mean().mean())


def _disturbed(flights: pd.DataFrame, disturbance: Disturbance, rungs: Sequence[str]) -> Iterator[Step]:
    """Each level of the disturbance beside its absence, on the first rung and on the last."""
    present = [key for key in disturbance.keys if key in settings_of(flights)]
    named = spread(flights)
    if not present or disturbance.shown not in named or named[disturbance.shown].nunique() < 2:
        return
    level = named[disturbance.shown]
    values = ordered(level)
    reference = REFERENCE.get(disturbance.shown, values[0])
    for value in (value for value in values if value != reference):
        for plant in dict.fromkeys((rungs[0], rungs[-1])):
            those = flights[(flights["plant"] == plant) & level.isin([value, reference])]
            paired = pairs(those, present, level[those.index] == reference)
            if len(paired):
                what = f"{disturbance.name} {_amount(disturbance, value)}"
                seeds = paired.other["seed"].to_numpy()
                for metric in METRICS:
                    yield Step(metric, what, plant, effect(change(paired, metric), seeds, metric))


def _amount(disturbance: Disturbance, value: object) -> str:
    unit = {"wind": " m/s", "sampling": " s"}.get(disturbance.name, "")
    return f"{value:g}{unit}" if isinstance(value, float) else f"{value}{unit}"
