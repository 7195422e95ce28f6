"""Pairs: flights that differ in one thing only, and how each flight enters their comparison."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from harness.error import HarnessError
from harness.metric import METRICS
from harness.plants.plant import Outcome
from harness.settings.columns import is_setting
from harness.world.wind import SEVERITIES

LOST = (Outcome.GROUND.value, Outcome.DEPARTED.value, Outcome.TARGET_LOST.value)
FAILED = tuple(outcome.value for outcome in Outcome if outcome.failed)
REFERENCE: Mapping[str, object] = MappingProxyType(  # what is undisturbed, by the columns of `spread`
    {"wind_speed_mps": 0.0, "wind.turbulence": "none", "estimator.kind": "truth", "law.airspeed": "nominal"}
)


class CompareError(HarnessError, ValueError):
    """Why these flights cannot be compared, and what is missing."""


@dataclass(frozen=True, slots=True)
class Pairs:
    """Two tables of flights, row by row the same but for one thing; and those left without a partner."""

    reference: pd.DataFrame
    other: pd.DataFrame
    unpaired: pd.DataFrame

    def __len__(self) -> int:
        return len(self.reference)

    def where(self, chosen: pd.Series) -> "Pairs":
        """The pairs that are chosen, by a mask over the rows."""
        rows = chosen.to_numpy()
        return Pairs(self.reference[rows], self.other[rows], self.unpaired)


def settings_of(flights: pd.DataFrame) -> list[str]:
    """The columns that are settings."""
    return [column for column in flights.columns if is_setting(column)]


def varying(flights: pd.DataFrame) -> list[str]:
    """The settings that are not the same in all flights; without single gains that follow from the law and its set."""
    columns = [column for column in settings_of(flights) if flights[column].nunique(dropna=False) > 1]
    known = [column for column in ("law.name", "law.gains") if column in columns]
    laws = joined(flights, known) if known else None
    return [
        c for c in columns if laws is None or c in known or not c.startswith("law.") or not _follows(flights[c], laws)
    ]


def _follows(values: pd.Series, others: Sequence[str]) -> bool:
    """Whether equal others have equal values."""
    return bool(_text(values).groupby(list(others)).nunique().max() == 1)


def plant_pairs(flights: pd.DataFrame, baseline: str) -> Pairs:
    """Every flight beside the one that differs in the plant alone. Raises `CompareError` when there is none."""
    if len(flights) < 2:
        raise CompareError(
            f"{len(flights)} flight in all: a comparison takes at least two, of {baseline} and another plant"
        )
    plants = sorted(set(flights["plant"]))
    if baseline not in plants:
        raise CompareError(
            f"no flight has the baseline's plant, {baseline!r}: there is {_listed(plants)}. Add it to the matrix, "
            f"or name another with --baseline"
        )
    if len(plants) == 1:
        raise CompareError(f"all {len(flights)} flights have plant {baseline!r}: add another plant to the matrix")
    judged = flights[~flights["outcome"].isin(FAILED)]
    paired = pairs(judged, ["plant"], judged["plant"] == baseline)
    if not len(paired):
        raise CompareError(_why_unpaired(judged, baseline) if len(judged) else "every flight failed: nothing to pair")
    return paired


def pairs(flights: pd.DataFrame, differing: Sequence[str], is_reference: pd.Series) -> Pairs:
    """Each flight that is no reference beside the reference that differs from it in `differing` alone."""
    alike = _alike(flights, differing)
    reference = flights[is_reference]
    at = {key: i for i, key in zip(reference.index, alike[is_reference], strict=True)}
    partner = alike[~is_reference].map(at)
    found = partner.dropna()
    left = ~(flights.index.isin(found) | flights.index.isin(found.index))
    return Pairs(
        flights.loc[found.to_numpy()].reset_index(drop=True),
        flights.loc[found.index].reset_index(drop=True),
        flights[left],
    )


def entered(flights: pd.DataFrame, circling: float) -> pd.DataFrame:
    """The flights as they enter a comparison: every number there that a comparison needs.

    A flight circles when it lasts and its settled error is below `circling` times the standoff distance.

    A flight that has not converged when it ends, or has ended early, enters with its duration as convergence time
    (censored). One that ended early (ground, departed, target lost) enters every other metric that its plant has with
    the worst value that there can be, or that any flight here has. An error that never changed sign has overshot by
    nothing.
    """
    table = flights.copy()
    lost = table["outcome"].isin(LOST)
    table["lost"] = lost
    table["circles"] = (table["range_error_rms_m"] <= circling * table["law.standoff_m"]) & ~lost
    table["converged"] = table["convergence_time_s"].notna() & ~lost
    table["convergence_time_s"] = table["convergence_time_s"].where(table["converged"], table["duration_s"])
    table["overshoot_m"] = table["overshoot_m"].fillna(0.0)
    table["range_error_final_m"] = table["range_error_final_m"].abs()
    for name, metric in METRICS.items():
        if name == "convergence_time_s" or not metric.compared:
            continue
        table[name] = table[name].to_numpy(float, na_value=np.nan)  # what is true or false counts as 1 or 0
        measured = table[name].dropna()
        has_it = table["plant"].isin(set(table["plant"][measured.index]))
        worst = _worst(measured, metric.ideal) if metric.worst is None else metric.worst
        table.loc[lost & has_it, name] = worst
    return table


def _worst(measured: pd.Series, ideal: float) -> float:
    values = measured.to_numpy(float)
    return float(values[np.abs(values - ideal).argmax()]) if len(values) else math.nan


def change(pairs: Pairs, metric: str) -> NDArray[np.float64]:
    """Other minus reference, of a metric or another column; NaN where the pair says nothing of it.

    That is where one of the flights has no such thing; of what is `of_circling`, where the reference does not circle;
    of the convergence time, where both flights last and neither converges.
    """
    before, after = pairs.reference, pairs.other
    values = after[metric].to_numpy(float) - before[metric].to_numpy(float)
    says = np.ones(len(pairs), bool)
    if metric in METRICS and METRICS[metric].of_circling:
        says &= before["circles"].to_numpy(bool)
    if metric == "convergence_time_s":
        says &= (before["converged"] | after["converged"].to_numpy() | after["lost"].to_numpy()).to_numpy(bool)
    return np.where(says, values, np.nan)


def spread(flights: pd.DataFrame) -> pd.DataFrame:
    """The flights with what a reader knows a setting by: the law with its gains in one, the wind by its speed."""
    table = flights.copy()
    if "law.name" in table:
        gains = table["law.gains"] if "law.gains" in table else pd.Series("", index=table.index)
        table["law"] = (table["law.name"] + " " + gains.fillna("").astype(str)).str.strip()
        table = table.drop(columns=[c for c in ("law.name", "law.gains") if c in table])
    if "wind.steady_mps" in table:
        table["wind_speed_mps"] = [round(float(np.hypot(*wind)), 6) for wind in table["wind.steady_mps"]]
        table = table.drop(columns="wind.steady_mps")
    return table


def axes(table: pd.DataFrame, without: Iterable[str] = ("plant", "aircraft")) -> dict[str, list[object]]:
    """The settings that were set, not drawn, to several values; with the values in order.

    What takes one value only within every seed was drawn. What follows from another axis (a law's gains, a duration
    set with a radius) is that axis.
    """
    columns = [c for c in varying(table) if c not in {*without, "seed"}]
    columns.sort(key=lambda column: column != "law")
    seeds = table["seed"]
    found: list[str] = []
    for column in columns:
        values = _text(table[column])
        drawn = seeds.nunique() > 1 and values.groupby(seeds).nunique().max() == 1
        follows = any(_follows(values, _text(table[axis]).tolist()) for axis in found)
        if not drawn and not follows:
            found.append(column)
    return {column: ordered(table[column]) for column in found}


SEVERITY = tuple(SEVERITIES)


def ordered(values: pd.Series) -> list[object]:
    """The different values in their order: of numbers, of severities, else of words."""
    different = list(dict.fromkeys(values))
    if is_ordered(different):
        return sorted(different, key=_rank)
    return sorted(different, key=str)


def is_ordered(values: Sequence[object]) -> bool:
    """Whether `<=` means something among them."""
    return all(_is_number(v) for v in values) or all(v in SEVERITY for v in values)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float | np.number) and not isinstance(value, bool | np.bool_)


def _rank(value: Any) -> float:
    return float(SEVERITY.index(value) if isinstance(value, str) else value)


def _alike(flights: pd.DataFrame, differing: Sequence[str]) -> pd.Series:
    """A text per flight, equal for those that differ in `differing` alone."""
    columns = [column for column in varying(flights) if column not in differing]
    if not columns:
        return pd.Series("", index=flights.index)
    return pd.Series(joined(flights, columns), index=flights.index)


def joined(table: pd.DataFrame, columns: Sequence[str]) -> list[str]:
    """A text per row, equal for rows that are equal in these columns."""
    return list(map("|".join, zip(*(map(str, table[column].tolist()) for column in columns), strict=True)))


def _text(column: pd.Series) -> pd.Series:
    return pd.Series(list(map(str, column.tolist())), index=column.index, dtype=object)


def _why_unpaired(flights: pd.DataFrame, baseline: str) -> str:
    """The smallest difference, beside the plant, that keeps a flight from a partner."""
    first = flights[flights["plant"] != baseline]
    second = flights[flights["plant"] == baseline]
    if not len(first) or not len(second):
        return f"no flight of plant {baseline!r}, or none of another, ended in a result"
    columns = [column for column in varying(flights) if column != "plant"]
    one = {column: str(first.iloc[0][column]) for column in columns}
    differing = min(
        ([column for column in columns if str(row[column]) != one[column]] for _, row in second.iterrows()), key=len
    )
    return (
        f"no two of the {len(flights)} flights differ in the plant alone: the first of plant "
        f"{first.iloc[0]['plant']!r} differs from the nearest of {baseline!r} in {_listed(differing)} too"
    )


def _listed(words: Sequence[str]) -> str:
    return ", ".join(words)
