"""A comparison in sentences: each with its condition, its numbers and how many pairs and seeds it rests on."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from harness.log.metric import METRICS, YES_OR_NO
from harness.tables import counted, number, table
from harness.verdict import flown, moved
from harness.verdict.comparison import Comparison, Scorecard
from harness.verdict.conditions import Conclusion
from harness.verdict.judgement import HIGHER, LOWER, Judgement
from harness.verdict.pairs import UNDISTURBED, shown
from harness.verdict.parts import PARTS, Group, Part
from harness.verdict.statistics import Share
from harness.vocabulary import Verdict

ALIKE = "alike"  # a difference that is shown to lie within its margin
CHANGE_HEADINGS = ("metric", "in cells", "largest difference", "margin", "where")


def sentences(comparison: Comparison) -> Iterator[str]:
    """The answer: the question, what was compared, lost flights first, then each airframe."""
    yield from opening(comparison)
    yield from answers(comparison)


def opening(comparison: Comparison) -> Iterator[str]:
    """The question, what was compared, and the flights that were lost."""
    if comparison.question:
        yield comparison.question
    yield from compared(comparison)


def answers(comparison: Comparison) -> Iterator[str]:
    """Each airframe under the value furthest from the baseline."""
    for card in comparison.answering:
        yield ""
        yield from scorecard(card, comparison)


def scorecard(card: Scorecard, comparison: Comparison) -> Iterator[str]:
    """One airframe: what is said of each part with its worst cell, or of each metric that differs."""
    lost_flights = f", ended early: {share(card.lost)}" if card.lost.number else ""
    yield (
        f"{card.aircraft}: {comparison.by} = {card.value} beside {comparison.baseline}, "
        f"{counted(card.pairs, 'pair')}, {counted(card.seeds, 'seed')}{lost_flights}"
    )
    if not comparison.assumption:
        yield from (f"  {line}" for line in table(list(CHANGE_HEADINGS), changes(card)))
        return
    headings = ["part", "verdict", "worst cell, 95 % interval", "margin", "where"]
    rows: list[tuple[str, ...]] = []
    remarks: list[str] = []
    for group in Group:
        parts = [part for part in card.parts if part.group is group]
        rows += [(f"{group}:",)] if parts else []
        rows += [_row(card, part) for part in parts]
        remarks += [remark for part in parts for remark in notes_on(card, part)]
    yield from (f"  {line}" for line in table(headings, rows))
    yield from (f"  {remark}" for remark in remarks)


def summary(card: Scorecard) -> Iterator[str]:
    """A line for each group of parts: which hold, hold under a condition, fail, are undecided."""
    for group in Group:
        by_word: dict[Verdict, list[str]] = {}
        for part in card.parts:
            if part.group is group:
                by_word.setdefault(card.conclusion(part.column).word, []).append(part.title)
        if by_word:
            yield f"{group}: " + "; ".join(f"{word}: {', '.join(by_word[word])}" for word in Verdict if word in by_word)


def _row(card: Scorecard, part: Part) -> tuple[str, ...]:
    conclusion, of = card.conclusion(part.column), worst(card, part)
    known = [
        f"holds in {conclusion.holds}" if conclusion.holds else "",
        f"fails in {conclusion.fails}" if conclusion.fails else "",
    ]
    counts = "" if conclusion.of == 1 else f" ({', '.join(filter(None, known)) or 'shown in none'} of {conclusion.of})"
    if conclusion.word in (Verdict.HOLDS, Verdict.FAILS) and max(conclusion.holds, conclusion.fails) == conclusion.of:
        counts = "" if conclusion.of == 1 else f" in all {conclusion.of}"
    same = len({(j.difference, j.bounds) for j in card.of(part.column)}) == 1
    return f"  {part.title}", f"{conclusion.word}{counts}", value(of), bound(of, part), "" if same else place(of.at)


def notes_on(card: Scorecard, part: Part) -> Iterator[str]:
    """The conditions, the axes that the design cannot separate, and why cells are undecided."""
    conclusion = card.conclusion(part.column)
    if condition := conclusion.condition:
        word = "holds" if condition.word is Verdict.HOLDS else "fails"
        having = "" if condition.cells == condition.of else f"{condition.cells} of "
        yield f"{part.title} {word} if {condition.text} ({having}{counted(condition.of, 'cell')})"
    if conclusion.confounded:
        together = " and ".join(conclusion.confounded)
        yield f"{part.title}: {together} vary together, so the design cannot separate them"
    undecided = [j for j in card.of(part.column) if j.word == Verdict.UNDECIDED]
    if undecided:
        needed = sorted(j.seeds_needed for j in undecided if j.seeds_needed)
        advice = f"; {needed[-1]} seeds would decide {'it' if len(undecided) == 1 else 'the last'}" if needed else ""
        yield f"{part.title} is undecided in {counted(len(undecided), 'cell')}: {undecided[0].why}{advice}"


def worst(card: Scorecard, part: Part) -> Judgement:
    """The cell that takes most of its margin; one that fails before all others."""
    return max(card.of(part.column), key=lambda judgement: (judgement.word == Verdict.FAILS, judgement.use))


def compared(comparison: Comparison) -> Iterator[str]:
    """What was compared and what varies, then the lost flights."""
    seeds = comparison.pairs.other["seed"].nunique()
    varies = ", ".join(f"{axis} ({len(values)})" for axis, values in comparison.axes.items())
    yield (
        f"Compared: {comparison.by} = {', '.join(comparison.values)} beside {comparison.baseline}, "
        f"{counted(len(comparison.pairs), 'pair')}, {counted(seeds, 'seed')}, from "
        f"{counted(comparison.flights, 'flight')}; varies: {varies or 'nothing else'}."
    )
    yield from flown.gains_by_rule(comparison.table)
    yield from flown.predicting(comparison.table)
    yield from moved.sentences(comparison)
    yield from _lost(comparison)
    margin = comparison.pairs.other["feasibility_margin_deg_s"]
    outrun, infeasible = int((margin == -math.inf).sum()), int(((margin < 0.0) & (margin > -math.inf)).sum())
    if outrun:
        yield (
            f"In {counted(outrun, 'pair')} the circle cannot be held at any heading rate: the wind relative to the "
            "target reaches the airspeed."
        )
    if infeasible:
        yield f"In {counted(infeasible, 'pair')} the heading-rate limit is below the rate that the circle requires."
    reference = comparison.pairs.reference
    astray = int((~reference["circles"].astype(bool) & (reference["lost"] == 0.0)).sum())
    if astray:
        yield (
            f"In {counted(astray, 'pair')} the flight of {comparison.baseline} does not circle its target: "
            "such pairs are excluded from the metrics of circling."
        )
    yield from flown.quiet(comparison)
    if comparison.unpaired:
        yield f"{counted(len(comparison.unpaired), 'flight')} could not be compared."


def _lost(comparison: Comparison) -> Iterator[str]:
    """Flights that ended early, on both sides, and how."""
    for given, flights in comparison.table.groupby(comparison.by, sort=False):
        how = flights["outcome"][flights["lost"] == 1.0].value_counts()
        if len(how):
            kinds = ", ".join(f"{count} {outcome}" for outcome, count in how.items())
            yield (
                f"{how.sum()} of {counted(len(flights), 'flight')} with {comparison.by} = {shown(given)} ended early: "
                f"{kinds}."
            )


def worded(conclusion: Conclusion) -> str:
    """A conclusion in words, with its cells."""
    of = counted(conclusion.of, "cell")
    match conclusion.word:
        case Verdict.HOLDS:
            return "holds" if conclusion.of == 1 else f"holds in all {of}"
        case Verdict.UNDECIDED:
            return "is undecided" if conclusion.of == 1 else f"holds in {conclusion.holds} of {of}, the rest undecided"
        case Verdict.HOLDS_IF if conclusion.condition:
            return f"holds if {conclusion.condition.text}, fails in {conclusion.fails} of {of}"
        case _ if conclusion.condition:
            return f"fails if {conclusion.condition.text}, holds in {conclusion.holds} of {of}"
    if conclusion.of == 1:
        return "fails"
    if conclusion.fails == conclusion.of:
        return f"fails in all {of}"
    text = f"fails in {conclusion.fails} of {of}" + (f", holds in {conclusion.holds}" if conclusion.holds else "")
    if conclusion.confounded:
        text += f"; {' and '.join(conclusion.confounded)} vary together: the design cannot separate them"
    return text


class ChangeLine(NamedTuple):
    """The result for one metric, in words."""

    metric: str
    found: str  # lower, higher, alike or undecided, in how many cells
    largest: str  # difference, with its interval
    margin: str
    where: str  # the largest difference is


def changes(card: Scorecard) -> Iterator[ChangeLine]:
    """The metrics with a margin, and those that are lower or higher anywhere."""
    for title, largest, counts in _changed(card):
        cells = counts.total()
        margin = bound(largest, PARTS[largest.column]).removeprefix("within ") if largest.has_margin else ""
        found = _counted_words(counts) if cells > 1 else next(iter(counts))
        yield ChangeLine(title, found, value(largest), margin, place(largest.at) if cells > 1 else "")


def change_summary(card: Scorecard) -> Iterator[str]:
    """A line for each word: the metrics that are lower, higher or alike wherever they were judged; then the others."""
    alike: dict[str, list[str]] = {LOWER: [], HIGHER: [], ALIKE: []}
    differing: list[str] = []
    for title, _, counts in _changed(card):
        if len(counts) > 1:
            differing.append(f"{title} ({_counted_words(counts)})")
        elif (word := next(iter(counts))) in alike:
            alike[word].append(title)
    yield from (f"{word} in every cell: {', '.join(titles)}" for word, titles in alike.items() if titles)
    if differing:
        yield f"not the same in every cell: {', '.join(differing)}"


def _changed(card: Scorecard) -> Iterator[tuple[str, Judgement, Counter[str]]]:
    """For metrics with a margin, and those that differ anywhere: title, largest difference, words by cell."""
    for column in dict.fromkeys(judgement.column for judgement in card.judgements):
        judgements = card.of(column)
        counts = Counter(map(_direction, judgements))
        if judgements[0].has_margin:
            yield PARTS[column].title, worst(card, PARTS[column]), counts
        elif told := [judgement for judgement in judgements if judgement.word in (HIGHER, LOWER)]:
            largest = max(told, key=lambda judgement: abs(judgement.difference))
            if plain(largest.difference) != "0":
                yield column, largest, counts


def _counted_words(counts: Counter[str]) -> str:
    words = (f"{word} {counts[word]}" for word in (LOWER, HIGHER, ALIKE, Verdict.UNDECIDED) if counts[word])
    return f"{', '.join(words)} of {counts.total()}"


def _direction(judgement: Judgement) -> str:
    """Lower or higher, by more than the margin where there is one; alike where it is shown to lie within."""
    if judgement.word == Verdict.FAILS:
        return LOWER if judgement.difference < 0.0 else HIGHER
    return ALIKE if judgement.word == Verdict.HOLDS else judgement.word


def place(at: Mapping[str, object]) -> str:
    """Where a cell is, without what is undisturbed."""
    return ", ".join(f"{axis} = {shown(v)}" for axis, v in at.items() if UNDISTURBED.get(axis) != v)


def missing_flights(comparison: Comparison) -> Iterator[str]:
    """The flights that would separate what varies together, as options to type."""
    for card in comparison.answering:
        for part in card.parts:
            for cell in card.conclusion(part.column).missing:
                yield " ".join(f"--set {option}" for option in _options(card, cell))


def _options(card: Scorecard, cell: Mapping[str, object]) -> Iterator[str]:
    yield f"aircraft={card.aircraft}"
    for axis, given in cell.items():
        if axis == "law":
            name, _, gains = str(given).partition(" ")
            yield f"law.name={name}"
            if gains:
                yield f"law.gains={gains}"
        elif axis == "wind_speed_mps":
            yield f"'wind.steady_mps=[{shown(given)}, 0.0]'"
        else:
            yield f"{axis}={shown(given)}"


# Numbers


def plain(value: float) -> str:
    """Three digits, or a dash for none."""
    return number(None if math.isnan(value) else value)


def signed(value: float) -> str:
    """Three digits with a sign, or a dash for none."""
    text = plain(value)
    return f"+{text}" if value > 0 and text != "0" else text


def interval(low: float, high: float) -> str:
    """A 95 % interval; nothing where it has no width or there is none."""
    return "" if math.isnan(low) or signed(low) == signed(high) else f" [{signed(low)}, {signed(high)}]"


def value(judgement: Judgement) -> str:
    """A difference with its interval and unit."""
    part = PARTS.get(judgement.column)
    if part and part.kind == "at least" and judgement.has_margin:
        text = plain(judgement.difference)
    else:
        text = signed(judgement.difference)
    return f"{text}{interval(judgement.low, judgement.high)}{_unit(judgement.column)}"


def bound(judgement: Judgement, part: Part) -> str:
    """The margin of a difference."""
    low, high = judgement.bounds
    match part.kind:
        case "at most":
            return f"at most {plain(high if high is not None else math.nan)}"
        case "at least":
            return f"at least {plain(low if low is not None else math.nan)}"
        case _:
            return f"within ±{plain(high if high is not None else math.nan)}"


def _unit(column: str) -> str:
    unit = unit_of(column)
    return f" {unit}" if unit else ""


def unit_of(column: str) -> str:
    """The unit of a part or a metric; empty for a ratio."""
    if column in PARTS:
        return PARTS[column].unit
    unit = METRICS[column].unit if column in METRICS else ""
    return "" if unit in ("1", YES_OR_NO) else unit


def share(given: Share) -> str:
    """A share of flights with its interval."""
    if given.low == given.high:
        return f"{given.number} of {given.of}"
    low, high = (f"{100.0 * x:.2g}" if x < 0.095 else f"{100.0 * x:.0f}" for x in (given.low, given.high))
    return f"{given.number} of {given.of} ({low} to {high} %)"


def values(row: Sequence[object]) -> str:
    """Several values of an axis."""
    return ", ".join(map(shown, row))
