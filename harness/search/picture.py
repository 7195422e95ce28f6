"""The picture of a map: a panel for each combination, the border, the flights, and the predicted limit cycle."""

import re
from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import NDArray

from harness.drawing import COLUMN, INK, PAGE, Picture, picture
from harness.log.metric import METRICS
from harness.requirement import OUTCOME
from harness.search.border import Answer, lines
from harness.search.dimension import Dimension
from harness.search.map import CONVERGED, Map, MapPanel
from harness.settings.catalogue import TABLES, keys_of
from harness.settings.keys import vector_of
from harness.verdict.figures import BORDER, MOST_ACROSS, SHADES, UNKNOWN
from harness.verdict.pairs import shown

_FILLS = ("#f4ecd8", "#56B4E9", "#CC79A7", "#009E73", "#E69F00", "#0072B2", "#F0E442")  # light and dark in turns
_OPEN = "////"  # hatching of what is not located
_UNIT = re.compile(r"(1/)?(m|s|rad)[\w/ ]*(?=: )")  # of a gain, at the beginning of its meaning
_WORDS = {True: "yes", False: "no"}


def drawn(found: Map) -> Picture:
    """The map as a figure in print size."""
    across = min(len(found.panels), MOST_ACROSS)
    down = -(-len(found.panels) // across)
    width = COLUMN * 1.3 if across == 1 else PAGE
    return picture(partial(_paint, found=found), width, down * (0.8 * width / across + 0.45) + 0.9)


def _paint(figure: Figure, found: Map) -> None:
    across = min(len(found.panels), MOST_ACROSS)
    panels = figure.subplots(-(-len(found.panels) // across), across, squeeze=False)
    answers = [answer for panel in found.panels for answer in panel.border.answers.values()]
    words = _words(answers)
    scale = _scale(answers) if found.question.is_number else None
    shown_lines: set[str] = set()
    for i, (axes, panel) in enumerate(zip(panels.flat, found.panels, strict=False)):
        _panel(axes, found, panel, words, scale, shown_lines)
        axes.set_ylabel("" if i % across else label(found.y))
        axes.set_xlabel(label(found.x))
    for axes in panels.flat[len(found.panels) :]:
        axes.remove()
    figure.suptitle(heading(found), fontsize="medium")
    if scale:
        figure.colorbar(ScalarMappable(scale, SHADES), ax=figure.axes, fraction=0.05, pad=0.02)
    figure.legend(
        handles=[*_patches(found, words), *_lines(shown_lines)],
        loc="outside lower center", ncols=5, frameon=False, fontsize="small",
    )  # fmt: skip


def heading(found: Map) -> str:
    """The legend of the colours."""
    text = found.question.text
    if text == CONVERGED:
        return "Does the flight converge?"
    if text == OUTCOME:
        return "How the flight ends"
    if text not in METRICS:
        return text
    metric = METRICS[text]
    name = metric.heading[0].upper() + metric.heading[1:]
    return f"{name}, {metric.label}" if found.question.is_number else f"{name}?"


def label(dimension: Dimension) -> str:
    """The setting with its unit."""
    key = vector_of(dimension.key) or dimension.key
    found = (each for table in TABLES for each in keys_of(table) if table.prefix + each.key == key)
    units = (each.unit or (gain[0] if (gain := _UNIT.match(each.meaning)) else "") for each in found)
    unit = next(units, "")
    return f"{dimension.key}, {unit}" if unit else dimension.key


def _words(answers: Sequence[Answer]) -> list[Answer]:
    """The answers that are not numbers, in the order of their colours: no, yes; words by frequency."""
    different = {answer for answer in answers if answer is not None and not isinstance(answer, float)}
    if different <= {True, False}:
        return [False, True] if different else []
    return sorted(different, key=lambda word: (-answers.count(word), str(word)))


def _scale(answers: Sequence[Answer]) -> Normalize:
    known = [answer for answer in answers if isinstance(answer, float) and not isinstance(answer, bool)]
    low, high = min(known, default=0.0), max(known, default=0.0)
    if low > 0.0 and high > 100.0 * low:
        return LogNorm(low, high)
    return Normalize(low, high if high > low else low + 1.0)


def _panel(
    axes: Axes, found: Map, panel: MapPanel, words: Sequence[Answer], scale: Normalize | None, shown_lines: set[str]
) -> None:
    border, side = panel.border, panel.border.side
    axes.set_facecolor(UNKNOWN)
    axes.grid(visible=False)
    for d, set_scale, axis in ((found.x, axes.set_xscale, axes.xaxis), (found.y, axes.set_yscale, axes.yaxis)):
        if d.is_log:
            set_scale("log")
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axis.set_major_formatter("{x:g}")
            axis.set_minor_formatter(NullFormatter())
    at = np.clip((np.arange(side + 2) - 0.5) / side, 0.0, 1.0)
    edges = [np.array([_exact(d, share) for share in at]) for d in (found.x, found.y)]
    if border.is_begun:
        filled = border.filled()
        if scale:
            colours = np.array([[_number(answer) for answer in row] for row in filled])
            axes.pcolormesh(*edges, np.ma.masked_invalid(colours), cmap=SHADES, norm=scale, rasterized=True)
        elif words:
            places = {word: float(i) for i, word in enumerate(words)}
            colours = np.array([[places.get(answer, np.nan) for answer in row] for row in filled])
            fills = ListedColormap(_FILLS[: len(words)])
            norm = Normalize(-0.5, len(words) - 0.5)
            axes.pcolormesh(*edges, np.ma.masked_invalid(colours), cmap=fills, norm=norm, rasterized=True)
    squares = border.squares()
    for square in squares:
        if square.open:
            x, y = _place(found, panel, (square.x, square.y))
            far_x, far_y = _place(found, panel, (square.x + square.side, square.y + square.side))
            axes.add_patch(Rectangle((x, y), far_x - x, far_y - y, fc="white", ec=INK, lw=0.0, hatch=_OPEN, alpha=0.6))
            shown_lines.add("open")
    segments = [[_place(found, panel, a), _place(found, panel, b)] for a, b in lines(squares)]
    if segments:
        axes.add_collection(LineCollection(segments, colors=INK, linewidths=1.1, capstyle="round"))
        shown_lines.add("border")
    flown = np.array([_place(found, panel, point) for point in panel.keys])
    if len(flown):
        axes.plot(*flown.T, ".", color=INK, ms=1.8, mew=0.0, alpha=0.8)
    margins = found.predicted(panel)
    if margins is not None and _cycle(axes, found, margins):
        shown_lines.add("cycle")
    axes.set_xlim(found.x.low, found.x.high)
    axes.set_ylim(found.y.low, found.y.high)
    axes.set_title("\n".join(f"{key} = {shown(value)}" for key, value in _at(found, panel).items()), fontsize="small")


def _at(found: Map, panel: MapPanel) -> dict[str, object]:
    """The title of a panel, which includes the plant."""
    flight = found.space.matrix.file.document["flight"]
    plant = {"plant": flight["plant"]} if isinstance(flight, Mapping) and "plant" in flight else {}
    return {**plant, **panel.at}


def _cycle(axes: Axes, found: Map, margins: NDArray[np.float64]) -> bool:
    """The border of the predicted limit cycle, where the margin is one; whether there is any."""
    if not np.nanmin(margins) < 1.0 < np.nanmax(margins):
        return False
    shares = np.linspace(0.0, 1.0, len(margins))
    x, y = (np.array([_exact(d, share) for share in shares]) for d in (found.x, found.y))
    drawn = axes.contour(x, y, np.log(np.clip(margins, 0.05, 20.0)), levels=[0.0], colors=BORDER, linewidths=1.8,
                         linestyles="dashed")  # fmt: skip
    return any(len(line) for line in drawn.allsegs[0])


def _exact(dimension: Dimension, share: float) -> float:
    return dimension.value(share, digits=12)


def _place(found: Map, panel: MapPanel, point: tuple[float, float]) -> tuple[float, float]:
    x, y = (step / panel.border.side for step in point)
    return _exact(found.x, x), _exact(found.y, y)


def _number(answer: object) -> float:
    return answer if isinstance(answer, float) and not isinstance(answer, bool) else np.nan


def _patches(found: Map, words: Sequence[Answer]) -> list[Patch]:
    patches = [
        Patch(fc=fill, ec=INK, lw=0.4, label=_WORDS[word] if isinstance(word, bool) else str(word))
        for fill, word in zip(_FILLS, words, strict=False)
    ]
    if any(answer is None for panel in found.panels for answer in panel.border.answers.values()):
        patches.append(Patch(fc=UNKNOWN, ec=INK, lw=0.4, label="none" if found.question.is_number else "unknown"))
    return patches


def _lines(kinds: set[str]) -> list[Line2D | Patch]:
    handles: list[Line2D | Patch] = [Line2D([], [], ls="", marker=".", color=INK, ms=3, label="flown")]
    if "border" in kinds:
        handles.append(Line2D([], [], color=INK, lw=1.1, label="border, flown"))
    if "cycle" in kinds:
        handles.append(Line2D([], [], color=BORDER, lw=1.8, ls="dashed", label="limit cycle, predicted"))
    if "open" in kinds:
        handles.append(Patch(fc="white", ec=INK, hatch=_OPEN, label="not located"))
    return handles
