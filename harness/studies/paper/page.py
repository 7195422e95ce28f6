"""The page of `harness reproduce`: numbers, figures in the paper's axes, claims, in one file without a network."""

from functools import partial

from harness.drawing import draw
from harness.studies.paper import airframes, figures
from harness.studies.paper.claims import CLAIMS
from harness.studies.paper.columns import COLUMNS, CONDITIONS
from harness.studies.paper.experiments import EXPERIMENTS
from harness.studies.paper.figures import LAWS_DRAWN, Sketch
from harness.studies.paper.job import Reproduction, Sketches
from harness.studies.paper.ledger import cells, counts
from harness.studies.paper.reproduce import VARIANTS, VARIANTS_IN_WORDS, formatted
from harness.template import template
from harness.vocabulary import Verdict

_R, _S = ("r", "r [m]", None), ("s", "s [rad]", None)
_RATE, _HEADING = ("rate", "ω_ψ [deg/s]", None), ("heading", "ψ_a [deg]", None)


def page(everything: Reproduction) -> str:
    """The HTML page."""
    return template("harness.studies.paper", "page.html.jinja").render(
        results=everything.numbers,
        agreeing=sum(result.agrees for result in everything.numbers),
        variants=list(VARIANTS),
        variants_told=VARIANTS_IN_WORDS,
        formatted=formatted,
        experiments=EXPERIMENTS.values(),
        figures=_figures(everything.sketches),
        claims=CLAIMS,
        columns=COLUMNS,
        cells=partial(cells, decisions=everything.decisions),
        counts=counts(everything.decisions),
        airframes=airframes if airframes.have_flown(everything.decisions) else None,
        numbers_on_airframes=partial(airframes.counts_by_condition, everything.decisions),
        summary=partial(airframes.summary, decisions=everything.decisions),
        conditions=CONDITIONS,
        verdicts=list(Verdict),
    )


def _figures(sketches: Sketches) -> dict[str, str]:
    """Caption to SVG."""

    def case(experiment: str) -> dict[str, dict[str, Sketch]]:
        return {EXPERIMENTS[experiment].title: {law: sketches[experiment, law] for law in LAWS_DRAWN}}

    stationary, s_shape, manoeuvring = {**case("30"), **case("130")}, case("S"), case("manoeuvres")
    errors, rates = {"r": _R, "s": _S}, {"rate": _RATE, "heading": _HEADING}
    near = {
        "r": _R,
        "near": ("r", "r, near [m]", (-25.0, 25.0)),
        "rate": ("rate", "ω_ψ [deg/s]", (-25.0, 25.0)),  # NFTSM, not limited here, starts with -900
        "heading": _HEADING,
    }
    over_time = figures.over_time
    return {
        "Figures 2 and 3. Terminal and fast terminal sliding modes.": draw(figures.terminal_modes),
        "Figure 4. Paths round a stationary target.": draw(partial(figures.paths, cases=stationary), height=4.4),
        "Figure 5. Distance error and sliding variable, stationary target.": draw(
            partial(over_time, cases=stationary, rows=errors), height=5.0
        ),
        "Figure 6. Heading rate and heading, stationary target.": draw(
            partial(over_time, cases=stationary, rows=rates), height=5.0
        ),
        "Figure 7. Paths round a target in an S; its shape is ours, the paper gives none.": draw(
            partial(figures.paths, cases=s_shape), height=4.4
        ),
        "Figure 8. Distance error and sliding variable, round the S.": draw(
            partial(over_time, cases=s_shape, rows=errors), height=5.0
        ),
        "Figure 9a. The manoeuvring target.": draw(
            partial(figures.target_profile, drawn=sketches["manoeuvres", "SMC"]), height=2.6
        ),
        "Figure 9b. Paths round the manoeuvring target.": draw(partial(figures.paths, cases=manoeuvring), height=7.0),
        "Figure 10. Distance error (whole and near), heading rate, heading, round the manoeuvring target.": draw(
            partial(over_time, cases=manoeuvring, rows=near), height=7.5
        ),
    }
