"""A comparison for a terminal: the answer, then the parts with their worst cells, then what could not be compared."""

from collections.abc import Iterator

from harness.tables import counted
from harness.verdict import flown, grid, moved
from harness.verdict.answer import answers, missing_flights, opening, scorecard
from harness.verdict.comparison import Comparison, Unpaired
from harness.verdict.pairs import CompareError, shown
from harness.verdict.statistics import CONFIDENCE, LEAST_EQUAL, LEAST_SEEDS

MOST_LISTED = 10


def lines(comparison: Comparison, mapped: str | None = None) -> Iterator[str]:
    """All of it; with the name of a metric its maps alone."""
    yield from opening(comparison)
    if mapped is not None:
        yield from grid.lines(_maps(comparison, mapped))
        return
    maps = list(grid.lines(grid.answering(comparison)))
    if maps and len(flown.combinations(comparison)[1]) > flown.MOST_LINES:
        yield from maps
        yield "A line for each combination: `harness show`, and the page of `harness report`."
    else:
        yield ""
        yield from flown.lines(comparison)
        yield from maps
    yield from answers(comparison)
    yield from moved.lines(comparison)
    if comparison.assumption or len(comparison.values) <= flown.MOST_VALUES:
        for card in comparison.others:
            yield ""
            yield from scorecard(card, comparison)
    else:
        yield ""
        yield f"{comparison.by} = {', '.join(comparison.values[:-1])}: --csv and `harness report` list each difference."
    if not comparison.assumption:
        yield ""
        yield "Lower, higher: by more than the margin, where there is one; alike: shown to lie within it."
    options = list(dict.fromkeys(missing_flights(comparison)))
    if options:
        yield ""
        yield "Flights that would separate what varies together:"
        yield from (f"  {option}" for option in options[:MOST_LISTED])
    yield from unpaired(comparison.unpaired)
    yield ""
    yield (
        f"Intervals: {100 * CONFIDENCE:.0f} %, of the means of seeds; none below {LEAST_SEEDS} seeds; {LEAST_EQUAL} "
        f"or more seeds that all agree on a number count as exact; a share of flights on which all agree has the exact "
        f"binomial interval. Words: two-sided tests at {comparison.assess.significance:g}, Holm's adjustment over one "
        f"airframe's parts and cells."
    )


def _maps(comparison: Comparison, metric: str) -> list[grid.Grid]:
    found = grid.grids(comparison, metric)
    if not found:
        raise CompareError(
            f"--map {metric}: needs two numeric axes; beside {comparison.by} these vary: "
            f"{', '.join(comparison.axes) or 'none'}"
        )
    return found[::-1]  # the value furthest from the baseline first


def unpaired(flights: tuple[Unpaired, ...]) -> Iterator[str]:
    """The flights that could not be compared, and why."""
    if not flights:
        return
    yield ""
    yield f"{counted(len(flights), 'flight')} could not be compared:"
    for flight in flights[:MOST_LISTED]:
        there = {key: v for key, v in flight.settings.items() if v == v}  # a setting of another law is NaN
        settings = ", ".join(f"{key} = {shown(v)}" for key, v in there.items())
        yield f"  {flight.key[:12]} {flight.why} ({flight.outcome}): {settings}"
    if len(flights) > MOST_LISTED:
        yield f"  and {len(flights) - MOST_LISTED} more (--json lists all)"
