"""What the turbulence is and what it does to the airframes: table and figure of docs/turbulence.md.

`make turbulence` flies the runs; `python -m harness.studies.turbulence RUN...` then writes both from their directories.
"""

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from scipy.signal import welch
from scipy.stats import binomtest

from harness.drawing import draw
from harness.files import replacing
from harness.runs.results import load_results
from harness.world.air import Array
from harness.world.turbulence import dryden, turbulence
from harness.world.wind import SEVERITIES

if TYPE_CHECKING:
    import pandas as pd

DOCUMENT = Path("docs/turbulence.md")
FIGURE = Path("docs/images/turbulence.svg")
SHOWN = {  # metric: heading, decimals
    "airspeed_deviation_rms_mps": ("airspeed m/s rms", 2),
    "altitude_deviation_peak_m": ("height m peak", 1),
    "sideslip_rms_deg": ("sideslip ° rms", 2),
    "heading_rate_error_rms_deg_s": ("heading rate °/s rms", 2),
    "range_error_rms_m": ("circle m rms", 2),
}
GROUPED_BY = ["wind.turbulence", "wind.rotation", "aircraft", "start.airspeed_mps"]
_SEVERITIES: list[object] = list(SEVERITIES)
_MODEL, _SPAN, _HOURS, _STEPS = dryden("moderate", 13.0, 150.0), 1.27, 8, (0.005, 0.05)


def survival(flights: "pd.DataFrame") -> list[str]:
    """A Markdown table, a line for each airframe in each air: how flights ended, and metrics as means over them all."""
    names = ["turbulence", "airframe", "flights", "completed", "ground", "departed", "survive", "95 %"]
    lines = ["| " + " | ".join([*names, *(heading for heading, _ in SHOWN.values())]) + " |"]
    lines.append("|---|---|" + "--:|" * (len(names) - 2 + len(SHOWN)))
    groups = sorted(flights.groupby(GROUPED_BY, sort=False), key=lambda g: (_SEVERITIES.index(g[0][0]), not g[0][1]))
    for (severity, rotation, airframe, airspeed), group in groups:
        ended = group["outcome"].value_counts()
        completed, total = int(ended.get("completed", 0)), len(group)
        low, high = binomtest(completed, total).proportion_ci(method="wilson")
        cells = [f"{severity}{'' if rotation else ', no rotation'}", f"{airframe}, {airspeed:g} m/s", str(total)]
        cells += [str(ended.get(outcome, 0)) for outcome in ("completed", "ground", "departed")]
        cells += [f"{100.0 * completed / total:.1f} %", f"{100.0 * low:.1f} to {100.0 * high:.1f}"]
        cells += [f"{group[metric].mean():.{decimals}f}" for metric, (_, decimals) in SHOWN.items()]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def rotation(flights: "pd.DataFrame") -> list[str]:
    """A Markdown table: what turning air adds to the same flights, seed by seed, as means; none without such pairs."""
    alike = [*(key for key in GROUPED_BY if key != "wind.rotation"), "seed"]
    turning, still = (flights[flights["wind.rotation"] == on].set_index(alike)[list(SHOWN)] for on in (True, False))
    added = (turning - still).dropna()
    lines = ["| turning air adds | pairs | " + " | ".join(heading for heading, _ in SHOWN.values()) + " |"]
    lines.append("|---|" + "--:|" * (1 + len(SHOWN)))
    for (severity, airframe, airspeed), group in added.groupby(alike[:-1], sort=False):
        cells = [f"{severity}, {airframe}, {airspeed:g} m/s", str(len(group))]
        cells += [f"{group[metric].mean():+.3f}" for metric in SHOWN]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


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


def main(runs: Sequence[str]) -> None:
    """Writes table and figure."""
    import pandas as pd

    flights = pd.concat([load_results(run) for run in runs])
    table = "\n".join([*survival(flights), "", *rotation(flights), ""])
    print(table)
    text = DOCUMENT.read_text(encoding="utf-8")
    before, begin, rest = text.partition("<!-- survival -->\n")
    _, end, after = rest.partition("<!-- end -->\n")
    if not (begin and end):
        raise ValueError(f"{DOCUMENT}: has no place for the table, between <!-- survival --> and <!-- end -->")
    for path, content in {
        DOCUMENT: f"{before}{begin}{table}\n{end}{after}",
        FIGURE: draw(paint, 9.0, 4.8),
    }.items():
        with replacing(path) as partial:
            partial.write_text(content, encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
