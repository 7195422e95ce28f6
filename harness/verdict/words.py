"""A comparison in words: every sentence made of its numbers alone."""

import math
from collections.abc import Iterable, Iterator, Sequence

from harness.tables import number
from harness.verdict.comparison import Comparison, Left, Row
from harness.verdict.pairs import REFERENCE
from harness.verdict.scorecard import HOLDS, IF, NOT, UNMEASURED, UNSHOWN, Cell, Finding, Scorecard, shown
from harness.verdict.statistics import Effect, Share


def answer(comparison: Comparison) -> list[str]:
    """Three sentences: does the assumption hold, what breaks first, what does it cost."""
    cards = comparison.answering
    beside = f"{comparison.last_plant} beside {comparison.baseline}, {sum(card.pairs for card in cards)} pairs"
    whole = "As a whole" if all(map(_holds_all, cards)) else "Not as a whole"
    return [
        f"Does it hold? {whole} ({beside}): {'; '.join(map(_holds, cards))}.",
        f"What breaks first? {_sentence(_first(cards))}.",
        f"What does it cost? {_sentence(map(_costs, cards))}.",
    ]


def _of_the_assumption(card: Scorecard) -> list[Finding]:
    return [finding for finding in card.findings if not finding.part.consequence and finding.verdict != UNMEASURED]


def _holds_all(card: Scorecard) -> bool:
    return all(finding.verdict == HOLDS for finding in _of_the_assumption(card))


def _holds(card: Scorecard) -> str:
    parts = _of_the_assumption(card)
    counted = {verdict: sum(f.verdict == verdict for f in parts) for verdict in (HOLDS, IF, NOT, UNSHOWN)}
    if _holds_all(card):
        return f"on {card.aircraft} all {len(parts)} parts hold"
    said = [f"{counted[HOLDS]} of {len(parts)} parts hold"]
    said += [f"{counted[IF]} under a condition"] if counted[IF] else []
    said += [f"{counted[NOT]} {'do' if counted[NOT] > 1 else 'does'} not"] if counted[NOT] else []
    said += [f"{counted[UNSHOWN]} not shown"] if counted[UNSHOWN] else []
    return f"on {card.aircraft} {_and(said)}"


def breaks_first(card: Scorecard) -> Finding | None:
    """The part of the assumption that fails in the largest share of its cells; of equals, the one furthest out."""
    broken = [finding for finding in card.findings if not finding.part.consequence and finding.failed]
    return max(broken, key=lambda f: (f.failed / len(f.cells), f.worst.use if f.worst else 0.0), default=None)


def _first(cards: Sequence[Scorecard]) -> Iterator[str]:
    """A clause for each part that breaks first somewhere, with all airframes on which it does."""
    broken = [(card.aircraft, finding) for card in cards if (finding := breaks_first(card))]
    for part in dict.fromkeys(finding.part for _, finding in broken):
        of_it = [(aircraft, finding) for aircraft, finding in broken if finding.part is part]
        each = [f"on {aircraft} {_broken(finding)}" for aircraft, finding in of_it]
        aircraft, worst = max(((a, f.worst) for a, f in of_it if f.worst), key=lambda found: found[1].use)
        where = place(worst)
        furthest = f", furthest out on {aircraft} at {where}" if where else ""
        yield f"{part.title} fails {', '.join(each)}, where {bound(worst)} is asked{furthest}"
    whole = [card.aircraft for card in cards if not breaks_first(card)]
    if whole:
        yield f"on {_and(whole)} nothing that was measured"


def _broken(finding: Finding) -> str:
    worst = measured(finding.worst.mean, finding) if finding.worst else ""
    unless = f", not if {finding.condition}" if finding.condition else ""
    return f"in {finding.failed} of {len(finding.cells)} cells (at worst {worst}{unless})"


def place(cell: Cell) -> str:
    """Where a cell is, without what is as in `REFERENCE`; nothing when there is but one."""
    said = [
        shown(value) if axis == "law" else f"{axis} = {shown(value)}"
        for axis, value in cell.at.items()
        if axis not in REFERENCE or value != REFERENCE[axis]
    ]
    return ", ".join(said)


def _costs(card: Scorecard) -> str:
    time, error, activity = (card.finding(name) for name in ("convergence_time", "settled_error", "activity"))
    before, after = card.converged
    said = [f"{_percent(after.share)} of the flights converge instead of {_percent(before.share)}"]
    if time.cells:
        said.append(f"convergence {short(time.effect)} s")
    said.append(f"settled error {short(error.effect)} m rms")
    said.append(f"command activity {short(activity.effect)} deg/s2")
    if card.lost.number:
        said.append(f"{card.lost.number} of {card.lost.of} flights end early")
    return f"on {card.aircraft} {', '.join(said)}"


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' if number != 1 else ''}"


def _and(words: Sequence[str]) -> str:
    return f"{', '.join(words[:-1])} and {words[-1]}" if len(words) > 1 else "".join(words)


def _sentence(clauses: Iterable[str]) -> str:
    whole = "; ".join(clauses)
    return whole[:1].upper() + whole[1:]


# Numbers


def signed(value: float) -> str:
    """Three digits with a sign, or a dash for none."""
    text = plain(value)
    return f"+{text}" if value > 0 and text != "0" else text


def plain(value: float) -> str:
    """Three digits, or a dash for none."""
    return number(None if math.isnan(value) else value)


def short(effect: Effect) -> str:
    """The mean with its interval when it has one."""
    if effect.low is None or effect.high is None:
        return signed(effect.mean)
    return f"{signed(effect.mean)} [{signed(effect.low)}, {signed(effect.high)}]"


def of(share: Share) -> str:
    """A share with its interval."""
    low, high = (f"{100 * bound:.2g}" if bound < 0.095 else f"{100 * bound:.0f}" for bound in (share.low, share.high))
    return f"{share.number} of {share.of} ({low} to {high} %)"


def bound(cell: Cell) -> str:
    """What a cell's difference has to stay within."""
    low, high = cell.bounds
    if low is None:
        return f"at most {plain(high if high is not None else math.nan)}"
    return f"within ±{plain(high)}" if high == -low else f"{signed(low)} to {signed(high or math.nan)}"


def measured(value: float, finding: Finding) -> str:
    """A difference with its unit."""
    unit = finding.part.unit
    return signed(value) if unit == "1" else f"{signed(value)} {unit}"


# Lines for a terminal


def lines(comparison: Comparison) -> Iterator[str]:
    """All of it, for a terminal."""
    yield from compared(comparison)
    yield from left_out(comparison)
    yield ""
    yield from table_lines(comparison.rows, comparison.baseline)
    for card in comparison.scorecards:
        yield ""
        yield from scorecard_lines(card)
    yield ""
    yield from answer(comparison)


def compared(comparison: Comparison) -> Iterator[str]:
    """What was compared, and of what it says nothing."""
    seeds = comparison.pairs.other["seed"].nunique()
    yield (
        f"{_counted(len(comparison.pairs), 'pair')} of {', '.join(comparison.plants)} beside {comparison.baseline}, "
        f"{_counted(seeds, 'seed')}, from {_counted(comparison.flights, 'flight')}"
    )
    infeasible = int((comparison.pairs.other["feasibility_margin_deg_s"] < 0.0).sum())
    if infeasible:
        yield f"{infeasible} of the pairs are of circles that the heading-rate limit cannot hold"
    astray = int((~comparison.pairs.reference["circles"].astype(bool)).sum())
    if astray:
        yield (
            f"{astray} of the pairs say nothing of the cost: the law does not circle the target on "
            f"{comparison.baseline} either"
        )
    unpaired = len(comparison.unpaired) + len(comparison.failed)
    if unpaired:
        yield f"{_counted(unpaired, 'flight')} could not be compared"


def left_out(comparison: Comparison) -> Iterator[str]:
    """The flights that could not be compared, and why."""
    yield from _left("without a partner", comparison.unpaired)
    yield from _left("in no pair, since failed", comparison.failed)


MOST_LISTED = 10


def _left(what: str, left: Sequence[Left]) -> Iterator[str]:
    if not left:
        return
    yield f"{_counted(len(left), 'flight')} {what}:"
    for flight in left[:MOST_LISTED]:
        there = {key: value for key, value in flight.settings.items() if value == value}  # no NaN: not of its law
        settings = ", ".join(f"{key} = {shown(value)}" for key, value in there.items())
        yield f"  {flight.key[:12]} {flight.outcome}: {settings}"
    if len(left) > MOST_LISTED:
        yield f"  and {len(left) - MOST_LISTED} more (all in --json)"


def table_lines(rows: Sequence[Row], baseline: str) -> Iterator[str]:
    """The paired differences, a block per airframe, law and plant."""
    for kind in dict.fromkeys((row.aircraft, row.law, row.plant) for row in rows):
        those = [row for row in rows if (row.aircraft, row.law, row.plant) == kind]
        pairs = max(row.difference.pairs for row in those)
        yield f"{kind[0]}, {kind[1]}: {kind[2]} - {baseline}, {pairs} pairs"
        head = ("", baseline, kind[2], "difference", "95 % interval", "pairs")
        yield from aligned([head, *(_cells(row) for row in those)])


def _cells(row: Row) -> tuple[str, ...]:
    change = row.difference
    if change.low is None or change.high is None:
        between = change.why if change.pairs else ""
    else:
        between = f"{signed(change.low)} to {signed(change.high)}"
    mean = signed(change.mean)
    return row.metric, plain(row.reference), plain(row.other), mean, between, str(change.pairs)


def scorecard_lines(card: Scorecard) -> Iterator[str]:
    """One airframe's scorecard."""
    lost, before, after = of(card.lost), of(card.converged[0]), of(card.converged[1])
    yield f"Scorecard of {card.aircraft}, {card.plant} beside {card.baseline}: {card.pairs} pairs, lost {lost}"
    head = ("", "verdict", "mean, 95 % interval", "worst", "bound", "cells", "pairs", "")
    yield from aligned([head, *map(_finding_cells, card.findings)])
    yield from (f"  {note}" for note in without_interval(card))
    yield (
        f"  converged: {card.baseline} {before}, {card.plant} {after}; alone {card.alone[0]} against {card.alone[1]}, "
        f"McNemar p = {card.convergence_p:.3g}"
    )


def without_interval(card: Scorecard) -> Iterator[str]:
    """Which parts have no interval, and why."""
    measured_without = [f for f in card.findings if f.cells and f.effect.low is None and f.part.name != "reach"]
    for why in dict.fromkeys(finding.effect.why for finding in measured_without):
        titles = [finding.part.title for finding in measured_without if finding.effect.why == why]
        yield f"No interval ({why}): {', '.join(titles)}."


def _finding_cells(finding: Finding) -> tuple[str, ...]:
    worst = finding.worst
    if worst is None:
        return finding.part.title, finding.verdict, "", "", "", "", "", ""
    mean, at_worst = short(finding.effect), measured(worst.mean, finding)
    cells, pairs = f"{finding.passed}/{len(finding.cells)}", str(finding.effect.pairs)
    return finding.part.title, finding.verdict, mean, at_worst, bound(worst), cells, pairs, finding.condition


def aligned(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Columns, two spaces apart and indented."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    for row in rows:
        yield "  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
