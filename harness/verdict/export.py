"""A comparison as JSON, CSV and LaTeX."""

import math
from collections.abc import Iterator
from dataclasses import asdict, is_dataclass
from typing import Any

import pandas as pd

from harness.markup import latex
from harness.settings.written import written
from harness.verdict.answer import signed, unit_of
from harness.verdict.comparison import Comparison
from harness.verdict.moved import moved


def as_document(comparison: Comparison) -> dict[str, Any]:
    """Fit for JSON: NaN is null, no limit is `inf` as in a settings file."""
    document = {
        "answer": comparison.answer.splitlines(),
        "by": comparison.by,
        "baseline": comparison.baseline,
        "flights": comparison.flights,
        "pairs": [
            {"baseline": before, "key": after}
            for before, after in zip(comparison.pairs.reference["key"], comparison.pairs.other["key"], strict=True)
        ],
        "changed": list(comparison.changed),
        "moved": [flight._asdict() for flight in moved(comparison)],
        "unpaired": [asdict(flight) for flight in comparison.unpaired],
        "assess": written(comparison.assess),
        "axes": comparison.axes,
        "differences": _records(comparison.differences),
        "conditions": _records(comparison.conditions),
        "scorecards": [
            {
                "aircraft": card.aircraft,
                "value": card.value,
                "pairs": card.pairs,
                "seeds": card.seeds,
                "lost": card.lost._asdict(),
                "parts": [
                    {"title": part.title, "column": part.column, **_conclusion(card.conclusion(part.column))}
                    for part in card.parts
                ],
            }
            for card in comparison.scorecards
        ],
    }
    fit: dict[str, Any] = plain(document)
    return fit


def _conclusion(conclusion: Any) -> dict[str, Any]:
    condition = conclusion.condition
    return {
        "verdict": str(conclusion.word),
        "holds": conclusion.holds,
        "fails": conclusion.fails,
        "cells": conclusion.of,
        "condition": {"word": str(condition.word), "text": condition.text} if condition else None,
        "confounded": list(conclusion.confounded),
    }


def _records(table: pd.DataFrame) -> list[dict[str, Any]]:
    return [{str(key): value for key, value in row.items()} for row in table.to_dict("records")]


def plain(value: Any) -> Any:
    """The value as JSON can hold it: NaN is null, infinity `inf`."""
    match value:
        case dict():
            return {str(key): plain(inner) for key, inner in value.items()}
        case list() | tuple():
            return [plain(inner) for inner in value]
        case bool() | str() | None:
            return value
        case _ if value is pd.NA:
            return None
        case _ if is_dataclass(value) and not isinstance(value, type):
            return plain(asdict(value))
        case _ if hasattr(value, "item"):  # numpy's
            return plain(value.item())
        case float():
            return "inf" if value == math.inf else value if math.isfinite(value) else None
        case _:
            return value


def as_csv(comparison: Comparison) -> str:
    """The differences, one a line; empty where there is none."""
    table = comparison.differences
    table.insert(1, "unit", [unit_of(metric) for metric in table["metric"]])
    return str(table.to_csv(index=False, lineterminator="\n"))


def as_latex(comparison: Comparison) -> str:
    """The differences that have a margin, as a tabular that needs no package."""
    return "\n".join(_latex(comparison)) + "\n"


def _latex(comparison: Comparison) -> Iterator[str]:
    yield r"\begin{tabular}{lllrrl}"
    yield r"\hline"
    yield r"metric & unit & cell & difference & 95\,\% interval & verdict \\"
    for card in comparison.scorecards:
        yield r"\hline"
        yield rf"\multicolumn{{6}}{{l}}{{{latex(f'{card.aircraft}, {comparison.by} = {card.value}')}}} \\"
        for judgement in card.judgements:
            if not judgement.has_margin:
                continue
            cell = ", ".join(f"{axis} = {value}" for axis, value in judgement.at.items())
            between = "--" if math.isnan(judgement.low) else f"$[{signed(judgement.low)}, {signed(judgement.high)}]$"
            cells = (latex(judgement.column), latex(unit_of(judgement.column)), latex(cell),
                     f"${signed(judgement.difference)}$", between, str(judgement.word))  # fmt: skip
            yield " & ".join(cells) + r" \\"
    yield r"\hline"
    yield r"\end{tabular}"
