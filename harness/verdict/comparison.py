"""A comparison: everything that the flights of one directory say of the plants, computed once for all its readers."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from harness.margins import Assess
from harness.metric import METRICS
from harness.plants.ladder import BASELINE, rung
from harness.verdict.attribution import Attribution, attributions
from harness.verdict.pairs import FAILED, Pairs, axes, change, entered, ordered, plant_pairs, spread, varying
from harness.verdict.parts import with_quantities
from harness.verdict.scorecard import Scorecard, scorecards
from harness.verdict.statistics import Effect, effect


@dataclass(frozen=True, slots=True)
class Row:
    """A metric of one airframe under one law: the means of the pairs that say something of it, their difference."""

    aircraft: str
    law: str
    plant: str
    metric: str
    reference: float  # NaN where the baseline has no such thing
    other: float
    difference: Effect


@dataclass(frozen=True, slots=True)
class Left:
    """A flight that is in no pair."""

    key: str
    outcome: str
    settings: Mapping[str, object]  # those that vary


@dataclass(frozen=True, slots=True)
class Comparison:
    """What `harness compare` prints and `harness report` draws."""

    baseline: str
    assess: Assess
    flights: int
    pairs: Pairs  # as they entered
    unpaired: tuple[Left, ...]
    failed: tuple[Left, ...]
    rows: tuple[Row, ...]
    scorecards: tuple[Scorecard, ...]  # from the top of the ladder down
    attributions: tuple[Attribution, ...]

    @property
    def last_plant(self) -> str:
        """The plant furthest up the ladder: the one the answer is about."""
        return max((card.plant for card in self.scorecards), key=rung)

    @property
    def plants(self) -> list[str]:
        """All but the baseline, up the ladder."""
        return sorted({card.plant for card in self.scorecards}, key=rung)

    @property
    def answering(self) -> list[Scorecard]:
        """Its scorecards."""
        return [card for card in self.scorecards if card.plant == self.last_plant]


def compare(flights: pd.DataFrame, assess: Assess, baseline: str = BASELINE) -> Comparison:
    """Of a directory's flights. Raises `CompareError` with what is missing."""
    table = with_quantities(entered(flights, assess.circling_error))
    paired = plant_pairs(table, baseline)
    failed = table["outcome"].isin(FAILED)
    return Comparison(
        baseline,
        assess,
        len(flights),
        paired,
        tuple(_left(paired.unpaired, table)),
        tuple(_left(table[failed], table)),
        tuple(_rows(paired)),
        tuple(sorted(scorecards(paired, assess, baseline), key=lambda card: -rung(card.plant))),
        tuple(attributions(table[~failed])),
    )


def _left(those: pd.DataFrame, table: pd.DataFrame) -> Iterator[Left]:
    columns = varying(table)
    for _, flight in those.iterrows():
        yield Left(str(flight["key"]), str(flight["outcome"]), {column: flight[column] for column in columns})


def _rows(paired: Pairs) -> Iterator[Row]:
    named = spread(paired.other)
    law = named["law"] if "law" in named else pd.Series("", index=named.index)
    kinds = pd.DataFrame({"aircraft": paired.other["aircraft"], "law": law, "plant": paired.other["plant"]})
    for aircraft, label, plant in (
        kinds.drop_duplicates().sort_values(["aircraft", "law", "plant"]).itertuples(index=False)
    ):
        those = paired.where((kinds == [aircraft, label, plant]).all(axis=1))
        for metric in (name for name, declared in METRICS.items() if declared.compared):
            reference, other = those.reference[metric].to_numpy(float), those.other[metric].to_numpy(float)
            if np.isnan(other).all():
                continue
            values = change(those, metric)
            counts = ~np.isnan(values) | np.isnan(reference)  # what the baseline has not is told of the plant alone
            found = effect(values, those.other["seed"].to_numpy(), metric)
            means = _mean(reference[counts]), _mean(other[counts])
            yield Row(str(aircraft), str(label), str(plant), metric, *means, found)


def _mean(values: Sequence[float] | np.ndarray) -> float:
    there = np.asarray(values)[~np.isnan(values)]
    return float(there.mean()) if len(there) else float("nan")


def axes_of(comparison: Comparison) -> dict[str, list[object]]:
    """What was set to several values on any airframe, and the airframes."""
    flights = spread(comparison.pairs.other)
    airframes = ordered(flights["aircraft"])
    found = {"aircraft": airframes} if len(airframes) > 1 else {}
    for _, of in flights.groupby("aircraft"):
        for axis in axes(of):
            found.setdefault(axis, ordered(flights[axis]))
    return found
