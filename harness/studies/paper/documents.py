"""The ledger as documents: two pages in Markdown, and every claim with its numbers as a table in CSV."""

import csv
import io
import math
from collections.abc import Iterable, Iterator
from functools import partial

import aircraft
from harness.studies.paper.airframes import (
    CALM,
    FLOWN_ON,
    counts_by_condition,
    have_flown,
    keys,
    lost,
    standing,
)
from harness.studies.paper.columns import AIRFRAMES, BASELINE, COLUMNS, CONDITIONS, GRID, HELD, PAPERS_AIRSPEED, column
from harness.studies.paper.decision import Decision
from harness.studies.paper.ledger import Claim, Decisions, FlownClaim, Sections, counts
from harness.template import template
from harness.vocabulary import SIGNS, Verdict

FORMULAS = "formulas"  # what stands in the table for a column when no aircraft decides
HEADINGS = ("section", "claim", "the paper says", "decided by", "verdict", "condition", "numbers")


def claims_csv(sections: Sections, decisions: Decisions) -> str:
    """Every decision, a line each: the claims in the paper's order, for each the columns in theirs."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADINGS)
    for title, claims in sections.items():
        for claim in claims:
            writer.writerows(rows(title, claim, decisions))
    return text.getvalue()


def rows(title: str, claim: Claim, decisions: Decisions) -> Iterator[tuple[str, ...]]:
    """The claim's lines in the table."""
    for name in ("", *(each.name for each in (*COLUMNS, *GRID))):
        if decision := decisions.get((claim.key, name)):
            yield title, claim.key, claim.says, name or FORMULAS, decision.verdict, decision.condition, decision.number


def claims_page(sections: Sections, decisions: Decisions) -> str:
    """The page of all claims."""
    of_paper = [each.name for each in COLUMNS]
    calm = [column(CALM, each).name for each in AIRFRAMES if have_flown(decisions)]
    return (
        template("harness.studies.paper", "claims.md.jinja").render(
            sections=sections,
            columns=COLUMNS,
            verdicts=list(Verdict),
            counts=counts(decisions),
            fails=partial(_failing, sections, decisions),
            headings=[FORMULAS, *of_paper, *(f"{each.name}, {CALM}" for each in AIRFRAMES if calm)],
            matrix=[
                (title, [_signs(claims, decisions, name) for name in ("", *of_paper, *calm)])
                for title, claims in sections.items()
            ],
            signs=SIGNS,
            calm=calm,
        )
        + "\n"
    )


def _signs(claims: Iterable[Claim], decisions: Decisions, column: str) -> str:
    return "".join(SIGNS[d.verdict] for claim in claims if (d := decisions.get((claim.key, column))))


def _failing(sections: Sections, decisions: Decisions, column: str) -> list[tuple[Claim, Decision]]:
    """The claims that fail in a column."""
    every = ((claim, decisions.get((claim.key, column))) for claims in sections.values() for claim in claims)
    return [(claim, decision) for claim, decision in every if decision and decision.verdict is Verdict.FAILS]


def airframes_page(sections: Sections, decisions: Decisions) -> str:
    """The page of what is left of the claims on the airframes."""
    stands = partial(standing, sections, decisions=decisions)

    def everywhere(conditions: Iterable[str]) -> set[str]:
        return set.intersection(*(stands(condition, each) for condition in conditions for each in AIRFRAMES))

    def on_each(condition: str) -> str:
        return ", ".join(f"{len(stands(condition, each))} on {each.name}" for each in AIRFRAMES)

    return (
        template("harness.studies.paper", "claims_sixdof.md.jinja").render(
            asked=sum(isinstance(claim, FlownClaim) for claims in sections.values() for claim in claims),
            calm=CALM,
            gone=set.intersection(*(stands(CALM, BASELINE) - stands(CALM, each) for each in AIRFRAMES)),
            standing=stands,
            everywhere=everywhere,
            on_each=on_each,
            keys=partial(keys, sections),
            counted=counts_by_condition(decisions),
            lost=lost(sections, decisions),
            conditions=CONDITIONS,
            kinematic=BASELINE,
            airframes=AIRFRAMES,
            aircraft=FLOWN_ON,
            larger=[each for each in AIRFRAMES if each.airspeed != PAPERS_AIRSPEED],
            banks={each.name: _bank_limit(each.name) for each in AIRFRAMES},
            held=HELD,
            verdicts=list(Verdict),
        )
        + "\n"
    )


def _bank_limit(airframe: str) -> str:
    return f"{math.degrees(aircraft.limits(aircraft.folder(airframe)).bank):.0f}°"
