"""A comparison as JSON, CSV and LaTeX."""

import csv
import io
import math
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any

from harness.metric import METRICS
from harness.settings.written import written
from harness.verdict.comparison import Comparison, Row, axes_of
from harness.verdict.parts import Part
from harness.verdict.words import answer, plain, signed


def as_document(comparison: Comparison) -> dict[str, Any]:
    """Fit for JSON: NaN is null, no limit is `inf` as in a settings file."""
    return {
        "answer": answer(comparison),
        "baseline": comparison.baseline,
        "flights": comparison.flights,
        "pairs": [
            {"baseline": before, "key": after}
            for before, after in zip(comparison.pairs.reference["key"], comparison.pairs.other["key"], strict=True)
        ],
        "unpaired": _plain(comparison.unpaired),
        "failed": _plain(comparison.failed),
        "assess": written(comparison.assess),
        "axes": _plain(axes_of(comparison)),
        "differences": _plain(comparison.rows),
        "scorecards": _plain(comparison.scorecards),
        "attributions": _plain(comparison.attributions),
    }


def _plain(value: object) -> Any:
    match value:
        case Part():
            return {"name": value.name, "title": value.title, "unit": value.unit, "threshold": value.threshold}
        case dict():
            return {str(key): _plain(inner) for key, inner in value.items()}
        case tuple() if hasattr(value, "_fields"):
            return {name: _plain(getattr(value, name)) for name in value._fields}
        case list() | tuple():
            return [_plain(inner) for inner in value]
        case bool() | str() | None:
            return value
        case _ if is_dataclass(value) and not isinstance(value, type):
            return {field.name: _plain(getattr(value, field.name)) for field in fields(value)}
        case _ if hasattr(value, "item"):  # numpy's
            return _plain(value.item())
        case float():
            return "inf" if value == math.inf else value if math.isfinite(value) else None
        case _:
            return value


COLUMNS = (
    "aircraft", "law", "plant", "baseline", "metric", "unit", "mean_baseline", "mean_plant",
    "difference", "low", "high", "pairs", "seeds", "no_interval",
)  # fmt: skip


def as_csv(comparison: Comparison) -> str:
    """The paired differences, one a line; empty where there is none."""
    out = io.StringIO()
    table = csv.writer(out, lineterminator="\n")
    table.writerow(COLUMNS)
    for row in comparison.rows:
        change = row.difference
        numbers = (row.reference, row.other, change.mean, change.low, change.high)
        table.writerow(
            [row.aircraft, row.law, row.plant, comparison.baseline, row.metric, METRICS[row.metric].unit]
            + ["" if x is None or math.isnan(x) else repr(x) for x in numbers]
            + [change.pairs, change.seeds, change.why]
        )
    return out.getvalue()


def as_latex(comparison: Comparison) -> str:
    """The paired differences as a tabular that needs no package."""
    return "\n".join(_latex(comparison)) + "\n"


def _latex(comparison: Comparison) -> Iterator[str]:
    yield r"\begin{tabular}{llrrrr}"
    yield r"\hline"
    yield rf"metric & unit & {_escaped(comparison.baseline)} & plant & difference & 95\,\% interval \\"
    kind = None
    for row in comparison.rows:
        if (this := (row.aircraft, row.law, row.plant)) != kind:
            kind = this
            yield r"\hline"
            yield rf"\multicolumn{{6}}{{l}}{{{_escaped(f'{row.aircraft}, {row.law}: {row.plant}')}}} \\"
        yield " & ".join(_latex_cells(row)) + r" \\"
    yield r"\hline"
    yield r"\end{tabular}"


def _latex_cells(row: Row) -> Iterator[str]:
    change = row.difference
    yield _escaped(row.metric)
    yield _escaped(METRICS[row.metric].unit)
    yield from (f"${plain(x)}$" if not math.isnan(x) else "--" for x in (row.reference, row.other))
    yield f"${signed(change.mean)}$" if not math.isnan(change.mean) else "--"
    yield (
        f"$[{signed(change.low)}, {signed(change.high)}]$"
        if change.low is not None and change.high is not None
        else "--"
    )


def _escaped(text: str) -> str:
    return text.replace("_", r"\_").replace("%", r"\%").replace("&", r"\&")
