"""The figures of the report, as SVG: the same text each time, readable in grey."""

import io
from collections.abc import Callable, Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from harness.verdict.attribution import METRICS, Attribution, Ladder, Step
from harness.verdict.comparison import Comparison
from harness.verdict.pairs import spread
from harness.verdict.parts import PARTS
from harness.verdict.words import plain, signed

INK, GREY, UP, DOWN, BAND = "#1c2733", "#9aa5b1", "#c4501b", "#2a6f97", "#dfe8d8"
LINES = ("#1f5fa8", "#e08020", "#3a9a4b", "#8a4fa3", "#b03a48", "#5c6b73")
DASHES = ("-", "--", ":", "-.")
_MOST_POINTS = 200  # of a distribution: more cannot be seen


def draw(paint: Callable[[Figure], None], width: float = 9.6, height: float = 3.2) -> str:
    """The SVG that `paint` makes."""
    with mpl.rc_context(
        {
            "svg.hashsalt": "verdict",
            "font.size": 9,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "axes.edgecolor": GREY,
            "axes.labelcolor": INK,
            "text.color": INK,
            "xtick.color": INK,
            "ytick.color": INK,
        }
    ):
        figure = Figure(figsize=(width, height), layout="constrained")
        paint(figure)
        out = io.StringIO()
        figure.savefig(out, format="svg", metadata={"Date": None}, transparent=True)
    return out.getvalue()[out.getvalue().index("<svg") :]


def waterfall(figure: Figure, attribution: Attribution) -> None:
    """What each rung of the ladder adds, a panel per metric; bars of the intervals of the steps."""
    ladders = attribution.ladders
    panels = figure.subplots(2, (len(ladders) + 1) // 2, squeeze=False)
    for axes, ladder in zip(panels.flat, ladders, strict=False):
        _falls(axes, ladder, attribution.rungs)
    for axes in panels.flat[len(ladders) :]:
        axes.set_axis_off()


def _falls(axes: Axes, ladder: Ladder, rungs: Sequence[str]) -> None:
    title, unit = METRICS[ladder.metric]
    names = [rungs[0], *(f"{step.plant}\nadds" for step in ladder.steps), rungs[-1]]
    axes.bar(0, ladder.start, color=GREY, width=0.7)
    level = ladder.start
    for i, step in enumerate(ladder.steps, 1):
        mean, low, high = step.effect[:3]
        axes.bar(i, mean, bottom=level, color=UP if mean > 0 else DOWN, width=0.7)
        if low is not None and high is not None:
            axes.plot([i, i], [level + low, level + high], color=INK, lw=1.1)
        top = max(level, level + mean, level + (high or 0.0))
        axes.annotate(signed(mean), (i, top), (0, 2), textcoords="offset points", ha="center", fontsize=8)
        axes.plot([i - 1.35, i + 0.35], [level, level], color=GREY, lw=0.7)
        level += mean
    last = len(ladder.steps) + 1
    axes.plot([last - 1.35, last + 0.35], [level, level], color=GREY, lw=0.7)
    axes.bar(last, ladder.end, color=GREY, width=0.7)
    for i, value in ((0, ladder.start), (last, ladder.end)):
        axes.annotate(plain(value), (i, max(value, 0.0)), (0, 2), textcoords="offset points", ha="center", fontsize=8)
    axes.set_xticks(range(last + 1), names, fontsize=7)
    axes.set_title(f"{title} [{unit}]", fontsize=9)
    axes.axhline(0.0, color=INK, lw=0.6)
    axes.use_sticky_edges = False  # room for the numbers above the bars
    axes.margins(y=0.12)
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]) if min(ladder.start, ladder.end) < 0 else 0.0)


def disturbances(figure: Figure, attribution: Attribution) -> None:
    """What each disturbance adds, on the first rung and on the last, with intervals."""
    steps = attribution.disturbances
    whats = list(dict.fromkeys(step.what for step in steps))
    plants = list(dict.fromkeys(step.plant for step in steps))
    metrics = list(dict.fromkeys(step.metric for step in steps))
    panels = figure.subplots(1, len(metrics), sharey=True, squeeze=False)[0]
    for axes, metric in zip(panels, metrics, strict=True):
        for step in (step for step in steps if step.metric == metric):
            _bar(axes, step, len(whats) - 1 - whats.index(step.what), plants.index(step.plant), len(plants))
        title, unit = METRICS[metric]
        axes.set_title(f"{title}\n[{unit}]", fontsize=8)
        axes.axvline(0.0, color=INK, lw=0.6)
        axes.tick_params(labelsize=7)
        axes.margins(x=0.1)
        axes.locator_params(axis="x", nbins=3)
    panels[0].set_yticks(range(len(whats)), whats[::-1], fontsize=8)
    patches = [Patch(color=colour, label=plant) for plant, colour in zip(plants, (GREY, UP), strict=False)]
    figure.legend(handles=patches, loc="outside lower center", ncols=2, frameon=False, fontsize=8)


def _bar(axes: Axes, step: Step, row: int, which: int, of: int) -> None:
    mean, low, high = step.effect[:3]
    height = 0.8 / of
    y = row + (0.5 * (of - 1) - which) * height
    axes.barh(y, mean, height=0.9 * height, color=(GREY, UP)[which])
    if low is not None and high is not None:
        axes.plot([low, high], [y, y], color=INK, lw=1.0)


def distributions(figure: Figure, comparison: Comparison, plant: str) -> None:
    """How the paired differences of the consequences are distributed; the margin is shaded where it is absolute."""
    parts = [part for part in PARTS if part.consequence and part.tested]
    pairs = comparison.pairs.where(comparison.pairs.other["plant"] == plant)
    named = spread(pairs.other)
    kinds = list(dict.fromkeys(zip(named["aircraft"], named.get("law", named["plant"]), strict=True)))
    airframes = list(dict.fromkeys(airframe for airframe, _ in kinds))
    laws = list(dict.fromkeys(law for _, law in kinds))
    panels = figure.subplots(1, len(parts), sharey=True, squeeze=False)[0]
    for axes, part in zip(panels, parts, strict=True):
        values = part.difference(pairs)
        for airframe, law in kinds:
            of = (
                ~np.isnan(values)
                & ((named["aircraft"] == airframe) & (named.get("law", named["plant"]) == law)).to_numpy()
            )
            if not of.any():
                continue
            share = np.linspace(0.0, 1.0, min(_MOST_POINTS, max(2, int(of.sum()))))
            axes.step(
                np.quantile(values[of], share), share, where="post", lw=1.2,
                color=LINES[airframes.index(airframe) % len(LINES)], ls=DASHES[laws.index(law) % len(DASHES)],
                label=f"{airframe}, {law}",
            )  # fmt: skip
        low, high = part.bounds(comparison.assess)
        if not part.relative and low is not None and high is not None:
            axes.axvspan(low, high, color=BAND, lw=0)
        axes.axvline(0.0, color=GREY, lw=0.6)
        axes.set_title(f"{part.title}\n[{part.unit}]", fontsize=8)
        axes.tick_params(labelsize=7)
        axes.locator_params(axis="x", nbins=4)
    panels[0].set_ylabel("share of the pairs below", fontsize=8)
    handles, labels = max((axes.get_legend_handles_labels() for axes in panels), key=lambda both: len(both[1]))
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False, fontsize=8)
