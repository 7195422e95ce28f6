"""What is left of the paper's claims on the airframes, in words: from the findings in every column of `GRID`."""

from collections.abc import Mapping
from types import MappingProxyType

from harness.studies.paper.columns import AIRFRAMES, BASELINE, CONDITIONS, Aircraft, column
from harness.studies.paper.ledger import Claim, Finding, Findings, Flown, Theory, Verdict, counted

SIGNS: Mapping[Verdict, str] = MappingProxyType({Verdict.HOLDS: "●", Verdict.IF: "◐", Verdict.NOT: "○"})

FLOWN_ON = (BASELINE, *AIRFRAMES)

Sections = Mapping[str, tuple[Claim, ...]]


def have_flown(findings: Findings) -> bool:
    """Whether the claims were put to the airframes too."""
    return any(of == column(condition, AIRFRAMES[0]).name for _, of in findings for condition in CONDITIONS)


def found(claim: Claim, condition: str, aircraft: Aircraft, findings: Findings) -> Finding:
    """The claim's finding on an aircraft in a condition."""
    return findings[claim.key, column(condition, aircraft).name]


def signs(claim: Claim, condition: str, findings: Findings) -> str:
    """The verdicts in a condition: of the kinematic aircraft, then of the airframes."""
    first, *others = (SIGNS[found(claim, condition, each, findings).verdict] for each in FLOWN_ON)
    return f"{first} {''.join(others)}"


def summary(claim: Claim, findings: Findings) -> list[tuple[Verdict, str]]:
    """The verdicts on the airframes, each with where: its conditions, and its airframes where not all agree.

    Empty for a claim of theory.
    """
    if isinstance(claim, Theory):
        return []
    told = []
    for verdict in Verdict:
        where = []
        for condition in CONDITIONS:
            those = [each.name for each in AIRFRAMES if found(claim, condition, each, findings).verdict is verdict]
            if those:
                where.append(condition if len(those) == len(AIRFRAMES) else f"{condition} ({', '.join(those)})")
        if where == list(CONDITIONS):
            where = ["anywhere" if verdict is Verdict.NOT else "everywhere"]
        if where:
            told.append((verdict, ", ".join(where)))
    return told


def numbers(findings: Findings) -> list[tuple[str, list[str]]]:
    """By condition: how many claims hold / hold if / do not hold on each aircraft."""
    lines = []
    for condition in CONDITIONS:
        told = (counted(findings, column(condition, each).name) for each in FLOWN_ON)
        lines.append((condition, [" / ".join(str(n[v]) for v in Verdict) for n in told]))
    return lines


def standing(sections: Sections, condition: str, aircraft: Aircraft, findings: Findings) -> set[str]:
    """The claims that hold there, at least under a condition of their own."""
    return {
        claim.key
        for claims in sections.values()
        for claim in claims
        if isinstance(claim, Flown) and found(claim, condition, aircraft, findings).verdict is not Verdict.NOT
    }


def lost(sections: Sections, findings: Findings) -> list[tuple[str, ...]]:
    """By condition: the claims that it costs the kinematic aircraft; those lost beyond, on all airframes, on some."""
    calm = standing(sections, next(iter(CONDITIONS)), BASELINE, findings)
    lines = []
    for condition in CONDITIONS:
        baseline = standing(sections, condition, BASELINE, findings)
        gone = [baseline - standing(sections, condition, each, findings) for each in AIRFRAMES]
        every = set.intersection(*gone)
        told = (keys(sections, each) for each in (calm - baseline, every, set.union(*gone) - every))
        lines.append((condition, *told))
    return lines


def keys(sections: Sections, some: set[str]) -> str:
    """Some claims by their keys, in the paper's order; a dash for none."""
    return ", ".join(claim.key for claims in sections.values() for claim in claims if claim.key in some) or "–"
