"""Figures as SVG text that is identical each time."""

import io
from collections.abc import Callable

import matplotlib as mpl
from matplotlib.figure import Figure


def draw(paint: Callable[[Figure], None], width: float = 9.0, height: float = 3.4) -> str:
    """The SVG text of what `paint` draws on a figure of this size, in inches."""
    with mpl.rc_context({"svg.hashsalt": "paper", "font.size": 9, "axes.grid": True, "grid.alpha": 0.3}):
        figure = Figure(figsize=(width, height), layout="constrained")
        paint(figure)
        out = io.StringIO()
        figure.savefig(out, format="svg", metadata={"Date": None})
    return out.getvalue()[out.getvalue().index("<svg") :]
