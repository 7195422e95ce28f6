"""Pairs: flights that differ in one setting only, the cells they fall into, and how a flight enters a comparison."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from harness.error import HarnessError
from harness.log.metric import METRICS, YES_OR_NO
from harness.plants.ladder import PLANTS
from harness.plants.plant import Outcome
from harness.settings.columns import DIRECTORY, DRAWN, is_setting
from harness.world.wind import SEVERITIES

Array = NDArray[np.float64]

LOST = tuple(outcome.value for outcome in Outcome if outcome.lost)
FAILED = tuple(outcome.value for outcome in Outcome if outcome.failed)
SEVERITY = tuple(SEVERITIES)
SHARES = ("lost", "converged")  # of flights, beside the metrics that are true or false
UNDISTURBED: Mapping[str, object] = MappingProxyType(  # by the columns of `spread`
    {"wind_speed_mps": 0.0, "wind.turbulence": "none", "estimator.kind": "truth", "law.airspeed": "nominal"}
)


class CompareError(HarnessError, ValueError):
    """Why these flights cannot be compared, and what is missing."""


@dataclass(frozen=True, slots=True)
class Cell:
    """One combination of all that was set to several values."""

    at: Mapping[str, object]  # axis -> value
    rows: NDArray[np.intp]  # of the pairs
    drawn: bool  # something differs between its seeds: air, noise, a drawn setting


@dataclass(frozen=True, slots=True)
class Pairs:
    """Two tables of flights, row by row the same but for one setting; and those left without a partner."""

    reference: pd.DataFrame
    other: pd.DataFrame
    unpaired: pd.DataFrame

    def __len__(self) -> int:
        return len(self.reference)

    @property
    def seeds(self) -> NDArray[np.generic]:
        return self.other["seed"].to_numpy()

    @property
    def lost(self) -> NDArray[np.bool_]:
        """Whether the other flight ended early."""
        return self.other["lost"].to_numpy(bool)

    def take(self, rows: NDArray[np.intp]) -> "Pairs":
        """The pairs in these rows."""
        reference, other = (table.iloc[rows].reset_index(drop=True) for table in (self.reference, self.other))
        return Pairs(reference, other, self.unpaired)

    def difference(self, column: str, assumed: float | None) -> Array:
        """Other minus reference, or minus what is assumed of the other; NaN where the pair says nothing.

        That is where a flight has no such number; of a metric of circling where the law does not circle on the
        reference; of the convergence time where not both converge.
        """
        other = self.other[column].to_numpy(float)
        values = other - (self.reference[column].to_numpy(float) if assumed is None else assumed)
        metric = METRICS.get(column)
        if metric is not None and metric.of_circling and assumed is None:
            values = np.where(self.reference["circles"].to_numpy(bool), values, np.nan)
        return np.asarray(values, np.float64)

    def converged_alone(self, rows: NDArray[np.intp]) -> tuple[int, int]:
        """In how many of these pairs only the reference, and only the other converges."""
        first = self.reference["converged"].to_numpy(bool)[rows]
        second = self.other["converged"].to_numpy(bool)[rows]
        return int((first & ~second).sum()), int((second & ~first).sum())


def entered(flights: pd.DataFrame, circling: float) -> pd.DataFrame:
    """The flights as they enter a comparison, with the columns lost, converged and circles.

    A flight that ended early has no metrics: it is counted as lost. A flight circles when it lasts, moves around its
    target, and its settled error is below `circling` times the standoff distance.
    """
    table = flights.copy()
    lost = table["outcome"].isin(LOST)
    for name in METRICS:
        if name in table:
            number = pd.Series(table[name].to_numpy(float, na_value=np.nan), index=table.index)  # true counts as 1
            table[name] = number.where(~lost)
        else:
            table[name] = np.nan
    table["overshoot_m"] = table["overshoot_m"].fillna(0.0).where(~lost)  # rows of metrics before 7
    table["lost"] = lost.astype(float)
    table["converged"] = (table["convergence_time_s"].notna() & ~lost).astype(float)
    astray = (table["goes_round"] == 0.0) | lost  # rows older than this metric do not say
    table["circles"] = (table["range_error_rms_m"] <= circling * table["law.standoff_m"]) & ~astray
    return table


def is_share(column: str) -> bool:
    """Whether its mean is a share of flights: of one flight it is 1 or 0."""
    return column in SHARES or (column in METRICS and METRICS[column].unit == YES_OR_NO)


def pairs_by(flights: pd.DataFrame, key: str, baseline: object) -> Pairs:
    """Every flight beside the one that differs in the setting `key` alone and has the baseline's value of it.

    Raises `CompareError` with what is missing.
    """
    if len(flights) < 2:
        raise CompareError(f"{len(flights)} flight in all: a comparison takes at least two that differ in {key}")
    check_unique(flights)
    values = ordered(flights[key])
    others = [column for column in varying(flights) if column not in (key, "seed")]
    instead = f", or compare another setting: --by {others[0]}" if others else ""
    if len(values) == 1:
        only = f"all {len(flights)} flights have {key} = {shown(values[0])}"
        raise CompareError(f"{only}: add another value to the matrix{instead}")
    if not any(_same(baseline, value) for value in values):
        raise CompareError(
            f"no flight has the baseline, {key} = {shown(baseline)}: there is {', '.join(map(shown, values))}. "
            f"Add it to the matrix, or name another with --baseline{instead}"
        )
    judged = flights[~flights["outcome"].isin(FAILED)]
    is_reference = judged[key].map(lambda value: _same(value, baseline)).astype(bool)
    paired = pairs(judged, bundle(judged, key), is_reference)
    if not len(paired):
        raise CompareError(_why_unpaired(judged, key, is_reference) if len(judged) else "every flight failed: no pairs")
    return paired


def check_unique(flights: pd.DataFrame) -> None:
    """Raises `CompareError` when a flight is there twice: a comparison uses each once, that of the baseline too."""
    columns = [*settings_of(flights), *(column for column in (DIRECTORY,) if column in flights)]
    if (twice := flights.duplicated(columns, keep=False)).any():
        first, second, *_ = flights["key"][twice]
        raise CompareError(
            f"{int(twice.sum())} flights have the same settings as another, such as {first[:8]} and {second[:8]}; "
            "a comparison uses each once: fly them again into another directory"
        )


def usual(flights: pd.DataFrame) -> str:
    """The setting whose values are compared where none is named: plant, law, or the first that was set to several."""
    several = axes(spread(flights))
    if "plant" in several or not several:
        return "plant"
    if "law" in several:
        return "law.name" if flights["law.name"].nunique() > 1 else "law.gains"
    first = next((axis for axis in several if axis != "aircraft"), "aircraft")
    return {"wind_speed_mps": "wind.steady_mps"}.get(first, first)


def bundle(flights: pd.DataFrame, key: str) -> list[str]:
    """The settings that change with this one: single gains with a law or its set, nothing with another setting.

    With the directory: what is the same in all its flights, or in all of the same law.
    """
    if key == DIRECTORY:
        law = [column for column in ("law.name", "law.gains") if column in flights]
        of = flights[DIRECTORY].tolist(), joined(flights, [DIRECTORY, *law])
        return [DIRECTORY, *(c for c in varying(flights) if c != "seed" and _follows(flights[c], of[c not in law]))]
    if key not in ("law.name", "law.gains"):
        return [key]
    own = ["law.name", "law.gains"] if key == "law.name" else ["law.gains"]
    texts = joined(flights, [column for column in ("law.name", "law.gains") if column in flights])
    gains = [c for c in settings_of(flights) if c.startswith("law.") and c not in own and _follows(flights[c], texts)]
    return [*own, *(c for c in gains if flights[c].nunique(dropna=False) > 1 and c not in _SHARED)]


_SHARED = ("law.name", "law.standoff_m", "law.max_heading_rate_deg_s", "law.direction", "law.airspeed", "law.command")


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


def pairs(flights: pd.DataFrame, differing: Sequence[str], is_reference: pd.Series) -> Pairs:
    """Each flight that is no reference beside the reference that differs from it in `differing` alone."""
    alike = _alike(flights, differing)
    reference = flights[is_reference]
    at = {key: i for i, key in zip(reference.index, alike[is_reference], strict=True)}
    partner = alike[~is_reference].map(at)
    known = partner.dropna()
    left = ~(flights.index.isin(known) | flights.index.isin(known.index))
    return Pairs(
        flights.loc[known.to_numpy()].reset_index(drop=True),
        flights.loc[known.index].reset_index(drop=True),
        flights[left],
    )


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


def axes(table: pd.DataFrame, without: Iterable[str] = ()) -> dict[str, list[object]]:
    """The settings that were set, not drawn, to several values; with the values in order. For a table from `spread`.

    What takes one value only within every seed was drawn. What follows from another axis (a law's gains, a duration
    set with a radius) is that axis.
    """
    columns = [c for c in _varying_spread(table) if c not in {*without, "seed"}]
    columns.sort(key=lambda column: ("aircraft", "law").index(column) if column in ("aircraft", "law") else 2)
    seeds = table["seed"]
    chosen: list[str] = []
    for column in columns:
        values = _text(table[column])
        drawn = seeds.nunique() > 1 and values.groupby(seeds).nunique().max() == 1
        follows = any(_follows(values, _text(table[axis]).tolist()) for axis in chosen)
        if not drawn and not follows:
            chosen.append(column)
    return {column: ordered(table[column]) for column in chosen}


def _varying_spread(table: pd.DataFrame) -> list[str]:
    settings = [c for c in varying(table) if not (c.startswith("law.") and _follows_law(table, c))]
    named = [c for c in ("law", "wind_speed_mps") if c in table and table[c].nunique(dropna=False) > 1]
    return list(dict.fromkeys([*settings, *named]))


def _follows_law(table: pd.DataFrame, column: str) -> bool:
    return "law" in table and _follows(table[column], table["law"].astype(str).tolist())


def cells(pairs: Pairs, across: Iterable[str]) -> list[Cell]:
    """The cells of pairs, by these axes."""
    table = spread(pairs.other)
    columns = list(across)
    rows: dict[str, list[int]] = {}
    for row, text in enumerate(joined(table, columns) if columns else [""] * len(table)):
        rows.setdefault(text, []).append(row)
    known = [np.asarray(indices) for indices in rows.values()]
    return [Cell({c: table[c].iloc[r[0]] for c in columns}, r, is_drawn(pairs.other.iloc[r])) for r in known]


def is_drawn(flights: pd.DataFrame) -> bool:
    """Whether the seed changes anything: air, noise, or a setting that differs between its flights."""
    noisy = {"wind.turbulence": "none", "estimator.kind": "truth", "errors.course_noise_deg": 0.0}
    if any(name in flights and (flights[name] != quiet).any() for name, quiet in noisy.items()):
        return True
    if flights["seed"].nunique() == 1:  # which shows nothing: the run knows
        return bool(flights.attrs.get(DRAWN))
    return any(flights[column].nunique(dropna=False) > 1 for column in settings_of(flights) if column != "seed")


def ordered(values: pd.Series) -> list[object]:
    """The different values in their order: of numbers, of severities, of plants up the ladder, else of words."""
    different = values.drop_duplicates().tolist()  # one NaN: a gain that other laws have
    if values.name == DIRECTORY:
        return different  # in the order in which they were named
    if is_ordered(different):
        return sorted(different, key=_rank)
    if all(value in PLANTS for value in different):
        return sorted(different, key=lambda value: list(PLANTS).index(str(value)))
    return sorted(different, key=str)


def is_ordered(values: Sequence[object]) -> bool:
    """Whether one of them lies between two others."""
    return all(_is_number(v) for v in values) or all(v in SEVERITY for v in values)


def shown(value: object) -> str:
    """A setting's value, short."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(shown, value))}]"
    return f"{value:g}" if isinstance(value, float | np.floating) else str(value)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float | np.number) and not isinstance(value, bool | np.bool_)


def _same(value: object, other: object) -> bool:
    return value == other or str(value) == str(other) or shown(value) == shown(other)


def _rank(value: Any) -> float:
    return float(SEVERITY.index(value) if isinstance(value, str) else value)


def _alike(flights: pd.DataFrame, differing: Sequence[str]) -> pd.Series:
    """A text per flight, equal for those that differ in `differing` alone."""
    columns = [column for column in settings_of(flights) if column not in differing]
    columns = [column for column in columns if flights[column].nunique(dropna=False) > 1]
    if not columns:
        return pd.Series("", index=flights.index)
    return pd.Series(joined(flights, columns), index=flights.index)


def joined(table: pd.DataFrame, columns: Sequence[str]) -> list[str]:
    """A text per row, equal for rows that are equal in these columns."""
    return list(map("|".join, zip(*(map(str, table[column].tolist()) for column in columns), strict=True)))


def _text(column: pd.Series) -> pd.Series:
    return pd.Series(list(map(str, column.tolist())), index=column.index, dtype=object)


def _why_unpaired(flights: pd.DataFrame, key: str, is_reference: pd.Series) -> str:
    """The smallest difference, beside the key, that keeps a flight from a partner."""
    first, second = flights[~is_reference], flights[is_reference]
    if not len(first) or not len(second):
        return f"no flight with the baseline's {key}, or none with another, ended in a result"
    columns = [column for column in varying(flights) if column not in bundle(flights, key)]
    apart = {column: str(first.iloc[0][column]) for column in columns}
    differing = min(
        ([column for column in columns if str(row[column]) != apart[column]] for _, row in second.iterrows()), key=len
    )
    return (
        f"no two of the {len(flights)} flights differ in {key} alone: the first with {key} = "
        f"{shown(first.iloc[0][key])} differs from the nearest of the baseline in {', '.join(differing)} too"
    )
