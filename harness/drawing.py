"""Figures: their style, and how they become text, a file or a picture in a notebook; the same bytes each time."""

import io
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from types import MappingProxyType
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

# Okabe and Ito's, which are distinguishable for colour-blind readers, the strongest contrasts first
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00")
INK, FAINT = "#1c2733", "#9aa5b1"
COLUMN, PAGE = 3.5, 7.1  # in: widths of a figure in print
SUFFIXES = (".png", ".svg", ".pdf")

_DOTS = 300  # per inch, of a PNG
_UNDATED: Mapping[str, Mapping[str, None]] = MappingProxyType({".svg": {"Date": None}, ".pdf": {"CreationDate": None}})


def _in_print() -> AbstractContextManager[None]:
    return mpl.rc_context(
        {
            "svg.hashsalt": "paper",
            "pdf.fonttype": 42,  # fonts that a journal accepts
            "font.size": 8,
            "axes.grid": True,
            "axes.linewidth": 0.6,
            "grid.alpha": 0.3,
            "grid.linewidth": 0.5,
        }
    )


class Picture(Figure):
    """A figure in print size that a notebook shows by itself, without pyplot and its global state."""

    def savefig(self, *args: Any, **options: Any) -> None:
        with _in_print():  # Matplotlib makes ticks as late as this
            super().savefig(*args, **options)

    def _repr_png_(self) -> bytes:
        out = io.BytesIO()
        self.savefig(out, format="png")
        return out.getvalue()


def picture(paint: Callable[[Figure], None], width: float = PAGE, height: float = 4.0) -> Picture:
    """The figure drawn by `paint`, of this size in inches, in the style of print."""
    with _in_print():
        figure = Picture(figsize=(width, height), dpi=110, layout="constrained")
        paint(figure)
    return figure


def save(figure: Picture, path: Path, suffix: str) -> None:
    """Writes the figure in the format of this suffix, one of `SUFFIXES`."""
    figure.savefig(path, format=suffix[1:], dpi=_DOTS, metadata=_UNDATED.get(suffix))


def draw(paint: Callable[[Figure], None], width: float = 9.0, height: float = 3.4) -> str:
    """The SVG text of what `paint` draws on a figure of this size, in inches."""
    with mpl.rc_context({"svg.hashsalt": "paper", "font.size": 9, "axes.grid": True, "grid.alpha": 0.3}):
        figure = Figure(figsize=(width, height), layout="constrained")
        paint(figure)
        out = io.StringIO()
        figure.savefig(out, format="svg", metadata={"Date": None})
    return out.getvalue()[out.getvalue().index("<svg") :]
