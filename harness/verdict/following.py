"""How closely heading-rate commands can be followed, as columns of results: a prediction for each law and airframe.

The prediction rests on the identification that lies beside the airframe. It is left out (NaN) for a plant without an
airframe, for an airframe that is not identified at the flight's airspeed, and for one whose model has changed since.
"""

import math
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
import pandas as pd

from harness.error import HarnessError
from harness.flight import Flight
from harness.limit_cycle.predicted import PREDICTED, predicted
from harness.plants.ladder import PLANTS
from harness.settings import flight_from_document
from harness.settings.columns import is_setting, nested
from harness.verdict.pairs import joined

_ALSO = ("law.", "errors.")  # settings that a prediction depends on, or that forbid one


def with_predicted(flights: pd.DataFrame, names: Collection[str] = tuple(PREDICTED)) -> pd.DataFrame:
    """The flights with these columns of `PREDICTED`; those of the limit cycle itself take three quarters of the time.

    Flights of equal law, airframe, airspeed, period and errors are predicted once.
    """
    keys = ["aircraft", "start.airspeed_mps", "guidance_period_s"]
    keys += [column for column in flights.columns if column.startswith(_ALSO)]
    texts = joined(flights, [key for key in keys if key in flights])
    has_airframe = [PLANTS[plant].has_airframe for plant in flights["plant"]]
    rows = [text if of_airframe else "" for text, of_airframe in zip(texts, has_airframe, strict=True)]
    unknown = [math.nan] * len(names)
    known = {"": unknown}
    for position, text in enumerate(rows):
        if text not in known:
            flight = _flight(flights.iloc[position].to_dict())
            found = predicted(flight, names).values() if flight else unknown
            known[text] = [math.nan if x is None else x for x in found]
    table = np.array([known[text] for text in rows], np.float64).reshape(-1, len(names))
    return flights.assign(**{name: table[:, i] for i, name in enumerate(names)})


def _flight(row: Mapping[Any, Any]) -> Flight | None:
    """A flight that is predicted as that of the row; None if its settings serve no more."""
    settings = {str(key): value for key, value in row.items() if is_setting(str(key)) and _is_there(value)}
    keep = ("plant", "aircraft", "guidance_period_s", "start.airspeed_mps")
    chosen = {key: value for key, value in settings.items() if key in keep or key.startswith(_ALSO)}
    try:
        return flight_from_document(nested({**chosen, "duration_s": 100.0 * settings["guidance_period_s"]}))
    except (HarnessError, OSError):
        return None


def _is_there(value: object) -> bool:
    return value is not None and not (isinstance(value, float) and math.isnan(value))
