"""The ledger: what the paper says, sentence by sentence, and what is left of it on an aircraft."""

from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple
from unicodedata import combining

from harness.studies.paper.columns import COLUMNS, Column, EndedEarlyError, FlightFailedError
from harness.studies.paper.decision import Decision
from harness.vocabulary import Verdict


class TheoryClaim(NamedTuple):
    """A sentence of the paper that no aircraft decides."""

    key: str  # section and letter
    says: str
    measure: Callable[[], tuple[float, ...]]  # the numbers that decide it, by formulas
    decide: Callable[..., Decision]  # of these numbers; what is NaN is missing


class FlownClaim(NamedTuple):
    """A sentence of the paper that flights decide, in each column anew."""

    key: str
    says: str
    decide: Callable[[Column], Decision]


Claim = TheoryClaim | FlownClaim
Sections = Mapping[str, tuple[Claim, ...]]  # the paper's, by title, with the claims in each

Decisions = Mapping[tuple[str, str], Decision]  # by a claim's key and the column's name; theory's column is ""


def decided(claims: Iterable[Claim], column: Column | None) -> dict[tuple[str, str], Decision]:
    """What flights decide, in this column; without a column what theory does."""
    if column is None:
        return {(claim.key, ""): claim.decide(*claim.measure()) for claim in claims if isinstance(claim, TheoryClaim)}
    return {(claim.key, column.name): by_flights(claim, column) for claim in claims if isinstance(claim, FlownClaim)}


def by_flights(claim: FlownClaim, column: Column) -> Decision:
    """What the column's flights decide.

    A flight that ends early is a result: the claim fails there. One that failed, without a result, decides nothing.
    """
    try:
        return claim.decide(column)
    except EndedEarlyError as end:
        return Decision(Verdict.FAILS, str(end))
    except FlightFailedError as failure:
        return Decision(Verdict.UNDECIDED, str(failure))


def cells(claim: Claim, decisions: Decisions) -> list[Decision | None]:
    """The claim's decisions, one for each column; theory's stands in the first."""
    if isinstance(claim, TheoryClaim):
        return [decisions[claim.key, ""], *[None] * (len(COLUMNS) - 1)]
    return [decisions.get((claim.key, column.name)) for column in COLUMNS]


def counted(decisions: Decisions, column: str) -> Mapping[Verdict, int]:
    """How many claims have each verdict in the column; theory's is ""."""
    return {v: sum(d.verdict is v for (_, of), d in decisions.items() if of == column) for v in Verdict}


def counts(decisions: Decisions) -> list[tuple[str, Mapping[Verdict, int]]]:
    """The same of theory and of the paper's aircraft."""
    return [("formulas", counted(decisions, "")), *((each.name, counted(decisions, each.name)) for each in COLUMNS)]


def ledger_lines(sections: Sections, decisions: Decisions) -> list[str]:
    """The ledger in lines, without its numbers: a verdict per column."""
    width = max(len(column.name) for column in COLUMNS) + 2
    lines = [f"{'':6}{'the paper says':112}" + "".join(f"{column.name:{width}}" for column in COLUMNS)]
    for claims in sections.values():
        for claim in claims:
            verdicts = "".join(
                f"{decision.verdict if decision else '':{width}}" for decision in cells(claim, decisions)
            )
            lines.append(f"{claim.key:6}{_padded(claim.says, 112)}{verdicts}".rstrip())
    return lines


def _padded(text: str, width: int) -> str:
    return text + " " * (width - sum(not combining(letter) for letter in text))  # a dot above takes no room
