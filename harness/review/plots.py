"""Plots over time: the lines of each plot, from the logs of flights, and its range of values."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from harness.review.styled import GREY, LIGHT, Colour, StyledFlight, is_crowd, mixed

Array = NDArray[np.float64]

DEG = 180.0 / math.pi
_DIM: Colour = (85, 115, 165)
DECADES = "range_error_decades"  # the plot in which the settled error is seen beside the first
LEAST_DECADE = -3.0  # 1 mm: a smaller error is drawn as this
MOST_WITH_COMMANDS = 2  # flights; with more, the commands would hide the flown values


class Series(NamedTuple):
    """Lines that share their times, in the unit of the plot; the first is drawn at the bottom. One Rerun entity."""

    names: tuple[str, ...]
    colours: tuple[Colour, ...]
    widths: tuple[float, ...]
    time: Array
    values: Array  # (times, lines)
    variances: Array | None = None  # (times, lines): drawn as a band of one standard deviation to either side
    flight: str = ""  # whose lines these are; empty for none's


class Plot(NamedTuple):
    """One plot; the first of its series is drawn at the bottom."""

    name: str
    title: str
    series: list[Series]
    span: tuple[float, float]  # the range of values in view

    def entity(self, i: int) -> str:
        """The entity of one of its series; Rerun draws lines in the order of these names."""
        return f"/plots/{self.name}/{i:02}"


class _Line(NamedTuple):
    """A column of the log, and its label in the legend of a single flight."""

    column: str
    label: str


class _Content(NamedTuple):
    """The lines of a plot for each flight; `scale` converts SI to the unit of the plot."""

    name: str
    title: str
    unit: str
    scale: float
    lines: tuple[_Line, ...]
    least: float = 0.1  # the smallest span of values in view, in the unit of the plot
    in_decades: bool = False  # the size of the values, in powers of ten of the unit


_OVERVIEW = (
    _Content("range_error", "Range error", "m", 1.0, (_Line("range_error", "flown"),)),
    _Content(
        DECADES,
        "|Range error|, powers of ten: 0 is 1 m, -2 is 1 cm",
        "",
        1.0,
        (_Line("range_error", "flown"),),
        in_decades=True,
    ),
    _Content(
        "heading_rate",
        "Heading rate",
        "deg/s",
        DEG,
        (
            _Line("unlimited_command", "law's command"),
            _Line("heading_rate_command", "limited"),
            _Line("heading_rate", "flown"),
        ),
    ),
    _Content("bank", "Bank", "deg", DEG, (_Line("bank_command", "commanded"), _Line("bank", "flown"))),
    _Content("sideslip", "Sideslip", "deg", DEG, (_Line("sideslip", "flown"),)),
    _Content("sliding_variable", "Sliding variable s", "rad", 1.0, (_Line("sliding_variable", "s"),)),
)
_AIRCRAFT = (
    _Content("airspeed", "Airspeed", "m/s", 1.0, (_Line("airspeed", "flown"),), 0.5),
    _Content("altitude", "Altitude", "m", 1.0, (_Line("altitude", "flown"),), 2.0),
    _Content(
        "attack", "Angle of attack, pitch", "deg", DEG, (_Line("pitch", "pitch"), _Line("angle_of_attack", "attack"))
    ),
    _Content("load", "Load factor", "g", 1.0, (_Line("load_factor", "n_z"),)),
    _Content("lateral", "Lateral specific force", "m/s2", 1.0, (_Line("lateral_acceleration", "along the wing"),)),
    _Content("throttle", "Throttle", "%", 100.0, (_Line("throttle", "throttle"),), 5.0),
    _Content(
        "surfaces",
        "Surfaces",
        "deg",
        DEG,
        (
            _Line("aileron", "aileron, right roll +"),
            _Line("rudder", "rudder, left +"),
            _Line("elevator", "elevator, down +"),
        ),
    ),
    _Content(
        "wind",
        "Wind at the aircraft, towards",
        "m/s",
        1.0,
        (_Line("wind_down", "down"), _Line("wind_east", "east"), _Line("wind_north", "north")),
    ),
)
_SHADES: tuple[tuple[Colour, float], ...] = (
    (LIGHT, 0.0),
    (LIGHT, 0.65),
    (_DIM, 0.8),
)  # of the lines of a flight, from the top


def overview_plots(flights: Sequence[StyledFlight]) -> list[Plot]:
    """Plots of the law's commands and of the aircraft's response, without columns that no plant here has."""
    return [plot for content in _OVERVIEW if (plot := _plot(content, flights))]


def aircraft_plots(flights: Sequence[StyledFlight]) -> list[Plot]:
    """Plots of the aircraft and the air. Of two flights each line that is not zero has its own, of more only few."""
    if len(flights) == 1:
        return [plot for content in _AIRCRAFT if (plot := _plot(content, flights))]
    if is_crowd(flights):
        return [plot for content in _AIRCRAFT[:2] if (plot := _plot(content, flights))]
    parts = [part for content in _AIRCRAFT for part in _split(content)]
    plots = [plot for part in parts if (plot := _plot(part, flights))]
    return [plot for plot in plots if any(np.nan_to_num(series.values).any() for series in plot.series)]


def end(flights: Sequence[StyledFlight]) -> float:
    """The time of the last row of all flights, s; 1 if there is none later than 0."""
    return max((float(flight.log["time"][-1]) for flight in flights if len(flight.log)), default=0.0) or 1.0


def level(label: str, values: Sequence[float], until: float, colour: Colour = GREY) -> Series:
    """Horizontal lines from time 0 to `until`, s, with one label."""
    both_ends = np.array([values, values])
    return Series(
        (label,) * len(values), (colour,) * len(values), (1.0,) * len(values), np.array((0.0, until)), both_ends
    )


def span(series: Sequence[Series], least: float = 0.1) -> tuple[float, float]:
    """The range of all values with a margin, at least `least` wide."""
    low, high = extent(series)
    if not high - low >= least:
        low, high = 0.5 * (low + high - least), 0.5 * (low + high + least)
    margin = 0.08 * (high - low)
    return low - margin, high + margin


def finite(series: Series) -> Series | None:
    """The lines that have finite values; None if no line has any."""
    drawn = np.isfinite(series.values).any(axis=0)
    if not drawn.any():
        return None
    kept = np.flatnonzero(drawn).tolist()
    return Series(
        tuple(series.names[i] for i in kept),
        tuple(series.colours[i] for i in kept),
        tuple(series.widths[i] for i in kept),
        series.time,
        series.values[:, kept],
        None if series.variances is None else series.variances[:, kept],
        series.flight,
    )


def _split(content: _Content) -> list[_Content]:
    if len(content.lines) == 1:
        return [content]
    return [
        content._replace(name=line.column, title=line.column.replace("_", " ").capitalize(), lines=(line,))
        for line in content.lines
    ]


def _plot(content: _Content, flights: Sequence[StyledFlight]) -> Plot | None:
    flown = [drawn for flight in flights if (drawn := finite(_series(content, flight, len(flights))))]
    if not flown:
        return None
    series = [*_bounds(content.name, flights), *flown]
    title = f"{content.title} [{content.unit}]" if content.unit else content.title
    return Plot(content.name, title, series, _span(content, series, flights))


def _series(content: _Content, flight: StyledFlight, flights: int) -> Series:
    lines = content.lines if flights == 1 else content.lines[-2 if flights <= MOST_WITH_COMMANDS else -1 :]
    names = [line.label if flights == 1 else _name(flight.name, line, lines) for line in lines]
    shades = reversed(_SHADES[: len(lines)])
    colours = tuple(mixed(flight.colour, *shade) for shade in shades)
    widths = (*[1.0 if flight.width < 2.0 else 2.0] * (len(lines) - 1), flight.width)
    values = content.scale * np.column_stack([flight.log[line.column] for line in lines])
    if content.in_decades:
        values = decades(values)
    return Series(tuple(names), colours, widths, flight.log["time"], values, flight=flight.name)


def decades(values: Array) -> Array:
    """Powers of ten of the size of values, not below `LEAST_DECADE`."""
    return np.asarray(np.log10(np.maximum(np.abs(values), 10.0**LEAST_DECADE)), np.float64)


def _name(flight: str, line: _Line, lines: Sequence[_Line]) -> str:
    return flight if line is lines[-1] else f"{flight} {line.label}"


def _bounds(name: str, flights: Sequence[StyledFlight]) -> list[Series]:
    """Constant lines to compare with the values: tolerance, limit, nominal airspeed, commanded altitude."""
    several = [flight.log.flight for flight in flights]
    if name == DECADES:
        return [
            level(f"tolerance {tolerance:.3g} m", (math.log10(tolerance),), end(flights))
            for tolerance in sorted({f.metrics.tolerance for f in several})
        ]
    if name == "range_error":
        label, unit, both, values = "tolerance", "m", True, {f.metrics.tolerance for f in several}
    elif name == "heading_rate":
        label, unit, both, values = "limit", "deg/s", True, {DEG * f.law.max_heading_rate for f in several}
    elif name == "airspeed":
        label, unit, both, values = "nominal", "m/s", False, {f.start.airspeed for f in several}
    elif name == "altitude":
        label, unit, both, values = "commanded", "m", False, {f.start.altitude for f in several}
    else:
        return []
    until = end(flights)
    return [
        level(f"{label} {'±' if both else ''}{value:.3g} {unit}", (-value, value) if both else (value,), until)
        for value in sorted(values)
        if math.isfinite(value)
    ]


def _span(content: _Content, series: Sequence[Series], flights: Sequence[StyledFlight]) -> tuple[float, float]:
    """The range of a plot: range errors of the first half are clipped, heading rates are shown up to their limit."""
    if content.in_decades:
        return LEAST_DECADE - 0.3, max(extent(series)[1] + 0.3, 0.5)
    if content.name == "range_error":
        near = max(0.5 * flight.log.flight.law.standoff for flight in flights)
        clipped = [
            s._replace(values=np.vstack([s.values.clip(-near, near), s.values[len(s.values) // 2 :]])) for s in series
        ]
        return span(clipped)
    limit = DEG * max(flight.log.flight.law.max_heading_rate for flight in flights)
    if content.name == "heading_rate" and math.isfinite(limit):
        ten = 10.0 ** math.ceil(math.log10(limit))
        high = max(1.3 * limit, 1.04 * ten if ten <= 2.0 * limit else 0.0)  # with a number on the axis, if near
        return -high, high
    return span(series, content.least)


def extent(series: Sequence[Series]) -> tuple[float, float]:
    """The lowest and the highest finite value; 0 and 0 without any."""
    values = np.concatenate([s.values.ravel() for s in series])
    values = values[np.isfinite(values)]
    return (float(values.min()), float(values.max())) if values.size else (0.0, 0.0)
