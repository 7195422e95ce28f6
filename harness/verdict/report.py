"""The report: a comparison as one self-contained page, and as the Markdown of `docs/results.md`."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from harness.metric import METRICS as ALL_METRICS
from harness.settings.written import written
from harness.template import template
from harness.verdict import figures, words
from harness.verdict.attribution import METRICS, Attribution
from harness.verdict.comparison import Comparison, Row, axes_of
from harness.verdict.pairs import axes, change, spread
from harness.verdict.scorecard import Finding, Scorecard, shown
from harness.verdict.statistics import CONFIDENCE, LEAST_SEEDS, RESAMPLES

_MAP = Path(__file__).parents[2] / "docs" / "images" / "limit_cycle.svg"  # of `harness.studies.limit_cycle`
MOST_FLIGHTS = 60  # pairs listed on a page
MOST_DRAWN = 12  # airframes and laws whose attribution is drawn: the page stays below 3 MB


@dataclass(frozen=True, slots=True)
class Origin:
    """Where the flights come from: what heads the page."""

    folder: str
    title: str
    question: str
    command: str  # that flew them
    flown: str  # when, and with which code


class Figure(NamedTuple):
    """An SVG and what it shows."""

    svg: str
    caption: str


class Listed(NamedTuple):
    """A pair of flights, why it is listed, and how to see it."""

    why: str
    plant: str
    settings: str
    outcome: str
    keys: tuple[str, str]
    command: str


class Shading(NamedTuple):
    """The share of a part's cells that pass at one value of an axis."""

    axis: str
    value: str
    passed: int
    of: int


@dataclass(frozen=True, slots=True)
class Table:
    """The paired differences of one airframe under one law: per metric and plant, as far as they are there."""

    aircraft: str
    law: str
    plants: list[str]
    pairs: int
    metrics: dict[str, dict[str, Row]]


def page(comparison: Comparison, origin: Origin) -> str:
    """The HTML page."""
    return _rendered("report.html.jinja", comparison, origin)


def markdown(comparison: Comparison, origin: Origin) -> str:
    """The same without figures and flights, for `docs/results.md`."""
    return _rendered("results.md.jinja", comparison, origin)


def _rendered(name: str, comparison: Comparison, origin: Origin) -> str:
    html = name.endswith("html.jinja")
    return template("harness.verdict", name).render(
        comparison=comparison,
        origin=origin,
        answer=words.answer(comparison),
        compared=list(words.compared(comparison)),
        left_out=list(words.left_out(comparison)),
        axes={axis: [shown(value) for value in values] for axis, values in axes_of(comparison).items()},
        margins=written(comparison.assess),
        words=words,
        metrics=METRICS,
        shading=shading,
        breaks_first=words.breaks_first,
        tables=list(_tables(comparison)),
        distributions=_distributions(comparison) if html else None,
        attributions=[
            (a, _attributed(a) if html else []) for a in comparison.attributions[: MOST_DRAWN if html else None]
        ],
        undrawn=max(0, len(comparison.attributions) - MOST_DRAWN),
        map=_map() if html else None,
        listed=list(listed(comparison, origin.folder)) if html else [],
        confidence=f"{100 * CONFIDENCE:.0f} %",
        resamples=RESAMPLES,
        least_seeds=LEAST_SEEDS,
    )


def _tables(comparison: Comparison) -> Iterator[Table]:
    for kind in dict.fromkeys((row.aircraft, row.law) for row in comparison.rows):
        those = [row for row in comparison.rows if (row.aircraft, row.law) == kind]
        metrics: dict[str, dict[str, Row]] = {metric: {} for metric in ALL_METRICS}
        for row in those:
            metrics[row.metric][row.plant] = row
        plants = [plant for plant in comparison.plants if any(row.plant == plant for row in those)]
        pairs = max(row.difference.pairs for row in those)
        yield Table(*kind, plants, pairs, {metric: rows for metric, rows in metrics.items() if rows})


def _distributions(comparison: Comparison) -> Figure:
    plant = comparison.last_plant
    return Figure(
        figures.draw(partial(figures.distributions, comparison=comparison, plant=plant), height=3.4),
        f"Paired differences, {plant} minus {comparison.baseline}: the share of pairs below. Shaded: the margin, where "
        "it is absolute. A flight that ended early enters with the worst value, one that never converges with "
        "its duration.",
    )


def _attributed(attribution: Attribution) -> list[Figure]:
    """The waterfall and the disturbances of one airframe under one law, as far as they were flown."""
    found = []
    if attribution.ladders:
        found.append(
            Figure(
                figures.draw(partial(figures.waterfall, attribution=attribution), height=4.6),
                f"What each rung adds, in the mean over the {attribution.scenarios} scenarios flown on all of them in "
                f"which the law circles on {attribution.rungs[0]}; a "
                "dark line is the 95 % interval of that step.",
            )
        )
    if attribution.disturbances:
        whats = len({step.what for step in attribution.disturbances})
        found.append(
            Figure(
                figures.draw(partial(figures.disturbances, attribution=attribution), height=1.5 + 0.4 * whats),
                "What each disturbance adds to the same flight without it, all else equal.",
            )
        )
    return found


def _map() -> Figure | None:
    """The map of the gains, which is the airframes' and not of these flights; only a checkout has it."""
    if not _MAP.is_file():
        return None
    svg = _MAP.read_text(encoding="utf-8")
    return Figure(
        svg[svg.index("<svg") :],
        "Reaching gains k2 and k3 of NFTSM against the bandwidth of the inner loop: the predicted border of the limit "
        "cycle and flown points, from docs/limit_cycle.md. It is of the airframes, not of the flights of this run.",
    )


def shading(card: Scorecard, finding: Finding) -> Iterator[Shading]:
    """Where a part passes: per axis and value."""
    for axis, values in card.axes.items():
        for value in values:
            there = [cell for cell in finding.cells if cell.at[axis] == value]
            yield Shading(axis, shown(value), sum(cell.passes for cell in there), len(there))


def listed(comparison: Comparison, folder: str) -> Iterator[Listed]:
    """The pairs worth a look: per airframe and plant the lost, the worst of each consequence and the middle one."""
    pairs = comparison.pairs
    named = spread(pairs.other)
    columns = [*axes(named), "seed"]
    for index, why in list(_chosen(comparison).items())[:MOST_FLIGHTS]:
        before, after = pairs.reference.loc[index], pairs.other.loc[index]
        keys = str(before["key"])[:12], str(after["key"])[:12]
        yield Listed(
            "; ".join(why),
            f"{after['plant']} {after['aircraft']}",
            ", ".join(f"{column} = {shown(named.loc[index, column])}" for column in columns),
            str(after["outcome"]),
            keys,
            f"harness view {folder} --flight {keys[0]} --flight {keys[1]}",
        )


def _chosen(comparison: Comparison) -> Mapping[int, list[str]]:
    """Rows of the pairs, and why each was chosen."""
    chosen: dict[int, list[str]] = {}
    other = comparison.pairs.other
    metrics = ("range_error_rms_m", "convergence_time_s", "command_activity_deg_s2")
    changes = pd.DataFrame({metric: change(comparison.pairs, metric) for metric in metrics}, index=other.index)
    for rows in other.groupby(["aircraft", "plant"]).groups.values():
        for metric in metrics:
            ranked = changes.loc[rows, metric].dropna().sort_values()
            if len(ranked) and ranked.iloc[-1] > 0:
                _add(chosen, ranked.index[-1], f"{METRICS[metric][0]} worst, {words.signed(ranked.iloc[-1])}")
            if len(ranked) and metric == "range_error_rms_m":
                middle = ranked.index[len(ranked) // 2]
                _add(chosen, middle, f"{METRICS[metric][0]} in the middle, {words.signed(ranked.loc[middle])}")
    for index in other.index[other["lost"]]:
        _add(chosen, index, str(other.loc[index, "reason"]) or "ended early")
    return chosen


def _add(chosen: dict[int, list[str]], index: object, why: str) -> None:
    chosen.setdefault(int(str(index)), []).append(why)


def origin_of(folder: str, run: Mapping[str, object]) -> Origin:
    """From a run's provenance."""
    commit = str(run["git_commit"] or "unknown")[:12] + (" with changes" if run["git_dirty"] else "")
    flown = f"{run['started']}, commit {commit}, Python {run['python']}, {run['platform']}"
    return Origin(folder, str(run["title"] or folder), str(run["question"] or ""), str(run["command"]), flown)
