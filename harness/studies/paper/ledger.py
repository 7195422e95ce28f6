"""The ledger: what the paper says, sentence by sentence, and what is left of it on an aircraft."""

import math
from collections.abc import Callable, Iterable, Mapping
from enum import StrEnum
from typing import NamedTuple
from unicodedata import combining

from harness.studies.paper.columns import COLUMNS, Column, EndedEarlyError


class Verdict(StrEnum):
    """What the experiment says of the claim."""

    HOLDS = "holds"
    IF = "holds if"
    NOT = "does not hold"


class Finding(NamedTuple):
    """A verdict and the numbers it rests on; the condition goes with `IF`."""

    verdict: Verdict
    number: str
    condition: str = ""

    def __str__(self) -> str:
        return f"**{self.verdict}**{f' {self.condition}' if self.condition else ''}: {self.number}"


def holds(true: bool, number: str) -> Finding:
    """It holds, or it does not."""
    return Finding(Verdict.HOLDS if true else Verdict.NOT, number)


def holds_if(condition: str, true: bool, number: str) -> Finding:
    """It holds under the condition and not without it, which `true` says; else it does not hold at all."""
    return Finding(Verdict.IF, number, condition) if true else Finding(Verdict.NOT, number)


def metres(x: float) -> str:
    """A distance; what is rounding only is not told by its digits."""
    if x < 1e-6:
        return "below 1e-6 m"
    return f"{x:.2g} m" if x < 99.5 else f"{x:.0f} m"


def below(x: float) -> str:
    """The power of ten that a small error stays below, 1e-9 at the least: further down it is rounding."""
    return f"less than 1e{max(-9, math.floor(math.log10(max(x, 1e-30))) + 1)}"


def within(time: float | None) -> str:
    """In how long, or never."""
    return "never" if time is None else f"in {time:g} s"


def sooner(a: float | None, b: float | None) -> bool:
    """Whether a time comes before another, which may be never."""
    return a is not None and (b is None or a < b)


class Theory(NamedTuple):
    """A sentence of the paper that no aircraft decides."""

    key: str  # section and letter
    says: str
    decide: Callable[[], Finding]


class Flown(NamedTuple):
    """A sentence of the paper that flights decide, in each column anew."""

    key: str
    says: str
    decide: Callable[[Column], Finding]


Claim = Theory | Flown


Findings = Mapping[tuple[str, str], Finding]  # by a claim's key and the column's name; theory's column is ""


def decided(claims: Iterable[Claim], column: Column | None) -> dict[tuple[str, str], Finding]:
    """What flights decide, in this column; without a column what theory does."""
    if column is None:
        return {(claim.key, ""): claim.decide() for claim in claims if isinstance(claim, Theory)}
    return {(claim.key, column.name): _flown(claim, column) for claim in claims if isinstance(claim, Flown)}


def _flown(claim: Flown, column: Column) -> Finding:
    """A flight that ends early is a result: the claim does not hold there."""
    try:
        return claim.decide(column)
    except EndedEarlyError as end:
        return Finding(Verdict.NOT, str(end))


def cells(claim: Claim, findings: Findings) -> list[Finding | None]:
    """The claim's findings, one for each column; theory's stands in the first."""
    if isinstance(claim, Theory):
        return [findings[claim.key, ""], *[None] * (len(COLUMNS) - 1)]
    return [findings.get((claim.key, column.name)) for column in COLUMNS]


def counted(findings: Findings, column: str) -> Mapping[Verdict, int]:
    """How many claims hold, hold if, do not hold in the column; theory's is ""."""
    return {v: sum(f.verdict is v for (_, of), f in findings.items() if of == column) for v in Verdict}


def counts(findings: Findings) -> list[tuple[str, Mapping[Verdict, int]]]:
    """The same of theory and of the paper's aircraft."""
    return [("formulas", counted(findings, "")), *((each.name, counted(findings, each.name)) for each in COLUMNS)]


def told(sections: Mapping[str, tuple[Claim, ...]], findings: Findings) -> list[str]:
    """The ledger in lines, without its numbers: a verdict per column."""
    width = max(len(column.name) for column in COLUMNS) + 2
    lines = [f"{'':6}{'the paper says':112}" + "".join(f"{column.name:{width}}" for column in COLUMNS)]
    for claims in sections.values():
        for claim in claims:
            verdicts = "".join(f"{finding.verdict if finding else '':{width}}" for finding in cells(claim, findings))
            lines.append(f"{claim.key:6}{_padded(claim.says, 112)}{verdicts}".rstrip())
    return lines


def _padded(text: str, width: int) -> str:
    return text + " " * (width - sum(not combining(letter) for letter in text))  # a dot above takes no room
