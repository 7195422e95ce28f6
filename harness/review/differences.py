"""Plots of differences: each flight minus the reference at the same time, in quantities relative to the path."""

from collections.abc import Sequence

import numpy as np

from harness.plants.turn import banks_of_turns
from harness.review.plots import DEG, Array, Plot, Series, end, finite, level, span
from harness.review.styled import StyledFlight

_DIFFERENCES = (
    ("range_error", "Range error", "m", 1.0),
    ("heading_rate", "Heading rate", "deg/s", DEG),
    ("bank", "Bank", "deg", DEG),
    ("sideslip", "Sideslip", "deg", DEG),
)


def difference_plots(flights: Sequence[StyledFlight]) -> list[Plot]:
    """Plots of flight minus reference, for as long as both last; empty unless there are two flights.

    A reference without bank and sideslip is taken as coordinated: bank atan(V heading_rate / g), sideslip 0.
    """
    plots = []
    for column, title, unit, scale in _DIFFERENCES if len(flights) == 2 else ():
        series = [drawn for flight in flights[1:] if (drawn := finite(_difference(column, scale, flight, flights[0])))]
        if series:
            assumed = ", taken as coordinated" if np.isnan(flights[0].log[column]).all() else ""
            lines = [level("0", (0.0,), end(flights)), *series]
            name = f"Δ {title.lower()} [{unit}] to the reference{assumed}"
            plots.append(Plot(f"difference_{column}", name, lines, span(lines)))
    return plots


def _difference(column: str, scale: float, flight: StyledFlight, reference: StyledFlight) -> Series:
    both = flight.log["time"][flight.log["time"] <= reference.log["time"][-1]] if len(reference.log) else np.empty(0)
    expected = np.interp(both, reference.log["time"], _expected(column, reference)) if len(both) else both
    values = scale * (flight.log[column][: len(both)] - expected)
    return Series((flight.name,), (flight.colour,), (flight.width,), both, values[:, np.newaxis])


def _expected(column: str, reference: StyledFlight) -> Array:
    log = reference.log
    values = log[column]
    if not np.isnan(values).all():
        return values
    return banks_of_turns(log["airspeed"], log["heading_rate"]) if column == "bank" else np.zeros(len(log))
