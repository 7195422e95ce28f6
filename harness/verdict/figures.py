"""The figures of the report, as SVG: the same text each time, readable in grey."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure

from harness.drawing import COLOURS as LINES
from harness.log.metric import METRICS, YES_OR_NO
from harness.verdict.answer import place, plain, signed
from harness.verdict.comparison import Scorecard
from harness.verdict.curve import CurveSet
from harness.verdict.effects import Ladder
from harness.verdict.flown import TOLD
from harness.verdict.grid import Grid
from harness.verdict.pairs import shown
from harness.verdict.parts import Part
from harness.vocabulary import Verdict

INK, GREY, UP, DOWN, BAND = "#1c2733", "#9aa5b1", "#c4501b", "#2a6f97", "#dfe8d8"
COLOURS = {Verdict.HOLDS: "#2d6a3e", Verdict.FAILS: "#a4361c", Verdict.UNDECIDED: "#5b6876"}
MARKERS = {Verdict.HOLDS: "o", Verdict.FAILS: "X", Verdict.UNDECIDED: "D"}
MOST_CELLS = 40  # largest number of cells drawn for a part
SHADES, UNKNOWN, BORDER = "cividis", "#cccccc", "#D55E00"  # of maps, for colour-blind eyes too
MOST_ACROSS, MOST_MAPS = 3, 12
MOST_NUMBERS = 60  # largest number of cells of a map with numbers


def intervals(figure: Figure, card: Scorecard, parts: Sequence[Part]) -> None:
    """Each part's difference in every cell with its 95 % interval; the margin is shaded, the word is the marker."""
    panels = figure.subplots(1, len(parts), squeeze=False)[0]
    for axes, part in zip(panels, parts, strict=True):
        judgements = card.of(part.column)[:MOST_CELLS]
        for row, judgement in enumerate(judgements):
            y, colour = len(judgements) - 1 - row, COLOURS[Verdict(judgement.word)]
            if judgement.low < judgement.high:
                axes.plot([judgement.low, judgement.high], [y, y], color=colour, lw=1.2)
            axes.plot(judgement.difference, y, MARKERS[Verdict(judgement.word)], color=colour, ms=4)
        low, high = judgements[0].bounds
        if not part.relative:
            left, right = axes.get_xlim()
            least, most = min(left, 0.0, low or 0.0), max(right, 0.0, high or 0.0)
            axes.axvspan(least if low is None else low, most if high is None else high, color=BAND, lw=0, zorder=0)
            axes.set_xlim(least, most)
        axes.axvline(0.0, color=GREY, lw=0.6)
        names = [place(judgement.at) for judgement in judgements[::-1]]
        axes.set_yticks(range(len(judgements)), names if axes is panels[0] else [""] * len(names), fontsize=6)
        axes.set_title(f"{part.title}\n[{part.unit}]", fontsize=8)
        axes.tick_params(axis="x", labelsize=7)
        axes.locator_params(axis="x", nbins=4)


def waterfall(figure: Figure, ladders: Sequence[Ladder]) -> None:
    """The effect of each plant of the ladder in one cell, a panel per metric, with the intervals of the steps."""
    panels = figure.subplots(1, len(ladders), squeeze=False)[0]
    for axes, ladder in zip(panels, ladders, strict=True):
        _falls(axes, ladder)


def _falls(axes: Axes, ladder: Ladder) -> None:
    metric = METRICS[ladder.metric]
    names = ["first\nrung", *(f"{step.plant}\nadds" for step in ladder.steps), "last\nrung"]
    axes.bar(0, ladder.start, color=GREY, width=0.7)
    level = ladder.start
    for i, step in enumerate(ladder.steps, 1):
        mean, (low, high) = step.of.mean, step.interval
        axes.bar(i, mean, bottom=level, color=UP if mean > 0 else DOWN, width=0.7)
        if low < high:
            axes.plot([i, i], [level + low, level + high], color=INK, lw=1.1)
        top = max(level, level + mean, level + (0.0 if math.isnan(high) else high))
        axes.annotate(signed(mean), (i, top), (0, 2), textcoords="offset points", ha="center", fontsize=7)
        level += mean
    last = len(ladder.steps) + 1
    axes.bar(last, ladder.end, color=GREY, width=0.7)
    for i, value in ((0, ladder.start), (last, ladder.end)):
        axes.annotate(plain(value), (i, max(value, 0.0)), (0, 2), textcoords="offset points", ha="center", fontsize=7)
    axes.set_xticks(range(last + 1), names, fontsize=6)
    axes.set_title(f"{metric.heading}\n[{metric.unit}]", fontsize=8)
    axes.axhline(0.0, color=INK, lw=0.6)
    axes.margins(y=0.15)
    axes.tick_params(axis="y", labelsize=7)
    if np.isfinite(level) and min(ladder.start, ladder.end) >= 0:
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))


def curve_set(figure: Figure, curves: CurveSet) -> None:
    """Each metric over the numeric axis, a line for each value of what is compared, bars for the intervals."""
    panels = figure.subplots(1, len(TOLD), squeeze=False)[0]
    for axes, name in zip(panels, TOLD, strict=True):
        metric = METRICS[name]
        for i, (label, line) in enumerate(curves.lines.items()):
            known = [point for point in line[name] if not math.isnan(point.mean)]
            colour, marker = LINES[i % len(LINES)], "osD^v"[i % 5]
            x = [point.x for point in known]
            axes.plot(
                x, [metric.scale * p.mean for p in known], marker, ls="-", color=colour, ms=4, lw=1.2, label=label
            )
            for point in known:
                if point.low < point.high:
                    ends = [metric.scale * point.low, metric.scale * point.high]
                    axes.plot([point.x, point.x], ends, color=colour, lw=1.0)
        axes.set_title(f"{metric.heading}\n[{metric.label}]", fontsize=8)
        axes.set_xlabel(curves.axis, fontsize=8)
        axes.tick_params(labelsize=7)
        axes.locator_params(axis="x", nbins=5)
    if any(curves.lines):
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False,
                      fontsize="small")  # fmt: skip


def heat_maps(figure: Figure, grids: Sequence[Grid]) -> None:
    """Maps of one metric on one scale of colours; the line is the border beyond which a limit cycle is predicted."""
    known = [cell.value for grid in grids for cell in grid.cells.values() if not math.isnan(cell.value)]
    scale = _scale(known)
    across = min(len(grids), MOST_ACROSS)
    panels = figure.subplots(-(-len(grids) // across), across, squeeze=False)
    for i, (axes, grid) in enumerate(zip(panels.flat, grids, strict=False)):
        _map(axes, grid, scale)
        axes.set_ylabel("" if i % across else grid.rows[0])
    for axes in panels.flat[len(grids) :]:
        axes.remove()
    metric = METRICS[grids[0].metric]
    unit = "share of flights" if metric.unit == YES_OR_NO else metric.label
    beyond = {cell.beyond for grid in grids for cell in grid.cells.values()}
    border = " (line: border of the predicted limit cycle)" if len(beyond) > 1 else ""
    figure.suptitle(f"{metric.heading}, {unit}{border}", fontsize="medium")
    figure.colorbar(ScalarMappable(scale, SHADES), ax=figure.axes, fraction=0.05, pad=0.02)


def _scale(known: Sequence[float]) -> Normalize:
    """The scale of colours: logarithmic if the values differ by decades."""
    low, high = min(known, default=0.0), max(known, default=0.0)
    if low > 0.0 and high > 100.0 * low:
        return LogNorm(low, high)
    return Normalize(low, high if high > low else low + 1.0)


def _map(axes: Axes, grid: Grid, scale: Normalize) -> None:
    (_, rows), (across, columns) = grid.rows, grid.columns
    cells = [[grid.cells.get((row, column)) for column in columns] for row in rows]
    values = np.array([[cell.value if cell else math.nan for cell in line] for line in cells])
    axes.pcolormesh(values, cmap=SHADES, norm=scale)
    axes.set_facecolor(UNKNOWN)
    for y, line in enumerate(cells):
        for x, cell in enumerate(line):
            if len(rows) * len(columns) <= MOST_NUMBERS and cell and not math.isnan(cell.value):
                ink = INK if scale(cell.value) > 0.5 else "white"
                axes.text(x + 0.5, y + 0.5, grid.text(cell), ha="center", va="center", fontsize="x-small", color=ink)
            beyond = cell is not None and cell.beyond
            right = line[x + 1] if x + 1 < len(line) else None
            above = cells[y + 1][x] if y + 1 < len(cells) else None
            if right and cell and right.beyond is not beyond:
                axes.plot([x + 1, x + 1], [y, y + 1], color=BORDER, lw=2.0)
            if above and cell and above.beyond is not beyond:
                axes.plot([x, x + 1], [y + 1, y + 1], color=BORDER, lw=2.0)
    axes.set_xticks(
        np.arange(len(columns)) + 0.5, [shown(value) for value in columns], rotation=90 * (len(columns) > 8)
    )
    axes.set_yticks(np.arange(len(rows)) + 0.5, [shown(value) for value in rows])
    axes.grid(visible=False)
    axes.set_xlabel(across)
    axes.set_title("\n".join(f"{axis} = {shown(value)}" for axis, value in grid.at.items()), fontsize="small")
