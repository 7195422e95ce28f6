"""A comparison: everything that flights which differ in one setting say, computed once for all its readers."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import pandas as pd

from harness.limit_cycle.predicted import MARGIN
from harness.log.metric import METRICS
from harness.margins import Assess
from harness.plants.ladder import BASELINE
from harness.settings.laws import short_names
from harness.verdict.conditions import Conclusion, conclude
from harness.verdict.following import with_predicted
from harness.verdict.judgement import Judgement, frame, judged
from harness.verdict.pairs import (
    FAILED,
    Pairs,
    axes,
    cells,
    entered,
    ordered,
    pairs_by,
    shown,
    spread,
    varying,
)
from harness.verdict.parts import PARTS, Part, with_shares
from harness.verdict.statistics import Share, share


@dataclass(frozen=True)
class Scorecard:
    """One airframe under one value of what is compared: the family in which errors are kept."""

    aircraft: str
    value: str
    pairs: int
    seeds: int
    lost: Share
    axes: Mapping[str, Sequence[object]]
    judgements: tuple[Judgement, ...]

    def of(self, column: str) -> list[Judgement]:
        """The judgements of one quantity, cell by cell."""
        return [judgement for judgement in self.judgements if judgement.column == column]

    @property
    def parts(self) -> list[Part]:
        """The parts that were judged, in their order."""
        known = {judgement.column for judgement in self.judgements if judgement.has_margin}
        return [part for part in PARTS.values() if part.column in known]

    def conclusion(self, column: str) -> Conclusion:
        """The conclusion on a part from all cells; cached, since with many cells it takes seconds."""
        if column not in self._concluded:
            self._concluded[column] = conclude(self.of(column), self.axes)
        return self._concluded[column]

    @cached_property
    def _concluded(self) -> dict[str, Conclusion]:
        return {}


@dataclass(frozen=True, slots=True)
class Unpaired:
    """A flight that is in no pair, and why."""

    key: str
    outcome: str
    why: str
    settings: Mapping[str, object]  # those that vary


@dataclass(frozen=True)
class Comparison:
    """Flights that differ in one setting alone, `by`, compared.

    - `answer`: text: what was compared, and each part of the assumption, or each metric that differs, with its worst
      cell.
    - `differences`: one row per metric, value of `by` and cell, with the columns `metric` (its unit is its suffix),
      `value`, one for each axis that varies, `pairs`, `seeds`, `lost`, `reference`, `other`, `difference` (mean of the
      seeds, other minus reference, or minus what the assumption says), `low` and `high` (its 95 % interval; NaN without
      one), `verdict` (holds, fails or undecided where there is a margin; lower, higher or undecided without), `why` it
      is undecided, and the `seeds_needed` to decide it.
    - `conditions`: where matched cells prove that a part holds or fails: `metric`, `value`, `aircraft`, `verdict`,
      `condition`, `cells`.
    """

    by: str  # the setting
    baseline: str
    assess: Assess
    flights: int
    pairs: Pairs
    unpaired: tuple[Unpaired, ...]
    scorecards: tuple[Scorecard, ...]
    table: pd.DataFrame = field(repr=False)  # the flights as they entered
    question: str = ""  # of the experiment
    changed: tuple[str, ...] = ()  # beside the settings, where directories are compared: files, physics, libraries

    @property
    def assumption(self) -> bool:
        """Whether it tests the coordinated-flight assumption: plants against the one that the paper assumes."""
        return self.by == "plant" and self.baseline == BASELINE

    @cached_property
    def axes(self) -> dict[str, list[object]]:
        """The settings with several values on any airframe."""
        several: dict[str, list[object]] = {}
        table = spread(self.pairs.other)
        if table["aircraft"].nunique() > 1 and self.by != "aircraft":
            several["aircraft"] = ordered(table["aircraft"])
        for card in self.scorecards:
            for axis in card.axes:
                several.setdefault(axis, ordered(table[axis]))
        return several

    @property
    def values(self) -> list[str]:
        """The values beside the baseline, in order."""
        return list(dict.fromkeys(card.value for card in self.scorecards))

    @cached_property
    def differences(self) -> pd.DataFrame:
        """One row per metric, value of the setting and cell, with its interval and its verdict."""
        judgements = [j for card in self.scorecards for j in card.judgements]
        named = [(j, {"aircraft": card.aircraft, **j.at}) for card in self.scorecards for j in card.judgements]
        table = frame(judgements, [])
        for axis in reversed(list(self.axes)):
            table.insert(2, axis, [at.get(axis) for _, at in named])
        return table

    @cached_property
    def conditions(self) -> pd.DataFrame:
        """Where a part holds or fails: metric, value, aircraft, verdict, condition, cells."""
        rows = []
        for card in self.scorecards:
            for part in card.parts:
                condition = card.conclusion(part.column).condition
                if condition:
                    rows.append((part.column, card.value, card.aircraft, condition.word, condition.text,
                                 condition.cells))  # fmt: skip
        return pd.DataFrame(rows, columns=["metric", "value", "aircraft", "verdict", "condition", "cells"])

    @property
    def answer(self) -> str:
        """The answer in words."""
        from harness.verdict.answer import sentences  # which reads comparisons

        return "\n".join(sentences(self))

    @property
    def others(self) -> list[Scorecard]:
        """The scorecards of the other values, the furthest from the baseline first."""
        return [card for card in reversed(self.scorecards) if card.value != self.values[-1]]

    @property
    def answering(self) -> list[Scorecard]:
        """The scorecards of the value furthest from the baseline: those that the answer is about."""
        return [card for card in self.scorecards if card.value == self.values[-1]]


def compare_flights(
    flights: pd.DataFrame,
    assess: Assess,
    by: str = "plant",
    baseline: object = None,
    question: str = "",
    changed: tuple[str, ...] = (),
) -> Comparison:
    """Flights of a table as `load_results` gives it, those that differ in `by` alone, paired.

    `baseline` is the value that the others are compared with; without it the lowest plant, else the first value.
    Raises `CompareError` with what is missing.
    """
    if baseline is None:
        baseline = ordered(flights[by])[0]
    assumption = by == "plant" and shown(baseline) == BASELINE
    predicted = (*(("heading_rate_gain_slow",) if assumption else ()), MARGIN)
    table = with_shares(entered(with_predicted(flights, predicted), assess.circling_error))
    laws = short_names(table["law.name"])
    table["law.name"] = table["law.name"].map(laws)
    baseline = laws.get(str(baseline), baseline) if by == "law.name" else baseline
    paired = pairs_by(table, by, baseline)
    failed = table["outcome"].isin(FAILED)
    return Comparison(
        by,
        shown(baseline),
        assess,
        len(flights),
        paired,
        (*_unpaired(paired.unpaired, table, "without a partner"), *_unpaired(table[failed], table, "failed")),
        tuple(_scorecards(paired, by, assess, assumption=assumption)),
        table,
        question,
        changed,
    )


def _scorecards(pairs: Pairs, by: str, assess: Assess, *, assumption: bool) -> Iterator[Scorecard]:
    """One per value and airframe."""
    columns = [*(name for name, metric in METRICS.items() if metric.compared), *PARTS]
    columns = list(dict.fromkeys(columns))
    rows = pairs.other.groupby([pairs.other[by].map(shown), "aircraft"], sort=False).indices
    for value in map(shown, ordered(pairs.other[by])):
        for aircraft in ordered(pairs.other["aircraft"]):
            if (value, aircraft) not in rows:
                continue
            those = pairs.take(np.asarray(rows[value, aircraft], np.intp))
            across = axes(spread(those.other), {by, "aircraft", *_covered(by)})
            found = cells(those, across)
            yield Scorecard(
                aircraft=str(aircraft),
                value=value,
                pairs=len(those),
                seeds=int(those.other["seed"].nunique()),
                lost=share(those.lost, those.seeds, drawn=any(cell.drawn for cell in found)),
                axes=across,
                judgements=tuple(judged(those, found, columns, value, assess, assumption=assumption)),
            )


def _covered(by: str) -> list[str]:
    """The axis that the compared setting is part of."""
    whole = {"law.name": "law", "law.gains": "law", "wind.steady_mps": "wind_speed_mps"}
    return [whole[by]] if by in whole else []


def _unpaired(flights: pd.DataFrame, table: pd.DataFrame, why: str) -> Iterator[Unpaired]:
    columns = varying(table)
    for _, flight in flights.iterrows():
        yield Unpaired(str(flight["key"]), str(flight["outcome"]), why, {column: flight[column] for column in columns})
