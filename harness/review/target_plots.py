"""Plots of the target: estimate, truth, standard deviation of the estimate, and innovations."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from harness.review.plots import DEG, Array, Plot, Series, end, finite, level, span
from harness.review.styled import ESTIMATE, GREY, TARGET, StyledFlight

_BANDS = 2  # flights: with more, their bands would hide each other
_AXES = ("north", "east")


def target_plots(flights: Sequence[StyledFlight]) -> list[Plot]:
    """Plots of the target's position and velocity and, for flights with an estimator, of its errors and innovations."""
    estimating = [flight for flight in flights if flight.log.flight.estimator.filters and len(flight.log)]
    plots = []
    if estimating:
        plots += [_position_error(axis, estimating, flights) for axis in _AXES]
    else:
        plots += [_plot(f"target_{axis}", f"Target {axis} [m]", [_truth(f"target_{axis}", flights)]) for axis in _AXES]
    plots += [_velocity(axis, estimating, flights) for axis in _AXES]
    if estimating:
        plots += [
            _innovation("range", "m", 1.0, estimating, flights),
            _innovation("azimuth", "deg", DEG, estimating, flights),
            _range_error_seen(estimating, flights),
        ]
    return [plot for plot in plots if plot.series]


def _plot(name: str, title: str, series: list[Series]) -> Plot:
    return Plot(name, title, series, span([_near(s) for s in series]))


def _position_error(axis: str, estimating: Sequence[StyledFlight], flights: Sequence[StyledFlight]) -> Plot:
    name = f"target_{axis}"
    series = [level("0", (0.0,), end(flights))]
    for flight in estimating:
        error = flight.log[f"{name}_seen"] - flight.log[name]
        series.append(_estimate(flight, error, flight.log[f"{name}_variance"], "error", flights))
    return _plot(f"{name}_error", f"Target {axis}: error of the estimate ± 1σ [m]", series)


def _velocity(axis: str, estimating: Sequence[StyledFlight], flights: Sequence[StyledFlight]) -> Plot:
    name = f"target_velocity_{axis}"
    series = [
        _estimate(flight, flight.log[f"{name}_seen"], flight.log[f"{name}_variance"], "estimate", flights)
        for flight in estimating
    ]
    band = ": estimate ± 1σ and truth" if estimating else ""
    return _plot(name, f"Target velocity {axis}{band} [m/s]", [*series, _truth(name, flights)])


def _innovation(
    of: str, unit: str, scale: float, estimating: Sequence[StyledFlight], flights: Sequence[StyledFlight]
) -> Plot:
    series = [level("0", (0.0,), end(flights))]
    for flight in estimating:
        values = scale * flight.log[f"innovation_{of}"]
        new = np.isfinite(values)
        colour, label = _looks(flight, "innovation", flights)
        series.append(Series((label,), (colour,), (1.0,), flight.log["time"][new], values[new, np.newaxis]))
    return _plot(f"innovation_{of}", f"Innovation, {of} [{unit}]", [drawn for s in series if (drawn := finite(s))])


def _range_error_seen(estimating: Sequence[StyledFlight], flights: Sequence[StyledFlight]) -> Plot:
    """The range error that the law computes from the estimate."""
    series = []
    for flight in estimating:
        colour, name = _looks(flight, "seen by the law", flights)
        names = (name,) if len(flights) > 1 else ("true", name)
        columns = ("range_error_seen",) if len(flights) > 1 else ("range_error", "range_error_seen")
        new = _measured(flight)
        values = np.column_stack([flight.log[column][new] for column in columns])
        colours = (TARGET, colour)[-len(names) :]
        series.append(Series(names, colours, (flight.width,) * len(names), flight.log["time"][new], values))
    title = (
        "Range error, true and as the law sees it [m]" if len(flights) == 1 else "Range error as the law sees it [m]"
    )
    return Plot(
        "range_error_seen", title, series, span([s._replace(values=s.values[len(s.values) // 10 :]) for s in series])
    )


def _measured(flight: StyledFlight) -> NDArray[np.bool_]:
    """The rows with a new measurement; in between, an estimate is only extrapolated."""
    new = np.isfinite(flight.log["innovation_range"])
    new[:1] = True  # the filter starts from the first, which has no innovation
    return new


def _estimate(
    flight: StyledFlight, values: Array, variances: Array, label: str, flights: Sequence[StyledFlight]
) -> Series:
    colour, name = _looks(flight, label, flights)
    bands = variances[_measured(flight), np.newaxis] if len(flights) <= _BANDS else None
    new = _measured(flight)
    return Series((name,), (colour,), (flight.width,), flight.log["time"][new], values[new, np.newaxis], bands)


def _truth(column: str, flights: Sequence[StyledFlight]) -> Series:
    """The true target, from the longest flight: it moves alike in all flights of a comparison."""
    longest = max(flights, key=lambda flight: len(flight.log)).log
    return Series(("truth",), (TARGET,), (1.5,), longest["time"], longest[column][:, np.newaxis])


def _looks(flight: StyledFlight, label: str, flights: Sequence[StyledFlight]) -> tuple[tuple[int, int, int], str]:
    return (ESTIMATE, label) if len(flights) == 1 else (flight.colour, flight.name)


def _near(series: Series) -> Series:
    """The series reduced to its usual range, bands included: a filter may start from far off."""
    values = series.values
    if series.colours[0] in (TARGET, GREY) or not len(values):
        return series
    around = np.sqrt(series.variances) if series.variances is not None else 0.0
    later = np.vstack([values - around, values + around])
    low, high = np.nanpercentile(later, (2.0, 98.0), axis=0)
    return series._replace(values=np.vstack([low, high]))
