"""The notes of a recording, in Markdown: results, feasibility, settings, provenance, and the command that made it."""

import json
import platform
from collections.abc import Sequence
from functools import cache

from harness.feasibility import feasibility_line, warnings
from harness.files import as_text
from harness.key import PHYSICS_VERSION, flight_key
from harness.log import FlightLog
from harness.log.metric import METRICS, YES_OR_NO, Metric, Value, measure
from harness.markup import block
from harness.markup import markdown as as_markdown
from harness.provenance import packages
from harness.review.styled import StyledFlight, is_crowd
from harness.settings import document
from harness.settings.columns import by_column
from harness.tables import markdown, number

_FEW = ("convergence_time_s", "range_error_rms_m", "chatters", "limit_cycle_hz")  # of many flights
_ALSO = ("chatters", "limit_cycle_hz")  # on the first tab, beside those of short tables
_packages = cache(packages)


def result_notes(flights: Sequence[StyledFlight], title: str, above: str, command: str) -> str:
    """The results, with a column per flight, and the command that repeats them; `above` is Markdown to precede them."""
    parts = [f"# {as_markdown(title)}"]
    parts += [above] if above else []
    names_by_line: dict[str, list[str]] = {}
    for flight in flights:
        for line in (
            feasibility_line(flight.log.flight),
            *(f"warning: {w}" for w in warnings(flight.log.flight, of_circle=False)),
        ):
            names_by_line.setdefault(line, []).append(flight.name)
    of = {line: "" if len(names) == len(flights) else f" ({', '.join(names)})" for line, names in names_by_line.items()}
    parts.append("\n".join(f"- {as_markdown(f'{line}{of[line]}')}" for line in names_by_line))
    judged = [measure(flight.log) for flight in flights]
    wide = len(flights) < 3  # enough room for the meaning
    ends = [f"{f.log.outcome.value}{': ' if f.log.reason else ''}{f.log.reason}" for f in flights]
    head = ["metric", *(flight.name for flight in flights), *(["meaning"] if wide else [])]
    rows = [["outcome", *ends, *(["how it ended"] if wide else [])]]
    rows += [[name, *(number(m[name]) for m in judged), *([METRICS[name].meaning] if wide else [])] for name in METRICS]
    parts.append(_table([head, *rows]))
    parts += [f"Made by\n\n{block(command)}"] if command else []
    return as_text("\n\n".join(parts))


def metric_notes(flights: Sequence[StyledFlight]) -> str:
    """The metrics that short tables have, beside the outcome: the settled part first seen in numbers."""
    judged = [measure(flight.log) for flight in flights]
    usual = [name for name, metric in METRICS.items() if metric.in_short_tables or name in _ALSO]
    metrics = [METRICS[name] for name in (_FEW if is_crowd(flights) else usual)]
    metrics = [metric for metric in metrics if any(m[metric.name] is not None for m in judged)]
    heads = [", ".join(filter(None, (metric.heading, _unit(metric)))) for metric in metrics]
    cells = [[_cell(metric, m[metric.name]) for metric in metrics] for m in judged]
    names = [flight.name for flight in flights]
    ends = [flight.log.outcome.value for flight in flights]
    if is_crowd(flights):
        lines = [[name, *row, end] for name, row, end in zip(names, cells, ends, strict=True)]
        return _table([["", *heads, "ended"], *lines])
    rows = [[head, *column] for head, column in zip(heads, zip(*cells, strict=True), strict=True)]
    return _table([["", *names], *rows, ["ended", *ends]])


def _unit(metric: Metric) -> str:
    return "" if metric.unit == YES_OR_NO else "%" if metric.percent else metric.label


def _cell(metric: Metric, value: Value) -> str:
    return number(value, metric.scale if metric.percent and not isinstance(value, bool) else 1.0)


def settings_notes(flights: Sequence[StyledFlight]) -> str:
    """The provenance of the recording, the differences in settings, and all settings of the first flight."""
    made_with = {
        **_packages(),
        "physics": str(PHYSICS_VERSION),
        "python": platform.python_version(),
        "on": platform.platform(),
    }
    parts = ["## Provenance", _table([["what", "version"], *([name, value] for name, value in made_with.items())])]
    parts.append(
        _table([["flight", "key", "digest"], *([f.name, flight_key(f.log.flight), f.log.digest] for f in flights)])
    )
    first = by_column(document(flights[0].log.flight))
    for flight in flights[1:]:
        other = by_column(document(flight.log.flight))
        differs = [
            [k, _word(first.get(k)), _word(other.get(k))] for k in {**first, **other} if first.get(k) != other.get(k)
        ]
        parts.append(f"## {as_markdown(flight.name)} beside {as_markdown(flights[0].name)}")
        parts.append(_table([["setting", flights[0].name, flight.name], *differs]) if differs else "the same settings")
    parts += [
        f"## Settings: {as_markdown(flights[0].name)}",
        _table([["setting", "value"], *([k, _word(v)] for k, v in first.items())]),
    ]
    return as_text("\n\n".join(parts))


def flight_json(log: FlightLog, place: int) -> str:
    """Settings and outcome of a flight, and its place among others, as JSON; with the rows they restore the log."""
    return json.dumps(
        {"place": place, "flight": document(log.flight), "outcome": log.outcome.value, "reason": log.reason}
    )


def _word(value: object) -> str:
    return "-" if value is None else value if isinstance(value, str) else json.dumps(value)


def _table(rows: Sequence[Sequence[str]]) -> str:
    """The first row holds the headings."""
    head, *body = ([as_markdown(cell) for cell in row] for row in rows)
    return "\n".join(markdown(head, body))
