"""Do the airframes come through turbulence? `python -m harness.studies.turbulence RUN...` writes turbulence.md.

`make turbulence` flies the runs first. The figure holds the turbulence against its specification.
"""

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import click
import numpy as np
from matplotlib.figure import Figure
from scipy.signal import welch
from scipy.stats import binomtest

from harness.drawing import draw
from harness.runs.results import load_results
from harness.studies.command import out_option, run, write
from harness.template import template
from harness.world.air import Array
from harness.world.turbulence import dryden, turbulence
from harness.world.wind import SEVERITIES

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = {  # metric: heading, decimals
    "airspeed_deviation_rms_mps": ("airspeed m/s rms", 2),
    "altitude_deviation_peak_m": ("height m peak", 1),
    "sideslip_rms_deg": ("sideslip ° rms", 2),
    "heading_rate_error_rms_deg_s": ("heading rate °/s rms", 2),
    "range_error_rms_m": ("circle m rms", 2),
}
OUTCOMES = ("completed", "ground", "departed")
GROUPED_BY = ["wind.turbulence", "wind.rotation", "aircraft", "start.airspeed_mps"]
_SEVERITIES: list[object] = list(SEVERITIES)
_MODEL, _SPAN, _HOURS, _STEPS = dryden("moderate", 13.0, 150.0), 1.27, 8, (0.005, 0.05)


class Survival(NamedTuple):
    """How an airframe's flights in one air ended, and the means of their metrics, of those that ended early too."""

    turbulence: str
    airframe: str
    flights: int
    ended: Mapping[str, int]  # by outcome, each of `OUTCOMES`
    interval: tuple[float, float]  # of the share that completes its flight, %: 95 %, Wilson's
    means: Mapping[str, float]  # by metric

    @property
    def share(self) -> float:
        """Of the flights that last their full time, %."""
        return 100.0 * self.ended["completed"] / self.flights


class Added(NamedTuple):
    """What turning air adds to the same flights, seed by seed, as means."""

    airframe: str
    pairs: int
    means: Mapping[str, float]  # by metric


def survivals(flights: "pd.DataFrame") -> list[Survival]:
    """One for each airframe in each air, the calmest first."""
    groups = sorted(flights.groupby(GROUPED_BY, sort=False), key=lambda g: (_SEVERITIES.index(g[0][0]), not g[0][1]))
    lines = []
    for (severity, rotation, airframe, airspeed), group in groups:
        counts = group["outcome"].value_counts()
        ended = {outcome: int(counts.get(outcome, 0)) for outcome in OUTCOMES}
        low, high = binomtest(ended["completed"], len(group)).proportion_ci(method="wilson")
        air = f"{severity}{'' if rotation else ', no rotation'}"
        means = {metric: float(group[metric].mean()) for metric in COLUMNS}
        name = f"{airframe}, {airspeed:g} m/s"
        lines.append(Survival(air, name, len(group), ended, (100.0 * low, 100.0 * high), means))
    return lines


def rotation(flights: "pd.DataFrame") -> list[Added]:
    """What turning air adds, one for each airframe in each air; none without such pairs."""
    alike = [*(key for key in GROUPED_BY if key != "wind.rotation"), "seed"]
    turning, still = (flights[flights["wind.rotation"] == on].set_index(alike)[list(COLUMNS)] for on in (True, False))
    added = (turning - still).dropna()
    return [
        Added(
            f"{severity}, {airframe}, {airspeed:g} m/s",
            len(group),
            {metric: float(group[metric].mean()) for metric in COLUMNS},
        )
        for (severity, airframe, airspeed), group in added.groupby(alike[:-1], sort=False)
    ]


def survivals_csv(lines: Sequence[Survival]) -> str:
    """The table of all that was flown."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("turbulence", "airframe", "flights", *OUTCOMES, "low %", "high %", *COLUMNS))
    for line in lines:
        counts = [line.ended[outcome] for outcome in OUTCOMES]
        interval = [f"{end:.1f}" for end in line.interval]
        means = [f"{line.means[metric]:.{decimals}f}" for metric, (_, decimals) in COLUMNS.items()]
        writer.writerow((line.turbulence, line.airframe, line.flights, *counts, *interval, *means))
    return text.getvalue()


def page(lines: Sequence[Survival], added: Sequence[Added]) -> str:
    """The page."""
    return template("harness.studies", "turbulence.md.jinja").render(lines=lines, added=added, metrics=COLUMNS) + "\n"


def spectra(step: float) -> Iterator[tuple[str, Array, Array, Array]]:
    """Of each component: name, frequencies in rad/s, spectrum of the specification, and Welch's of realisations."""
    model, span = _MODEL, _SPAN
    flown: list[Array] = []
    for seed in range(_HOURS):
        field = turbulence(model, 0.0, seed, step, round(3600.0 / step))
        p, q, _, r = field.rotation(span).T
        components = np.vstack([field.velocity[field.lead :].T, [p, q, r]])
        hertz, density = welch(components, 1.0 / step, nperseg=round(400.0 / step), detrend=False)
        flown.append(density / (2.0 * np.pi))
    omega = 2.0 * np.pi * hertz[1:]
    specified = (
        ("u", model.along(omega)),
        ("v", model.across(omega)),
        ("w", model.vertical(omega)),
        ("p", model.roll(omega, span)),
        ("q", model.pitch(omega, span)),
        ("r", model.yaw(omega, span)),
    )
    for (name, wanted), got in zip(specified, np.mean(flown, axis=0)[:, 1:], strict=True):
        yield name, omega, wanted, got


def paint(figure: Figure) -> None:
    """The spectra of two step sizes over the specification's."""
    panels = figure.subplots(2, 3, sharex=True)
    for step, colour in zip(_STEPS, ("#1f5fa8", "#e08020"), strict=True):
        for axes, (name, omega, wanted, got) in zip(panels.flat, spectra(step), strict=True):
            edges = np.geomspace(0.02, 0.5 * omega[-1], 60)
            bands = np.digitize(omega, edges)
            inside = [bands == i for i in range(1, len(edges)) if (bands == i).any()]
            centre = [omega[band].mean() for band in inside]
            axes.loglog(centre, [got[band].mean() for band in inside], color=colour, label=f"flown, {step:g} s")
            if step == _STEPS[-1]:
                axes.loglog(omega, wanted, "k--", linewidth=0.8, label="MIL-F-8785C")
            unit = "(m/s)²/(rad/s)" if name in "uvw" else "(rad/s)²/(rad/s)"
            axes.set(title=name, xlim=(0.02, 100.0), ylabel=unit, xlabel="rad/s" if name in "pqr" else "")
    panels[0, 0].legend(fontsize=7)


@click.command()
@click.argument("runs", nargs=-1, required=True, metavar="RUN...")
@out_option
def main(runs: Sequence[str], out: Path) -> None:
    """Read the flights of each RUN, a directory of `harness run`, and write OUT/turbulence.md, its figure and table."""
    import pandas as pd

    flights = pd.concat([load_results(run) for run in runs])
    lines = survivals(flights)
    write(
        out,
        {
            "turbulence.svg": draw(paint, 9.0, 4.8),
            "turbulence.csv": survivals_csv(lines),
            "turbulence.md": page(lines, rotation(flights)),
        },
    )


if __name__ == "__main__":
    run(main, "harness.studies.turbulence")
