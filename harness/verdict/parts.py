"""The parts of the assumption and its consequences: what each measures, and within what it holds."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

import numpy as np
import pandas as pd

from harness.margins import Assess
from harness.settings.written import written

Bounds = tuple[float | None, float | None]


class Group(StrEnum):
    """The group of a part."""

    COORDINATED = "coordinated flight"  # what a pilot calls so
    FOLLOWED = "heading rate followed at once"
    CONSEQUENCE = "what it costs the law"


@dataclass(frozen=True, slots=True)
class Part:
    """One part: a column of results whose difference has to stay within a margin of the table [assess]."""

    title: str
    column: str
    unit: str
    margin: str  # its key in [assess]; the margin has the column's unit
    kind: Literal["at most", "at least", "within"]
    group: Group
    assumed: float | None = None  # what the assumption says it is; None: what the baseline flew
    relative: bool = False  # the margin is a share of the baseline's value
    drawn: bool = True  # False: it follows from the settings, whatever the seed

    def bounds(self, margins: Mapping[str, float]) -> Bounds:
        """The bounds of the difference, in the column's unit; shares of the baseline's value if relative."""
        margin = margins[self.margin]
        match self.kind:
            case "at most":
                return None, margin
            case "at least":
                return margin, None
            case _:
                return -margin, margin


PARTS: Mapping[str, Part] = {
    part.column: part
    for part in (
        Part("constant airspeed", "airspeed_deviation", "of nominal, rms", "airspeed_deviation", "at most",
             Group.COORDINATED, assumed=0.0),
        Part("level flight", "altitude_deviation_peak_m", "m peak", "altitude_deviation_m", "at most",
             Group.COORDINATED, assumed=0.0),
        Part("no sideslip", "sideslip_rms_deg", "deg rms", "sideslip_deg", "at most",
             Group.COORDINATED, assumed=0.0),
        Part("turn relation", "turn_ratio", "of g tan(bank)/V", "turn_ratio", "within",
             Group.COORDINATED, assumed=1.0),
        Part("bank in reserve", "bank_reserve_deg", "deg", "bank_reserve_deg", "at least",
             Group.COORDINATED, assumed=0.0, drawn=False),
        Part("gain at low frequency", "heading_rate_gain_slow", "of the command", "heading_rate_gain", "within",
             Group.FOLLOWED, assumed=1.0, drawn=False),
        Part("margin to the limit cycle", "limit_cycle_margin", "times the gains", "limit_cycle_margin", "at least",
             Group.FOLLOWED, assumed=0.0, drawn=False),
        Part("no limit cycle", "chatters", "of the flights chatter", "chatter_share", "at most",
             Group.FOLLOWED, assumed=0.0),
        Part("flights that last", "lost", "of the flights lost", "lost_share", "at most",
             Group.CONSEQUENCE),
        Part("convergence", "converged", "of the flights", "convergence_share_margin", "within", Group.CONSEQUENCE),
        Part("convergence time", "convergence_time_s", "s", "convergence_time_margin", "within",
             Group.CONSEQUENCE, relative=True),
        Part("settled error", "range_error_rms_m", "m rms", "range_error_margin_m", "within", Group.CONSEQUENCE),
        Part("saturation", "saturation_fraction", "of the time", "saturation_margin", "within", Group.CONSEQUENCE),
        Part("command activity", "command_activity_deg_s2", "deg/s2", "command_activity_margin_deg_s2", "within",
             Group.CONSEQUENCE),
    )
}  # fmt: skip


def margins_of(assess: Assess) -> dict[str, float]:
    """The margins by key, in the units of a file, which are those of the metrics."""
    return {key: float(value) for key, value in written(assess).items()}


def with_shares(table: pd.DataFrame) -> pd.DataFrame:
    """The flights with the columns that parts need beside the metrics: the airspeed's deviation as a share."""
    deviation = table["airspeed_deviation_rms_mps"] / table["start.airspeed_mps"]
    table = table.assign(airspeed_deviation=deviation.astype(np.float64))
    return table.assign(**{column: np.nan for column in PARTS if column not in table})
