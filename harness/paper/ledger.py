"""The ledger: what the paper says, sentence by sentence, and what is left of it on an aircraft."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from enum import StrEnum
from typing import NamedTuple
from unicodedata import combining

from harness.flight import Flight
from harness.paper.experiments import EKF, Reading, Trace, flight, flown


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


class Column(NamedTuple):
    """What flies the claims' experiments: a column of the ledger."""

    name: str
    about: str
    change: Callable[[Flight], Flight]  # of the paper's flight on the kinematic aircraft into this column's
    tolerance: float  # m: nearer than this counts as converged

    def fly(self, flight: Flight) -> Trace:
        """That flight here."""
        return flown(self.change(flight))

    def paper(self, experiment: str, law: str, reading: Reading | None = None, duration: float | None = None) -> Trace:
        """An experiment of the paper's here, under its reading unless told another."""
        return self.fly(flight(experiment, law, reading, duration))


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


def _same(flight: Flight) -> Flight:
    return flight


def _estimating(flight: Flight) -> Flight:
    return replace(flight, estimator=EKF)


COLUMNS = (
    Column("kinematic, truth", "the paper's aircraft, Eq. (1), each experiment under its one reading", _same, 1e-4),
    Column("kinematic, EKF", "the same, the law seeing the target through the EKF with the paper's noise, seed 0",
           _estimating, 1.0),
)  # fmt: skip


Findings = Mapping[tuple[str, str], Finding]  # by a claim's key and the column's name; theory's column is ""


def decided(claims: Iterable[Claim], column: Column | None) -> dict[tuple[str, str], Finding]:
    """What flights decide, in this column; without a column what theory does."""
    if column is None:
        return {(claim.key, ""): claim.decide() for claim in claims if isinstance(claim, Theory)}
    return {(claim.key, column.name): claim.decide(column) for claim in claims if isinstance(claim, Flown)}


def cells(claim: Claim, findings: Findings) -> list[Finding | None]:
    """The claim's findings, one for each column; theory's stands in the first."""
    if isinstance(claim, Theory):
        return [findings[claim.key, ""], *[None] * (len(COLUMNS) - 1)]
    return [findings.get((claim.key, column.name)) for column in COLUMNS]


def counts(findings: Findings) -> list[tuple[str, Mapping[Verdict, int]]]:
    """How many claims of theory, and of flights in each column, hold, hold if, do not hold."""
    names = ["", *(column.name for column in COLUMNS)]
    return [
        (name or "formulas", {v: sum(f.verdict is v for (_, of), f in findings.items() if of == name) for v in Verdict})
        for name in names
    ]


def markdown(sections: Mapping[str, tuple[Claim, ...]], findings: Findings) -> str:
    """The ledger as a document."""
    lines = [
        "# The paper's claims",
        "",
        "Every testable sentence of the paper and what decides it, in the paper's order. Generated by `make "
        "paper`; a test "
        "computes the numbers anew. Where flights decide, each column flies them:",
        "",
        *(f"- *{column.name}*: {column.about}; converged within {column.tolerance:g} m." for column in COLUMNS),
        "",
        "NFTSM is the law with the gain set `identified`, (α2, β2) = (0.4, 2.4), unless said otherwise: those "
        "printed for it "
        "cannot give its results ([identified.md](identified.md)). How each experiment is read: "
        "[paper.html](paper.html).",
        "",
        f"| claims of | {' | '.join(Verdict)} |",
        "|---|" + "---|" * len(Verdict),
        *(f"| {name} | {' | '.join(str(number[v]) for v in Verdict)} |" for name, number in counts(findings)),
    ]
    for title, claims in sections.items():
        lines += ["", f"## {title}", "", "| | the paper says | " + " | ".join(column.name for column in COLUMNS) + " |"]
        lines.append("|---|---|" + "---|" * len(COLUMNS))
        lines += [row(claim, findings) for claim in claims]
    return "\n".join(lines) + "\n"


def row(claim: Claim, findings: Findings) -> str:
    """The claim's row in the document."""
    found = [_cell(str(finding)) if finding else "" for finding in cells(claim, findings)]
    return f"| {claim.key} | {_cell(claim.says)} | {' | '.join(found)} |"


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


def _cell(text: str) -> str:
    return text.replace("|", "\\|")
