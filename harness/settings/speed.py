"""Settings derived from the airframe's airspeed: the nominal airspeed, and lengths written as seconds of flight.

Without `start.airspeed_mps` a flight has the airframe's own airspeed. A length may be text such as "15.4 s": the way
that the aircraft flies in that time at its nominal airspeed. So one experiment serves airframes of different speeds.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import aircraft
from harness.flight import Flight
from harness.plants.plant import Start
from harness.settings.table import TableSchema

_SECONDS = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*s\s*")
_DEFAULT = next(field.default for field in fields(Flight) if field.name == "aircraft")


def at_own_speed(flight: Mapping[str, Any], schema: TableSchema) -> dict[str, Any]:
    """A [flight] table with its airspeed filled in and its lengths in metres. What is wrong is left for the check."""
    start = flight.get("start", {})
    airspeed = start.get("airspeed_mps") if isinstance(start, Mapping) else None
    if airspeed is None:
        airspeed = _own_airspeed(flight.get("aircraft", _DEFAULT))
        if isinstance(start, Mapping):
            flight = {**flight, "start": {**start, "airspeed_mps": airspeed}}
    if isinstance(airspeed, bool) or not isinstance(airspeed, int | float):
        return dict(flight)
    return _in_metres(flight, schema, float(airspeed))


def _own_airspeed(name: object) -> float:
    """The airframe's design airspeed, m/s; the default's where there is no such airframe."""
    try:
        return aircraft.limits(aircraft.folder(str(name))).design_airspeed
    except (OSError, ValueError):
        return Start().airspeed


def _in_metres(table: Mapping[str, Any], schema: TableSchema, airspeed: float) -> dict[str, Any]:
    lengths = dict(table)
    for key, value in table.items():
        setting = schema.settings.get(key)
        if setting is None:
            continue
        if setting.table and isinstance(value, Mapping):
            lengths[key] = _in_metres(value, setting.table, airspeed)
        elif setting.unit.suffix == "m":
            lengths[key] = [_flown(x, airspeed) for x in value] if isinstance(value, list) else _flown(value, airspeed)
    return lengths


def _flown(value: object, airspeed: float) -> object:
    """The metres that a text such as "15.4 s" stands for; anything else as it is."""
    if isinstance(value, str) and (seconds := _SECONDS.fullmatch(value)):
        metres = float(seconds[1]) * airspeed
        return metres if math.isfinite(metres) else value
    return value
