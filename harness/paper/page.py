"""The page of `harness reproduce`: the numbers, and the figures in the paper's axes, in one file without a network."""

import math
from functools import partial

from jinja2 import Environment, PackageLoader, StrictUndefined

from harness.flight_log import FlightLog
from harness.paper import figures
from harness.paper.reproduce import EXPERIMENTS, VARIANTS, Reproduced, flown, shown

_DEG = math.degrees(1.0)
_ERRORS = {"range_error": ("r [m]", 1.0), "sliding_variable": ("s [rad]", 1.0)}
_FIGURE_10 = {
    "range_error": ("r [m]", 1.0),
    "heading_rate_command": ("ω_ψ [deg/s]", _DEG),
    "heading": ("ψ_a [deg]", _DEG),
}
_RATES = {"heading_rate_command": ("ω_ψ [deg/s]", _DEG), "heading": ("ψ_a [deg]", _DEG)}


def page(results: list[Reproduced]) -> str:
    """The HTML page."""
    environment = Environment(loader=PackageLoader("harness.paper", "."), autoescape=True, undefined=StrictUndefined)
    return environment.get_template("page.html.jinja").render(
        results=results, variants=list(VARIANTS), shown=shown, figures=_figures()
    )


def _figures() -> dict[str, str]:
    """Caption to SVG."""
    s_shape = {EXPERIMENTS["S, whole"].title: _logs("S, whole")}
    manoeuvring = _logs("manoeuvres")
    stationary = {EXPERIMENTS[e].title: _logs(e) for e in ("30", "130")}
    return {
        "Figures 2 and 3": figures.draw(figures.terminal_modes),
        "Figure 4: paths round a stationary target": figures.draw(partial(figures.paths, cases=stationary), height=4.4),
        "Figure 5: distance error and sliding variable": figures.draw(
            partial(figures.columns, cases=stationary, shown=_ERRORS), height=5.0
        ),
        "Figure 6: heading rate and heading": figures.draw(
            partial(figures.columns, cases=stationary, shown=_RATES), height=5.0
        ),
        "Figure 7: paths round a target in an S": figures.draw(partial(figures.paths, cases=s_shape), height=4.4),
        "Figure 8: distance error, round the S": figures.draw(partial(figures.columns, cases=s_shape, shown=_ERRORS)),
        "Figure 9a: the manoeuvring target": figures.draw(partial(figures.target_profile, log=manoeuvring["SMC"])),
        "Figure 9b: paths round the manoeuvring target": figures.draw(
            partial(figures.paths, cases={EXPERIMENTS["manoeuvres"].title: manoeuvring}), height=4.4
        ),
        "Figure 10: distance error, heading rate and heading round the manoeuvring target": figures.draw(
            partial(figures.columns, cases={EXPERIMENTS["manoeuvres"].title: manoeuvring}, shown=_FIGURE_10), height=6.0
        ),
    }


def _logs(experiment: str) -> dict[str, FlightLog]:
    reading = EXPERIMENTS[experiment].reading
    return {label: flown(experiment, label, reading) for label in ("NFTSM", "SMC", "NFTSM_1")}
