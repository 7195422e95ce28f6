"""How closely heading-rate commands can be followed, as columns of results: a prediction for each law and airframe.

The prediction rests on the identification that lies beside the airframe. It is left out (NaN) for a plant without an
airframe, for an airframe that is not identified at the flight's airspeed, and for one whose model has changed since.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

import aircraft
from harness.error import HarnessError
from harness.limit_cycle.margin import Following, following
from harness.plants.identified import is_stale
from harness.plants.ladder import PLANTS
from harness.settings import flight_from_document
from harness.settings.columns import is_setting, nested
from harness.verdict.pairs import joined

COLUMNS = ("heading_rate_gain_slow", "heading_rate_delay_s", "limit_cycle_margin", "predicted_cycle_hz",
           "predicted_cycle_amplitude_deg_s")  # fmt: skip
_UNKNOWN = (math.nan,) * len(COLUMNS)
LARGEST = 99.0  # a margin beyond it is written as this: it decides nothing more


def with_following(flights: pd.DataFrame) -> pd.DataFrame:
    """The flights with `COLUMNS`; flights of equal law, airframe, airspeed and period are predicted once."""
    keys = ["aircraft", "start.airspeed_mps", "guidance_period_s"]
    keys += [column for column in flights.columns if column.startswith("law.")]
    texts = joined(flights, [key for key in keys if key in flights])
    has_airframe = [PLANTS[plant].has_airframe for plant in flights["plant"]]
    rows = [text if of_airframe else "" for text, of_airframe in zip(texts, has_airframe, strict=True)]
    known: dict[str, tuple[float, ...]] = {"": _UNKNOWN}
    for position, text in enumerate(rows):
        if text not in known:
            known[text] = _predicted(flights.iloc[position].to_dict())
    table = np.array([known[text] for text in rows], np.float64).reshape(-1, len(COLUMNS))
    return flights.assign(**{name: table[:, i] for i, name in enumerate(COLUMNS)})


def _predicted(row: Mapping[Any, Any]) -> tuple[float, ...]:
    settings = {str(key): value for key, value in row.items() if is_setting(str(key)) and _is_there(value)}
    keep = ("plant", "aircraft", "guidance_period_s", "start.airspeed_mps")
    chosen = {key: value for key, value in settings.items() if key in keep or key.startswith("law.")}
    try:
        flight = flight_from_document(nested({**chosen, "duration_s": 100.0 * settings["guidance_period_s"]}))
        if is_stale(aircraft.folder(flight.aircraft)):
            return _UNKNOWN
        return _numbers(following(flight))
    except (HarnessError, OSError):
        return _UNKNOWN


def _is_there(value: object) -> bool:
    return value is not None and not (isinstance(value, float) and math.isnan(value))


def _numbers(found: Following) -> tuple[float, ...]:
    cycle = found.cycle
    numbers = (
        found.low_frequency_gain,
        found.crossover_delay,
        None if found.margin is None else min(found.margin, LARGEST),
        cycle.frequency if cycle else None,
        math.degrees(cycle.heading_rate) if cycle else None,
    )
    return tuple(math.nan if number is None else float(number) for number in numbers)
