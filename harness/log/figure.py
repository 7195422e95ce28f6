"""Figures of flights: a function for each panel, and `paint`, which lays panels out on a figure.

`FlightLog.plot`, `harness plot` and the report draw the same panels.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from harness.chatter import spectrum as spectrum_of
from harness.drawing import COLOURS, COLUMN, FAINT, INK, PAGE, Picture
from harness.drawing import picture as drawn
from harness.error import ArgumentError, did_you_mean
from harness.log.flight_log import FlightLog
from harness.log.signals import Signals
from harness.plants.plant import Outcome

Array = NDArray[np.float64]
Flights = Mapping[str, FlightLog]  # by the names that the legend gives them

MOST = len(COLOURS)  # largest number of flights in one figure
_WIDE, _THIN = 2.0, 0.9  # points: the first flight lies under the others, so it is wider
_LETTERS, _BESIDE_LETTERS = 18.0, 5  # letters of a legend per inch; width of an entry's line sample, in letters
_MOST_BY_ALL = 2  # largest number of flights with all panels by default: more would hide each other
_LEAST_ERROR = 1e-6  # m: smaller errors are rounding


def picture(flights: Flights, panels: Sequence[str] = ()) -> Picture:
    """These panels of the flights as a figure in print size; without a choice all, of many flights the clearest.

    `ArgumentError` for more flights than there are colours, a flight without a row, or panels that no flight here has.
    """
    kept = panels_of(flights, panels)
    columns = _columns(kept)
    width = PAGE if all(columns) else COLUMN
    rows = max(sum(2.0 if name == "track" else 1.0 for name in column) for column in columns)
    height = max(2.4, 1.35 * rows + 0.5)
    return drawn(partial(paint, flights=flights, panels=kept), width, height)


def panels_of(flights: Flights, panels: Sequence[str] = ()) -> list[str]:
    """The requested panels that can be drawn. Errors as `picture`."""
    if not 1 <= len(flights) <= MOST:
        raise ArgumentError(f"{len(flights)} flights: must be at most {MOST}")
    for name, log in flights.items():
        if not len(log):
            raise ArgumentError(f"{name}: nothing to draw: {log.reason}")
    for name in panels:
        if name not in PANELS:
            raise ArgumentError(f"no panel {name!r}{did_you_mean(name, PANELS)}; the panels are {', '.join(PANELS)}")
    usual = list(PANELS) if len(flights) <= _MOST_BY_ALL else ["track", "error", "spectrum"]
    kept = [name for name in panels or usual if any(PANELS[name].has(log) for log in flights.values())]
    if not kept:
        plants = ", ".join(dict.fromkeys(log.flight.plant for log in flights.values()))
        raise ArgumentError(f"no flight here has {' or '.join(panels)} (plant {plants})")
    return kept


def paint(figure: Figure, flights: Flights, panels: Sequence[str] = ()) -> None:
    """Lays out the panels, those over time on the right, with one legend below them. Errors as `picture`."""
    kept = panels_of(flights, panels)
    left, right = _columns(kept)
    columns = [column for column in (left, right) if column]
    grid = figure.add_gridspec(1, len(columns), width_ratios=(1.0, 1.3)[: len(columns)])
    legend: dict[str, Artist] = {}
    for place, column in enumerate(columns):
        tall = [2.0 if name == "track" else 1.0 for name in column]
        rows = grid[0, place].subgridspec(len(column), 1, height_ratios=tall)
        shared: Axes | None = None
        for row, name in enumerate(column):
            axes = figure.add_subplot(rows[row, 0], sharex=shared)
            PANELS[name].draw(axes, flights)
            if column is right:
                shared = shared or axes
                axes.tick_params(labelbottom=row == len(column) - 1)
                axes.set_xlabel("time, s" if row == len(column) - 1 else "")
            for handle, text in zip(*axes.get_legend_handles_labels(), strict=True):
                legend.setdefault(text, handle)
    across = max(1, int(_LETTERS * figure.get_figwidth() / (max(map(len, legend)) + _BESIDE_LETTERS)))
    figure.legend(
        legend.values(), legend.keys(), loc="outside lower center", ncols=across, frameon=False, fontsize="small"
    )


def track(axes: Axes, flights: Flights) -> None:
    """Seen from above, north up, with equal scales; each standoff circle is around its target where that ends."""
    for log, style in _styled(flights):
        axes.plot(log["east"], log["north"], **style)
        axes.plot(log["east"][:1], log["north"][:1], "o", color=style["color"], ms=4)
        if log.outcome is not Outcome.COMPLETED:
            axes.plot(log["east"][-1:], log["north"][-1:], "X", color=style["color"], ms=6)
    axes.plot([], [], "o", color=FAINT, ms=4, label="start")
    around = np.linspace(0.0, 2.0 * np.pi, 361)
    longest = sorted(flights.values(), key=len)
    for (_, standoff), log in {(log.flight.target, log.flight.law.standoff): log for log in longest}.items():
        east, north = log["target_east"], log["target_north"]
        if np.ptp(east) or np.ptp(north):
            axes.plot(east, north, color=INK, lw=0.8, ls=":", label="target's track")
        axes.plot(east[-1:], north[-1:], "+", color=INK, ms=7, label="target")
        circle = east[-1] + standoff * np.sin(around), north[-1] + standoff * np.cos(around)
        axes.plot(*circle, color=INK, lw=0.7, ls="--", label=f"standoff circle, {standoff:.6g} m")
    _wind(axes, longest[-1])
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("east, m")
    axes.set_ylabel("north, m")


def error(axes: Axes, flights: Flights) -> None:
    """|Distance to the target minus the standoff distance| on a log scale, so that the settled part is seen too.

    Of more than two flights only the peak of each second, so that each can be followed.
    """
    lowest, peaks = [], len(flights) > _MOST_BY_ALL
    for log, style in _styled(flights):
        time, size = log["time"], np.abs(log["range_error"])
        if peaks:
            begins = np.arange(0, len(log), max(1, round(1.0 / log.flight.guidance_period)))
            time, size = time[begins], np.maximum.reduceat(size, begins)
        axes.plot(time, np.maximum(size, _LEAST_ERROR), **style)
        lowest.append(float(np.median(np.abs(Signals(log).circling("range_error")))))
    tolerances = sorted({log.flight.metrics.tolerance for log in flights.values()})
    for tolerance in tolerances:
        axes.axhline(tolerance, color=INK, lw=0.7, ls="--")
    axes.set_yscale("log")
    axes.set_ylim(bottom=10.0 ** math.floor(math.log10(max(0.2 * min(lowest), _LEAST_ERROR))))
    of = ", peak of each second" if peaks else ""
    _title(axes, f"|range error|, m{of} (dashed: tolerance, {', '.join(f'{t:.3g}' for t in tolerances)} m)")


def rate(axes: Axes, flights: Flights) -> None:
    """The heading rate flown, and thinly the law's command."""
    for log, style in _styled(flights):
        axes.plot(log["time"], np.degrees(log["heading_rate_command"]), **_thin(style))
        axes.plot(log["time"], np.degrees(log["heading_rate"]), **style)
    _title(axes, "heading rate, deg/s (thin: the law's command)")


def bank(axes: Axes, flights: Flights) -> None:
    """The bank of the plants that have one, and thinly the bank that the inner loop commands."""
    for log, style in _styled(flights):
        axes.plot(log["time"], np.degrees(log["bank_command"]), **_thin(style))
        axes.plot(log["time"], np.degrees(log["bank"]), **style)
    _title(axes, "bank, deg (thin: its command)")


def sideslip(axes: Axes, flights: Flights) -> None:
    """The sideslip of the plants that have one."""
    for log, style in _styled(flights):
        axes.plot(log["time"], np.degrees(log["sideslip"]), **style)
    _title(axes, "sideslip, deg")


def spectrum(axes: Axes, flights: Flights) -> None:
    """The amplitude spectrum of the law's command in the judged window; a dot marks a limit cycle."""
    highest = 0.0
    for log, style in _styled(flights):
        signals = Signals(log)
        frequency, amplitude = command_spectrum(signals)
        axes.plot(frequency, amplitude, **style)
        highest = max(highest, float(amplitude.max(initial=0.0)))
        if (cycle := signals.limit_cycle) is not None:
            at = np.searchsorted(frequency, cycle.frequency, side="right") - 1
            axes.plot(frequency[at], amplitude[at], "o", color=style["color"], ms=4)
    axes.set_xscale("log")
    axes.set_yscale("log")
    top = max(2.0 * highest, 1e-3)
    axes.set_ylim(1e-5 * top, top)
    axes.set_xlabel("Hz")
    _title(axes, "command's spectrum, deg/s (dot: limit cycle)")


def command_spectrum(signals: Signals) -> tuple[Array, Array]:
    """Frequency, Hz, and amplitude, deg/s, of the law's command while circling is judged; empty of a short record."""
    frequency, amplitude = spectrum_of(signals.circling("heading_rate_command"), signals.period)
    return frequency, np.asarray(np.degrees(amplitude), np.float64)


class Panel(NamedTuple):
    """A panel of a figure."""

    draw: Callable[[Axes, Flights], None]
    over_time: bool
    column: str = "time"  # of the log, without which a flight has nothing to show here

    def has(self, log: FlightLog) -> bool:
        """Whether the flight has anything to show."""
        return bool(np.isfinite(log[self.column]).any())


PANELS: Mapping[str, Panel] = MappingProxyType(
    {
        "track": Panel(track, False),
        "error": Panel(error, True),
        "rate": Panel(rate, True),
        "bank": Panel(bank, True, "bank"),
        "sideslip": Panel(sideslip, True, "sideslip"),
        "spectrum": Panel(spectrum, False),
    }
)


def named(logs: Sequence[FlightLog]) -> Flights:
    """The flights by their plants, numbered where two have the same."""
    plants = [log.flight.plant for log in logs]
    if len(set(plants)) == len(plants):
        return dict(zip(plants, logs, strict=True))
    return {f"{number} {log.flight.plant}": log for number, log in enumerate(logs, 1)}


def _columns(panels: Sequence[str]) -> tuple[list[str], list[str]]:
    """The panels on the left, and those on the right: over time."""
    left, right = ([name for name in panels if PANELS[name].over_time is side] for side in (False, True))
    return left, right


def _styled(flights: Flights) -> list[tuple[FlightLog, dict[str, Any]]]:
    """Each flight with colour, width and label; of one that ended early the label says how and when."""
    styled: list[tuple[FlightLog, dict[str, Any]]] = []
    for (name, log), colour in zip(flights.items(), COLOURS, strict=False):
        early = log.outcome is not Outcome.COMPLETED
        ended = f" ({log.outcome.value} at {log['time'][-1]:.4g} s)" if early else ""
        width = _WIDE if len(flights) > 1 and not styled else _THIN
        styled.append((log, {"color": colour, "lw": width, "label": name + ended}))
    return styled


def _thin(style: Mapping[str, Any]) -> dict[str, Any]:
    return {"color": style["color"], "lw": 0.5, "alpha": 0.5}


def _wind(axes: Axes, log: FlightLog) -> None:
    """The steady wind, as an arrow in a corner, with its speed above the panel."""
    north, east = log.flight.wind.steady
    speed = math.hypot(north, east)
    if speed:
        x, y = 0.07 * east / speed, 0.07 * north / speed
        tip, tail, arrow = (0.1 + x, 0.9 + y), (0.1 - x, 0.9 - y), {"arrowstyle": "->", "color": INK, "lw": 0.8}
        axes.annotate("", tip, tail, "axes fraction", "axes fraction", arrow)
        _title(axes, f"arrow: wind, {speed:.3g} m/s")


def _title(axes: Axes, text: str) -> None:
    axes.set_title(text, fontsize="medium", loc="left", pad=3)
