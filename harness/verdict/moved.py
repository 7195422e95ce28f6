"""Two runs of the same flights: what is not the same between them, and which flights it moved."""

from collections.abc import Iterator
from typing import NamedTuple

from harness.log.metric import METRICS
from harness.settings.columns import DIRECTORY
from harness.tables import number, table
from harness.verdict.comparison import Comparison
from harness.verdict.pairs import bundle, shown, spread

MOST_LISTED = 8
METRIC = "range_error_rms_m"  # the metric by which flights are ranked


class Moved(NamedTuple):
    """A flight that is another one in the other directory."""

    keys: tuple[str, str]  # there, here
    directories: tuple[str, str]
    settings: str  # what varies
    outcomes: tuple[str, str]
    values: tuple[float, float]  # of `METRIC`

    @property
    def by(self) -> float:
        """How far the metric moved; a flight that ends otherwise, or has no such number, moved most."""
        apart = abs(self.values[1] - self.values[0])
        return apart if self.outcomes[0] == self.outcomes[1] and apart == apart else float("inf")


def sentences(comparison: Comparison) -> Iterator[str]:
    """The differences between the directories, and the number of changed flights; empty for other comparisons."""
    if comparison.by != DIRECTORY:
        return
    pairs = comparison.pairs
    if comparison.changed:
        yield f"Not the same in all of them: {', '.join(comparison.changed)}."
    else:
        yield "Code, libraries, airframes and tracks are the same."
    if differing := list(_settings(comparison)):
        yield f"Set differently: {'; '.join(differing)}."
    for directory, rows in pairs.other.groupby(DIRECTORY, sort=False).groups.items():
        before, after = pairs.reference.loc[rows], pairs.other.loc[rows]
        same = int((before["digest"] == after["digest"]).sum())
        ended = int((before["outcome"] != after["outcome"]).sum())
        otherwise = f", {ended} of them end otherwise" if ended else ""
        rest = f"; {len(rows) - same} moved{otherwise}" if same < len(rows) else ""
        yield f"{directory}: {same} of {len(rows)} flights are those of {comparison.baseline} to the last bit{rest}."


def _settings(comparison: Comparison) -> Iterator[str]:
    before, after = comparison.pairs.reference, comparison.pairs.other
    for column in bundle(comparison.table, DIRECTORY)[1:]:
        differ = [(shown(a), shown(b)) for a, b in zip(before[column], after[column], strict=True)]
        if found := list(dict.fromkeys(pair for pair in differ if pair[0] != pair[1])):
            yield f"{column} {', '.join(f'{a} -> {b}' for a, b in found[:3])}{', ...' if len(found) > 3 else ''}"


def moved(comparison: Comparison) -> list[Moved]:
    """The flights of two directories that are not the same to the last bit, the one that moved most first."""
    if comparison.by != DIRECTORY:
        return []
    pairs = comparison.pairs
    named = spread(pairs.other)
    axes = [*comparison.axes, "seed"]
    found = [
        Moved(
            (str(before["key"]), str(after["key"])),
            (str(before[DIRECTORY]), str(after[DIRECTORY])),
            ", ".join(f"{axis} = {shown(named[axis].iloc[row])}" for axis in axes),
            (str(before["outcome"]), str(after["outcome"])),
            (float(before[METRIC]), float(after[METRIC])),
        )
        for row, ((_, before), (_, after)) in enumerate(
            zip(pairs.reference.iterrows(), pairs.other.iterrows(), strict=True)
        )
        if before["digest"] != after["digest"]
    ]
    return sorted(found, key=lambda each: -each.by)


def lines(comparison: Comparison) -> Iterator[str]:
    """The flights that moved most, for a terminal. Nothing of another comparison, or where none moved."""
    found = moved(comparison)
    if not found:
        return
    yield ""
    yield "The flights that moved most:"
    metric = METRICS[METRIC]
    headings = ["before", "after", "settings", f"{metric.column_heading}\nbefore", "after", "outcome"]
    rows = [
        [
            f"{each.directories[0]}:{each.keys[0][:8]}",
            f"{each.directories[1]}:{each.keys[1][:8]}",
            each.settings,
            *(number(None if value != value else value, metric.scale) for value in each.values),
            each.outcomes[1] if each.outcomes[0] == each.outcomes[1] else " -> ".join(each.outcomes),
        ]
        for each in found[:MOST_LISTED]
    ]
    yield from (f"  {line}" for line in table(headings, rows, "lllrrl"))
    if len(found) > MOST_LISTED:
        yield f"  and {len(found) - MOST_LISTED} more (--json lists all)"
