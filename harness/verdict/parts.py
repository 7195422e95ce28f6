"""The parts of the assumption and its consequences: what each measures, and within what it holds."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

import aircraft
from harness.margins import Assess
from harness.plants.ladder import PLANTS
from harness.plants.turn import banks_of_turns
from harness.settings.written import written
from harness.verdict.pairs import Pairs, change

Bounds = tuple[float | None, float | None]


@dataclass(frozen=True, slots=True)
class Part:
    """One part: a column of both flights of a pair, whose difference has to stay within bounds."""

    name: str
    title: str
    column: str
    unit: str
    threshold: str  # the key in [assess], in the column's unit
    allowed: Callable[[float], Bounds]  # of the difference, in the column's unit, by the threshold
    assumed: float | None = None  # what the assumption says it is; None: what the baseline flew
    relative: bool = False  # bounds are shares of the baseline's value
    consequence: bool = False
    tested: bool = True  # False: a setting, or a share of flights, of which a cell has too few for a test

    def bounds(self, assess: Assess) -> Bounds:
        """What the difference has to stay within, in the column's unit, which is that of the threshold in a file."""
        return self.allowed(written(assess)[self.threshold])

    def difference(self, pairs: Pairs) -> NDArray[np.float64]:
        """Other minus what is assumed of it; NaN where the pair says nothing."""
        if self.assumed is None:
            return change(pairs, self.column)
        return pairs.other[self.column].to_numpy(float) - self.assumed


def _up_to(threshold: float) -> Bounds:
    return None, threshold


def _within(threshold: float) -> Bounds:
    return -threshold, threshold


def _reserve(threshold: float) -> Bounds:
    return None, -threshold


PARTS: tuple[Part, ...] = (
    Part(
        "airspeed", "constant airspeed", "airspeed_deviation", "of nominal, rms",
        "airspeed_deviation", _up_to, 0.0,
    ),
    Part(
        "gain", "heading rate followed (gain)", "heading_rate_gain", "of the command",
        "heading_rate_gain", _within, 1.0,
    ),
    Part(
        "lag", "heading rate followed (lag)", "heading_rate_lag_s", "s",
        "heading_rate_lag_s", _up_to, 0.0,
    ),
    Part(
        "lag_k2", "heading rate followed (lag x k2)", "lag_times_k2", "1",
        "lag_times_k2", _up_to, 0.0,
    ),
    Part(
        "sideslip", "zero sideslip", "sideslip_rms_deg", "deg rms",
        "sideslip_deg", _up_to, 0.0,
    ),
    Part(
        "level", "level flight", "altitude_deviation_peak_m", "m peak",
        "altitude_deviation_m", _up_to, 0.0,
    ),
    Part(
        "turn", "turn relation g tan(bank)/V", "turn_ratio", "of the relation",
        "turn_ratio", _within, 1.0,
    ),
    Part(
        "reach", "rate limit within reach of the bank limit", "bank_beyond_deg", "deg beyond the bank limit",
        "bank_reserve_deg", _reserve, 0.0, tested=False,
    ),
    Part(
        "alive", "flights that last", "lost_share", "of the flights lost",
        "lost_share", _up_to, 0.0, consequence=True, tested=False,
    ),
    Part(
        "convergence", "convergence itself", "converged_share", "of the flights",
        "convergence_share_margin", _within, consequence=True, tested=False,
    ),
    Part(
        "convergence_time", "convergence time", "convergence_time_s", "s",
        "convergence_time_margin", _within, relative=True, consequence=True,
    ),
    Part(
        "settled_error", "settled error", "range_error_rms_m", "m rms",
        "range_error_margin_m", _within, consequence=True,
    ),
    Part(
        "saturation", "saturation", "saturation_fraction", "of the time",
        "saturation_margin", _within, consequence=True,
    ),
    Part(
        "activity", "command activity", "command_activity_deg_s2", "deg/s2",
        "command_activity_margin_deg_s2", _within, consequence=True,
    ),
)  # fmt: skip


def with_quantities(table: pd.DataFrame) -> pd.DataFrame:
    """The entered flights with the columns that the parts need beside the metrics."""
    k2 = table.get("law.k2", np.nan)
    speeds, limits_of_rate = table["start.airspeed_mps"].to_numpy(float), _limit(table).to_numpy(float)
    bank = pd.Series(np.degrees(banks_of_turns(speeds, limits_of_rate)), index=table.index)
    limits = {name: _bank_limit_deg(name) for name in set(table["aircraft"])}
    banked = table["plant"].map(lambda plant: PLANTS[plant].banks)
    return table.assign(
        airspeed_deviation=table["airspeed_deviation_rms_mps"] / table["start.airspeed_mps"],
        lag_times_k2=table["heading_rate_lag_s"] * k2,
        bank_beyond_deg=(bank - table["aircraft"].map(limits)).where(banked),
        lost_share=table["lost"].astype(float),
        converged_share=table["converged"].astype(float),
    )


def _limit(table: pd.DataFrame) -> pd.Series:
    return table["law.max_heading_rate_deg_s"].map(lambda limit: math.radians(float(limit)))


def _bank_limit_deg(name: str) -> float:
    """NaN for an airframe that is not here any more, or is broken."""
    try:
        return math.degrees(aircraft.limits(aircraft.folder(name)).bank)
    except (OSError, ValueError):
        return math.nan
