"""What is left of the paper's claims on the airframes: from the decisions in every column of `GRID`."""

from harness.studies.paper.columns import AIRFRAMES, BASELINE, CONDITIONS, Aircraft, column
from harness.studies.paper.decision import Decision
from harness.studies.paper.ledger import Claim, Decisions, FlownClaim, Sections, TheoryClaim, counted
from harness.vocabulary import Verdict

FLOWN_ON = (BASELINE, *AIRFRAMES)
CALM = next(iter(CONDITIONS))


def have_flown(decisions: Decisions) -> bool:
    """Whether the claims were put to the airframes too."""
    return any(of == column(condition, AIRFRAMES[0]).name for _, of in decisions for condition in CONDITIONS)


def decision_on(claim: Claim, condition: str, aircraft: Aircraft, decisions: Decisions) -> Decision:
    """The claim's decision on an aircraft in a condition."""
    return decisions[claim.key, column(condition, aircraft).name]


def summary(claim: Claim, decisions: Decisions) -> list[tuple[Verdict, str]]:
    """The verdicts on the airframes, each with where: its conditions, and its airframes where not all agree.

    Empty for a claim of theory.
    """
    if isinstance(claim, TheoryClaim):
        return []
    places = []
    for verdict in Verdict:
        where = []
        for condition in CONDITIONS:
            those = [e.name for e in AIRFRAMES if decision_on(claim, condition, e, decisions).verdict is verdict]
            if those:
                where.append(condition if len(those) == len(AIRFRAMES) else f"{condition} ({', '.join(those)})")
        if where == list(CONDITIONS):
            where = ["everywhere"]
        if where:
            places.append((verdict, ", ".join(where)))
    return places


def counts_by_condition(decisions: Decisions) -> list[tuple[str, list[str]]]:
    """By condition: how many claims have each verdict, on each aircraft."""
    lines = []
    for condition in CONDITIONS:
        on_each = (counted(decisions, column(condition, each).name) for each in FLOWN_ON)
        lines.append((condition, [" / ".join(str(n[v]) for v in Verdict) for n in on_each]))
    return lines


def standing(sections: Sections, condition: str, aircraft: Aircraft, decisions: Decisions) -> set[str]:
    """The claims that hold there, at least under a condition of their own."""
    return {
        claim.key
        for claims in sections.values()
        for claim in claims
        if isinstance(claim, FlownClaim)
        and decision_on(claim, condition, aircraft, decisions).verdict in (Verdict.HOLDS, Verdict.HOLDS_IF)
    }


def lost(sections: Sections, decisions: Decisions) -> list[tuple[str, ...]]:
    """By condition: the claims that it costs the kinematic aircraft; those lost beyond, on all airframes, on some."""
    calm = standing(sections, CALM, BASELINE, decisions)
    lines = []
    for condition in CONDITIONS:
        baseline = standing(sections, condition, BASELINE, decisions)
        gone = [baseline - standing(sections, condition, each, decisions) for each in AIRFRAMES]
        on_all = set.intersection(*gone)
        columns = (keys(sections, each) for each in (calm - baseline, on_all, set.union(*gone) - on_all))
        lines.append((condition, *columns))
    return lines


def keys(sections: Sections, some: set[str]) -> str:
    """Some claims by their keys, in the paper's order; a dash for none."""
    return ", ".join(claim.key for claims in sections.values() for claim in claims if claim.key in some) or "–"
