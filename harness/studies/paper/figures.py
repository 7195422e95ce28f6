"""Figures 2 to 10 of the paper, drawn anew: the same quantities in the paper's axes (x to the right, y up), as SVG."""

from collections.abc import Iterator, Mapping
from types import MappingProxyType

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from harness.studies.paper.experiments import Trace

Array = NDArray[np.float64]
Curve = tuple[Array, Array]
Sketch = Mapping[str, Curve]  # by the name of a column, over time, or of a path
Sketches = Mapping[str, Sketch]  # by the law

LAWS_DRAWN = ("NFTSM", "SMC", "NFTSM_1")

COLOURS = MappingProxyType({"NFTSM": "#1f5fa8", "SMC": "#3a9a4b", "NFTSM_1": "#e08020", "target": "#c03030"})
_MOST_POINTS = 1500  # of a curve: more cannot be seen


def terminal_modes(figure: Figure) -> None:
    """Figure 2: x' = -alpha1 sig^beta1(x) from 5; Figure 3: three fast terminal modes from 6."""
    left, right = figure.subplots(1, 2)
    t = np.linspace(0.0, 6.0, 600)
    for alpha, beta in ((1.0, 1.0), (1.0, 0.5), (1.0, 2.0), (2.0, 0.5)):
        left.plot(t, _terminal(5.0, alpha, beta, t), label=f"α1 = {alpha:g}, β1 = {beta:g}")
    left.set(title="Figure 2: terminal sliding modes", xlabel="t [s]", ylabel="x")
    for label, alpha2, beta2 in (("s1", 0.0, 1.0), ("s2", 1.0, 3.0), ("s3", 1.0, 1.0)):
        right.plot(t, _fast_terminal(6.0, alpha2, beta2, t), label=label)
    right.set(title="Figure 3: fast terminal sliding modes", xlabel="t [s]")
    for axes in (left, right):
        axes.legend()


def _terminal(x0: float, alpha: float, beta: float, t: Array) -> Array:
    if beta == 1.0:
        return np.asarray(x0 * np.exp(-alpha * t))
    left = np.maximum(0.0, x0 ** (1.0 - beta) - alpha * (1.0 - beta) * t)
    return np.asarray(left ** (1.0 / (1.0 - beta)))


def _fast_terminal(x0: float, alpha2: float, beta2: float, t: Array) -> Array:
    from scipy.integrate import solve_ivp

    def slope(_: float, x: Array) -> Array:
        positive = np.maximum(x, 0.0)
        return np.asarray(-(alpha2 * positive**beta2 + positive**0.5))

    return np.asarray(solve_ivp(slope, (0.0, t[-1]), [x0], t_eval=t, rtol=1e-8, atol=1e-10).y[0])


def sketch(log: Trace) -> Sketch:
    """What the figures show of a flight."""
    time, v_x, v_y = log["time"], log["target_velocity_north"], log["target_velocity_east"]
    over_time = {
        "r": log["range_error"],
        "s": log["sliding_variable"],
        "rate": np.degrees(log["heading_rate_command"]),
        "heading": np.degrees(log["heading"]),
        "target speed": np.hypot(v_x, v_y),
        "target heading": np.degrees(np.unwrap(np.arctan2(v_y, v_x))),
    }
    return {
        **{name: _thin(time, values) for name, values in over_time.items()},
        "path": _thin(log["north"], log["east"]),
        "target path": _thin(log["target_north"], log["target_east"]),
    }


def paths(figure: Figure, cases: Mapping[str, Sketches]) -> None:
    """The ways of aircraft and target, one panel per case."""
    for axes, (title, laws) in zip(_row(figure, len(cases)), cases.items(), strict=True):
        for label, drawn in laws.items():
            axes.plot(*drawn["path"], color=COLOURS[label], lw=1, label=label)
        axes.plot(*laws["SMC"]["target path"], ".-", color=COLOURS["target"], lw=1, ms=2, label="target")
        axes.set(title=title, xlabel="x [m]", ylabel="y [m]", aspect="equal")
        axes.legend()


def over_time(
    figure: Figure, cases: Mapping[str, Sketches], rows: Mapping[str, tuple[str, str, tuple[float, float] | None]]
) -> None:
    """Quantities over time: a panel per case and row; `shown` maps a row to quantity, label and limits."""
    grid = figure.subplots(len(rows), len(cases), sharex="col", squeeze=False)
    for j, (title, laws) in enumerate(cases.items()):
        for i, (quantity, label, limits) in enumerate(rows.values()):
            for name, drawn in laws.items():
                grid[i, j].plot(*drawn[quantity], color=COLOURS[name], lw=0.9, label=name)
            grid[i, j].set(ylabel=label, ylim=limits)
        grid[0, j].set(title=title)
        grid[0, j].legend(loc="best")
        grid[-1, j].set(xlabel="t [s]")


def target_profile(figure: Figure, drawn: Sketch) -> None:
    """Figure 9a: the target's speed and heading."""
    left, right = figure.subplots(1, 2)
    left.plot(*drawn["target speed"], color=COLOURS["target"])
    left.set(title="Speed", xlabel="t [s]", ylabel="v_t [m/s]")
    right.plot(*drawn["target heading"], color=COLOURS["target"])
    right.set(title="Heading", xlabel="t [s]", ylabel="ψ_t [deg]")


def _row(figure: Figure, count: int) -> Iterator[Axes]:
    yield from np.atleast_1d(np.asarray(figure.subplots(1, count))).flat


def _thin(x: Array, y: Array) -> tuple[Array, Array]:
    """As much of a curve as can be seen: of each stretch its lowest and its highest point, so that no peak is lost."""
    stretch = -(-len(y) // (_MOST_POINTS // 2))
    if stretch < 3:
        return x, y
    whole = len(y) // stretch * stretch
    rows = y[:whole].reshape(-1, stretch)
    ends = np.sort(np.stack([rows.argmin(1), rows.argmax(1)], 1), 1) + stretch * np.arange(len(rows))[:, np.newaxis]
    kept = np.unique(np.append(ends.ravel(), len(y) - 1))
    return x[kept], y[kept]
