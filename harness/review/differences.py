"""What several flights differ by: each against the reference, at the same time, in quantities relative to the path."""

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
    """Flight minus reference for as long as both fly; none of a flight alone.

    A reference without bank and sideslip turns as the paper assumes: banked by atan(V heading_rate / g), no sideslip.
    """
    plots = []
    for column, title, unit, scale in _DIFFERENCES if len(flights) > 1 else ():
        series = [kept for one in flights[1:] if (kept := finite(_difference(column, scale, one, flights[0])))]
        if series:
            assumed = ", taken as coordinated" if np.isnan(flights[0].log[column]).all() else ""
            drawn = [level("0", (0.0,), end(flights)), *series]
            name = f"Δ {title.lower()} [{unit}] to the reference{assumed}"
            plots.append(Plot(f"difference_{column}", name, drawn, span(drawn)))
    return plots


def _difference(column: str, scale: float, one: StyledFlight, reference: StyledFlight) -> Series:
    both = one.log["time"][one.log["time"] <= reference.log["time"][-1]] if len(reference.log) else np.empty(0)
    expected = np.interp(both, reference.log["time"], _expected(column, reference)) if len(both) else both
    values = scale * (one.log[column][: len(both)] - expected)
    return Series((one.name,), (one.colour,), (one.width,), both, values[:, np.newaxis])


def _expected(column: str, reference: StyledFlight) -> Array:
    log = reference.log
    values = log[column]
    if not np.isnan(values).all():
        return values
    return banks_of_turns(log["airspeed"], log["heading_rate"]) if column == "bank" else np.zeros(len(log))
