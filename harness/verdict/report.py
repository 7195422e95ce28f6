"""The report: a comparison as one self-contained page."""

import base64
import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

from harness import markup
from harness.drawing import draw
from harness.log import FlightLog
from harness.log.figure import paint
from harness.log.metric import METRICS
from harness.settings.columns import DIRECTORY
from harness.settings.written import written
from harness.tables import counted, number
from harness.tables import markdown as markdown_table
from harness.template import template
from harness.verdict import answer, curve, figures, flown, grid, moved
from harness.verdict.comparison import Comparison, Scorecard
from harness.verdict.control_variates import ALIGNMENT, Saved
from harness.verdict.effects import Disturbed, Ladder, disturbances, ladders
from harness.verdict.pairs import shown, spread
from harness.verdict.parts import PARTS, Group
from harness.verdict.statistics import CONFIDENCE, LEAST_EQUAL, LEAST_SEEDS
from harness.vocabulary import SIGNS

SCRIPT = Path(__file__).with_name("report.js").read_text(encoding="utf-8")  # sorts and filters tables
MOST_DRAWN = 6  # largest number of pairs of flights drawn
MOST_CURVES = 12
MOST_FLIGHTS = 60  # pairs listed
MOST_GRIDS = 16
MOST_LINES = 200  # largest number of combinations listed
MOST_LADDERS = 12  # largest number of ladders drawn: the page stays below 3 MB
MOST_DISTURBED = 200  # largest number of rows of disturbances


@dataclass(frozen=True, slots=True)
class Origin:
    """Where the flights come from: what heads the page."""

    folder: str  # or several, as a command names them
    title: str
    question: str
    runs: tuple[tuple[str, str], ...]  # of each: the command that flew it; when, and with which code


class Drawing(NamedTuple):
    """An SVG and what it shows."""

    svg: str
    caption: str


class Listed(NamedTuple):
    """A pair of flights, why it is listed, and how to see it."""

    why: str
    value: str
    settings: str
    outcome: str
    keys: tuple[str, str]
    command: str
    drawing: str  # both flights as an SVG; empty where they are not at hand


def page(
    comparison: Comparison,
    origin: Origin,
    logs: Mapping[str, FlightLog] = MappingProxyType({}),
    maps: Mapping[str, bytes] = MappingProxyType({}),
    saved: Saved | None = None,
) -> str:
    """The HTML page; `logs` by key: flights of `to_draw` that are at hand; `maps` by folder: pictures, SVG.

    `saved`: the saving by a cheaper plant as a control variate, if requested.
    """
    added = list(_disturbances(comparison)) if comparison.by == "plant" else []
    judged_parts = [part for part in PARTS.values() if any(part in card.parts for card in comparison.scorecards)]
    return template("harness.verdict", "report.html.jinja").render(
        comparison=comparison,
        origin=origin,
        head=list(answer.compared(comparison)),
        words=answer,
        groups=[group for group in Group if any(part.group is group for part in judged_parts)],
        parts=judged_parts,
        flown=flown.combinations(comparison),
        told=[METRICS[name] for name in flown.TOLD],
        number=number,
        moved=moved.moved(comparison),
        most_lines=MOST_LINES,
        grids=[each for metric in grid.DEFAULT for each in grid.grids(comparison, metric)[::-1]][:MOST_GRIDS],
        folder=origin.folder,
        maps={folder: base64.b64encode(picture).decode() for folder, picture in maps.items()},
        axes={axis: answer.values(values) for axis, values in comparison.axes.items()},
        margins=written(comparison.assess),
        drawings=lambda card: list(_intervals(card)) if card in comparison.answering else [],
        ladders=list(_ladders(comparison)) if comparison.by == "plant" else [],
        saved=saved,
        alignment=ALIGNMENT,
        disturbances=added[:MOST_DISTURBED],
        more_disturbances=max(0, len(added) - MOST_DISTURBED),
        listed=list(listed(comparison, origin.folder, logs)),
        curves=list(_curves(comparison)),
        script=SCRIPT,
        script_hash=base64.b64encode(hashlib.sha256(SCRIPT.encode()).digest()).decode(),
        shown=shown,
        confidence=f"{100 * CONFIDENCE:.0f} %",
        least_seeds=LEAST_SEEDS,
        least_equal=LEAST_EQUAL,
    )


def markdown(comparison: Comparison, origin: Origin, saved: Saved | None = None) -> str:
    """The answer and the matrix of parts and airframes in Markdown, with the commands that made them; see `page`."""
    return template("harness.verdict", "report.md.jinja").render(
        comparison=comparison,
        origin=origin,
        answer=comparison.answer,
        words=answer,
        signs=SIGNS,
        parts=[part for part in PARTS.values() if any(part in card.parts for card in comparison.scorecards)],
        conditions=list(comparison.conditions.itertuples(index=False)),
        saved=saved,
        saved_table=markdown_table(saved.headings, _escaped(saved.rows), ALIGNMENT) if saved else (),
        margins=written(comparison.assess),
    )


def _escaped(rows: Sequence[Sequence[str]]) -> Iterator[list[str]]:
    """With metric, cell and control as Markdown; the rest are numbers."""
    for row in rows:
        yield [*map(markup.markdown, row[:3]), *row[3:]]


def _intervals(card: Scorecard) -> Iterator[Drawing]:
    """The cells of each group of parts, as intervals beside their margins."""
    for group in Group:
        parts = [part for part in card.parts if part.group is group]
        if parts:
            cells = max(min(figures.MOST_CELLS, len(card.of(part.column))) for part in parts)
            svg = draw(partial(figures.intervals, card=card, parts=parts), height=1.2 + 0.16 * cells)
            yield Drawing(
                svg,
                f"{group}: the difference in each cell with its {100 * CONFIDENCE:.0f} % interval. Shaded: the "
                "margin. Circle: holds; cross: fails; diamond: undecided.",
            )


def _ladders(comparison: Comparison) -> Iterator[Drawing]:
    """The waterfall of every undisturbed cell, as far as the page has room."""
    by_cell: dict[str, list[Ladder]] = {}
    for ladder in ladders(comparison.table):
        if max(abs(ladder.start), abs(ladder.end), *(abs(step.of.mean) for step in ladder.steps)) > grid.ROUNDING:
            by_cell.setdefault(f"{ladder.aircraft} {dict(ladder.at)}", []).append(ladder)
    for cell in list(by_cell.values())[:MOST_LADDERS]:
        first = cell[0]
        where = answer.place(first.at)
        yield Drawing(
            draw(partial(figures.waterfall, ladders=cell), height=2.6),
            f"{first.aircraft}{', ' if where else ''}{where}, undisturbed, {counted(first.seeds, 'seed')}: what "
            "each rung adds to the same flights.",
        )


def _disturbances(comparison: Comparison) -> Iterator[Disturbed]:
    yield from disturbances(comparison.table, (comparison.baseline, comparison.values[-1]))


def _curves(comparison: Comparison) -> Iterator[Drawing]:
    """Metrics over the one numeric axis, if there is one."""
    found = curve.curves(comparison)
    for each in found[:MOST_CURVES]:
        where = answer.place(each.at)
        yield Drawing(
            draw(partial(figures.curve_set, curves=each), height=2.8),
            f"{where}{': ' if where else ''}means over the seeds, with their {100 * CONFIDENCE:.0f} % intervals where "
            "there are enough seeds.",
        )


class ToDraw(NamedTuple):
    """A flight that the page draws if it is at hand."""

    folder: str
    key: str
    digest: str  # of the log that was compared


def to_draw(comparison: Comparison, folder: str) -> Iterator[ToDraw]:
    """The flights of the middle and the worst pair of each airframe under the value furthest from the baseline."""
    pairs = comparison.pairs
    for index in list(_exemplary(comparison))[:MOST_DRAWN]:
        for row in (pairs.reference.loc[index], pairs.other.loc[index]):
            yield ToDraw(str(row.get(DIRECTORY, folder)), str(row["key"]), str(row["digest"]))


def listed(comparison: Comparison, folder: str, logs: Mapping[str, FlightLog]) -> Iterator[Listed]:
    """The pairs worth a look: per airframe and value the worst and the middle settled error, and the lost ones."""
    pairs = comparison.pairs
    named = spread(pairs.other)
    columns = [axis for axis in comparison.axes if axis in named and axis != "aircraft"]
    for index, why in list(_chosen(comparison).items())[:MOST_FLIGHTS]:
        before, after = pairs.reference.loc[index], pairs.other.loc[index]
        keys = str(before["key"])[:12], str(after["key"])[:12]
        yield Listed(
            "; ".join(why),
            f"{after[comparison.by]} {after['aircraft']}",
            ", ".join(f"{column} = {shown(named.loc[index, column])}" for column in [*columns, "seed"]),
            str(after["outcome"]),
            keys,
            _to_see(str(before.get(DIRECTORY, folder)), str(after.get(DIRECTORY, folder)), *keys),
            _side_by_side(
                {f"{comparison.by} = {shown(row[comparison.by])}": str(row["key"]) for row in (before, after)}, logs
            ),
        )


def _side_by_side(keys: Mapping[str, str], logs: Mapping[str, FlightLog]) -> str:
    """Ground track and |range error| of two flights by name; empty unless both are at hand."""
    flights = {name: logs[key] for name, key in keys.items() if key in logs and len(logs[key])}
    return draw(partial(paint, flights=flights, panels=("track", "error")), height=3.6) if len(flights) == 2 else ""


def _to_see(before: str, after: str, first: str, second: str) -> str:
    """The command that shows two flights."""
    if before == after:
        return f"harness view {before} --flight {first} --flight {second}"
    return f"harness fly {after}:{second} --against {before}:{first}"


def _exemplary(comparison: Comparison) -> Mapping[int, str]:
    """The rows of the worst and of the middle pair of each airframe and value, and which it is; the answer's first."""
    other = comparison.pairs.other
    error = comparison.pairs.difference("range_error_rms_m", None)
    groups = other.groupby([other[comparison.by].map(shown), "aircraft"], sort=False).groups
    answering = {(card.value, card.aircraft) for card in comparison.answering}
    chosen: dict[int, str] = {}
    for place in sorted(groups, key=lambda place: place not in answering):
        ranked = sorted(
            (row for row in map(int, groups[place]) if error[row] == error[row]), key=lambda row: error[row]
        )
        if ranked:
            middle, worst = ranked[(len(ranked) - 1) // 2], ranked[-1]
            chosen[middle] = f"settled error in the middle, {answer.signed(error[middle])} m rms"
            if worst != middle:
                chosen[worst] = f"settled error worst, {answer.signed(error[worst])} m rms"
    return chosen


def _chosen(comparison: Comparison) -> Mapping[int, list[str]]:
    """Rows of the pairs, and why each was chosen."""
    chosen = {row: [why] for row, why in _exemplary(comparison).items()}
    other = comparison.pairs.other
    for row in map(int, other.index[other["lost"] > 0]):
        chosen.setdefault(row, []).append(str(other.loc[row, "reason"]) or "ended early")
    return chosen


def origin_of(folders: Sequence[str], runs: Sequence[Mapping[str, object]]) -> Origin:
    """The origin from the provenance of each folder's run."""
    title = " and ".join(str(run["title"] or folder) for folder, run in zip(folders, runs, strict=True))
    if len(runs) > 1 and len({run["title"] for run in runs}) < len(runs):
        title = " and ".join(folders)
    return Origin(" ".join(folders), title, str(runs[0]["question"] or ""), tuple(map(_run, runs)))


def _run(run: Mapping[str, object]) -> tuple[str, str]:
    commit = str(run["git_commit"] or "unknown")[:12] + (" with changes" if run["git_dirty"] else "")
    return str(run["command"]), f"{run['started']}, commit {commit}, Python {run['python']}, {run['platform']}"
