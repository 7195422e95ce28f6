"""The picture of a flight: its track on the map, and its errors over time."""

import io
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from harness.log.flight_log import FlightLog

COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:red", "tab:purple", "tab:brown")


class Picture(Figure):
    """A figure that a notebook shows by itself, without pyplot and its global state."""

    def _repr_png_(self) -> bytes:
        out = io.BytesIO()
        self.savefig(out, format="png")
        return out.getvalue()


def picture(logs: Sequence[FlightLog]) -> Figure:
    """Tracks of flights around their targets, range error, heading rate, bank and sideslip over time.

    ValueError for more flights than there are colours, and for a flight without a row.
    """
    if len(logs) > len(COLOURS):
        raise ValueError(f"{len(logs)} flights: up to {len(COLOURS)} can be told apart")
    if without := [log for log in logs if not len(log)]:
        raise ValueError(f"nothing to draw: {without[0].reason}")
    names = _names(logs)
    banked = any(np.isfinite(log["bank"]).any() for log in logs)
    figure = Picture(figsize=(10.0, 5.4), dpi=80, layout="constrained")
    grid = figure.add_gridspec(3 if banked else 2, 2, width_ratios=(1.0, 1.1))
    ground = figure.add_subplot(grid[:, 0])
    rows = [figure.add_subplot(grid[0, 1])]
    rows += [figure.add_subplot(grid[row, 1], sharex=rows[0]) for row in range(1, grid.nrows)]
    draw_track(ground, logs, names)
    draw_range_error(rows[0], logs)
    draw_heading_rate(rows[1], logs)
    if banked:
        draw_bank(rows[2], logs)
    for axes in rows[:-1]:
        axes.tick_params(labelbottom=False)
    rows[-1].set_xlabel("time, s")
    for axes in (ground, *rows):
        axes.grid(alpha=0.3)
    figure.suptitle("   ".join(f"{name}: {ended(log)}" for name, log in zip(names, logs, strict=True)), fontsize=10)
    return figure


def ended(log: FlightLog) -> str:
    """How the flight ended, in a few words."""
    return log.outcome.value + (f" at {log['time'][-1]:.1f} s: {log.reason}" if log.reason and len(log) else "")


def draw_track(axes: Axes, logs: Sequence[FlightLog], names: Sequence[str]) -> None:
    """North up, east to the right, equal scales; the standoff circle is around the target where it ends."""
    for log, name, colour in zip(logs, names, COLOURS, strict=False):
        axes.plot(log["east"], log["north"], color=colour, lw=1.2, label=name)
        axes.plot(log["east"][:1], log["north"][:1], "o", color=colour, ms=5)
    axes.plot([], [], "o", color="tab:gray", ms=5, label="start")
    around = np.linspace(0.0, 2.0 * np.pi, 361)
    circled = {
        (log.flight.target, log.flight.law.standoff): log for log in sorted(logs, key=len)
    }  # the longest of each
    for (_, standoff), log in circled.items():
        east, north = log["target_east"], log["target_north"]
        if np.ptp(east) or np.ptp(north):
            axes.plot(east, north, color="black", lw=0.8, ls=":", label="target's track")
        axes.plot(east[-1:], north[-1:], "x", color="black", ms=7, label="target")
        circle = east[-1] + standoff * np.sin(around), north[-1] + standoff * np.cos(around)
        axes.plot(*circle, color="black", lw=0.8, ls="--", label=f"standoff circle, {standoff:g} m")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("east, m")
    axes.set_ylabel("north, m")
    handles = {handle.get_label(): handle for handle in axes.get_legend_handles_labels()[0]}  # each label once
    axes.legend(
        handles=handles.values(), fontsize=8, ncols=3, frameon=False, loc="upper center", bbox_to_anchor=(0.5, -0.12)
    )


def draw_range_error(axes: Axes, logs: Sequence[FlightLog]) -> None:
    """Distance to the target minus the standoff distance; the band is the tolerance of convergence."""
    for log, colour in zip(logs, COLOURS, strict=False):
        axes.plot(log["time"], log["range_error"], color=colour, lw=1.2)
    tolerance = logs[0].flight.metrics.tolerance
    axes.axhspan(-tolerance, tolerance, color="tab:green", alpha=0.25, lw=0)
    axes.set_yscale("symlog", linthresh=tolerance)
    _title(axes, f"range error, m (band: the tolerance of convergence, {tolerance:g} m)")


def draw_heading_rate(axes: Axes, logs: Sequence[FlightLog]) -> None:
    """Flown, and thinly the command."""
    for log, colour in zip(logs, COLOURS, strict=False):
        axes.plot(log["time"], np.degrees(log["heading_rate_command"]), color=colour, lw=0.6, alpha=0.5)
        axes.plot(log["time"], np.degrees(log["heading_rate"]), color=colour, lw=1.2)
    _title(axes, "heading rate, deg/s (thin: its command)")


def draw_bank(axes: Axes, logs: Sequence[FlightLog]) -> None:
    """Bank and sideslip of the plants that have them."""
    for log, colour in zip(logs, COLOURS, strict=False):
        axes.plot(log["time"], np.degrees(log["bank"]), color=colour, lw=1.2)
        axes.plot(log["time"], np.degrees(log["sideslip"]), color=colour, lw=0.8, ls="--")
    _title(axes, "bank, deg (dashed: sideslip)")


def _title(axes: Axes, text: str) -> None:
    axes.set_title(text, fontsize=9, loc="left", pad=3)


def _names(logs: Sequence[FlightLog]) -> list[str]:
    """The plant of each flight, numbered where two have the same."""
    plants = [log.flight.plant for log in logs]
    if len(set(plants)) == len(plants):
        return plants
    return [f"{number} {plant}" for number, plant in enumerate(plants, 1)]
