"""A page of a recorded flight: what was said of it and what was refused, with pictures, in one HTML file."""

import textwrap
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from harness.drawing import COLOURS, FAINT, INK, draw
from harness.recorded import panels as drawn
from harness.recorded.assessment import Assessment
from harness.recorded.beside import ModelFlight
from harness.recorded.contents import HEADINGS, duration, rows
from harness.recorded.part_finding import CANNOT
from harness.recorded.recorded_flight import RecordedFlight
from harness.recorded.said import HEADINGS as SAID_HEADINGS
from harness.recorded.said import beside_rows, row, wind_line
from harness.template import template

_COLOUR = {drawn.COMMANDED: COLOURS[4], drawn.FLOWN: INK, drawn.OTHER: COLOURS[1]}


def page(whole: RecordedFlight, found: Assessment, command: str, model: ModelFlight | None = None) -> str:
    """The page, which loads nothing; with the model's flight, if there is one, beside the recorded one."""
    shown = list(drawn.panels(whole, found))
    above = draw(partial(_above, whole=whole, found=found), height=4.2)
    below = draw(partial(_over_time, whole=whole, found=found, shown=shown), height=0.6 + 1.5 * max(1, len(shown)))
    return template("harness.recorded", "page.html.jinja").render(
        flight=whole,
        found=found,
        judged_from=drawn.judged(found),
        seconds=f"{duration(whole):.1f}",
        judged=[(finding.word, row(finding)) for finding in found.findings if finding.word != CANNOT],
        refused=[finding for finding in found.findings if finding.word == CANNOT],
        headings=SAID_HEADINGS,
        wind=list(wind_line(found)),
        model=model,
        beside=beside_rows(found, model) if model else [],
        above=above,
        below=below if shown else "",
        channel_headings=[heading.replace("\n", " ") for heading in HEADINGS],
        channels=list(rows(whole)),
        command=command,
        cannot=CANNOT,
    )


def _above(figure: Figure, whole: RecordedFlight, found: Assessment) -> None:
    left, right = figure.subplots(1, 2)
    places = drawn.track(whole)
    left.set_aspect("equal", adjustable="datalim")
    left.set_xlabel("east, m")
    left.set_ylabel("north, m")
    if places:
        time, north, east = places
        begin, end = drawn.judged(found) or (np.inf, -np.inf)
        inside = (time >= begin) & (time <= end)
        left.plot(east, north, color=FAINT, linewidth=0.8, label="not judged")
        left.plot(
            np.where(inside, east, np.nan), np.where(inside, north, np.nan), color=INK, linewidth=1.2, label="judged"
        )
        left.plot(east[0], north[0], "o", color=COLOURS[2], markersize=5, label="begin of the log")
        if whole.failure:
            k = min(int(np.searchsorted(time, whole.failure.time)), len(time) - 1)
            left.plot(east[k], north[k], "x", color=COLOURS[1], markersize=8, label="failure")
        left.legend(loc="best", fontsize=7)
    else:
        left.text(0.5, 0.5, "no position in the log", ha="center", va="center", transform=left.transAxes)
    left.set_title("From above")
    _scatter(right, found)


def _scatter(axes: Axes, found: Assessment) -> None:
    axes.set_title("Turn relation, a point for each window")
    shown = drawn.scatter(found)
    if not shown:
        finding = drawn.turn_finding(found)
        why = finding.reason if finding else ""
        text = "\n".join(textwrap.wrap(f"{CANNOT}: {why}", 48))
        axes.text(0.5, 0.5, text, ha="center", va="center", transform=axes.transAxes, fontsize=8)
        axes.set_xticks([])
        axes.set_yticks([])
        return
    reach = 1.15 * max(float(np.abs(shown.asked).max()), float(np.abs(shown.flown).max()))
    x = np.array([-reach, 0.0, reach])
    low, high = (np.clip(slope, -10.0, 10.0) for slope in shown.allowed)
    axes.fill_between(x, low * x, high * x, color=COLOURS[2], alpha=0.15, linewidth=0, label="allowed")
    axes.fill_between(x, shown.low * x, shown.high * x, color=COLOURS[0], alpha=0.2, linewidth=0, label="95 % interval")
    axes.plot(x, shown.slope * x, color=COLOURS[0], linewidth=1.2, label=f"{shown.slope:.3g}: {shown.word}")
    axes.plot(shown.asked, shown.flown, "o", color=INK, markersize=4)
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-reach, reach)
    axes.set_xlabel("g tan(bank)/V, deg/s")
    axes.set_ylabel("turn rate of the air velocity, deg/s")
    axes.legend(loc="upper left", fontsize=7)


def _over_time(figure: Figure, whole: RecordedFlight, found: Assessment, shown: list[drawn.FlightPanel]) -> None:
    every = figure.subplots(max(1, len(shown)), 1, sharex=True, squeeze=False)[:, 0]
    for axes, panel in zip(every, shown, strict=False):
        if span := drawn.judged(found):
            axes.axvspan(*span, color=COLOURS[4], alpha=0.08, linewidth=0)
        for line in panel.lines:
            style = "steps-post" if line.held else "default"
            axes.plot(line.time, line.values, color=_COLOUR[line.kind], linewidth=0.9, drawstyle=style, label=line.name)
        if whole.failure:
            axes.axvline(whole.failure.time, color=COLOURS[1], linewidth=0.8, linestyle="--")
        axes.ticklabel_format(axis="y", useOffset=False)
        axes.set_ylabel(f"{panel.title}{f', {panel.unit}' if panel.unit else ''}", fontsize=7)
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.96), ncols=3, frameon=False, fontsize=6)
    every[-1].set_xlabel("time, s; shaded: judged" + ("; dashed: failure" if whole.failure else ""))
