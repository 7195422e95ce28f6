"""An assessment as lines and as numbers for a program."""

import math
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from harness.recorded.assessment import Assessment
from harness.recorded.beside import ModelFlight
from harness.recorded.part_finding import CANNOT, PartFinding
from harness.tables import number, table
from harness.vocabulary import Verdict

HEADINGS = ("part", "it", "value", "95 % interval", "unit", "windows", "")


def lines(found: Assessment) -> Iterator[str]:
    """The verdict on each part of the assumption, and what cannot be judged."""
    judged = [finding for finding in found.findings if finding.word != CANNOT]
    refused = [finding for finding in found.findings if finding.word == CANNOT]
    parts: dict[str, list[str]] = {}  # by the reason why they cannot be judged
    for finding in refused:
        parts.setdefault(finding.reason, []).append(finding.part.title)
    if not judged and len(parts) == 1:
        yield f"The assumption {CANNOT}: {next(iter(parts))}."
        return
    if judged:
        yield f"The assumption in the flight from {found.begin:.1f} to {found.end:.1f} s:"
        yield ""
        yield from table(HEADINGS, map(row, judged), "llrrlrl")
        yield ""
        yield from wind_line(found)
        yield from found.notes
    if refused:
        if judged:
            yield ""
        yield f"What {CANNOT}:"
        for reason, titles in parts.items():
            yield f"- {reason}: {', '.join(titles)}"


def row(finding: PartFinding) -> list[str]:
    """The cells below `HEADINGS`."""
    bound = _is_bound(finding)
    interval = "" if bound or math.isnan(finding.low) else f"{number(finding.low)} to {number(finding.high)}"
    reason = finding.reason
    if finding.needed:
        reason = f"{reason}: {finding.needed} windows like these would decide"
    value = f"{'<= ' if bound else ''}{number(finding.value)}"
    return [finding.part.title, finding.word, value, interval, finding.part.unit, str(finding.windows), reason]


def wind_line(found: Assessment) -> Iterator[str]:
    """The wind, where it is known."""
    if not found.wind:
        return
    parts = [
        f"{number(value)} [{number(low)}, {number(high)}] m/s to the {towards}"
        for towards, (value, low, high) in (("north", found.wind.north), ("east", found.wind.east))
    ]
    yield f"wind, by the {found.wind.source}: the air moves {parts[0]}, {parts[1]}"


def beside_lines(found: Assessment, model: ModelFlight) -> Iterator[str]:
    """The recorded flight and the model, part by part."""
    yield f"Beside the model {model.airframe}, with the recorded bank, at {model.airspeed:.1f} m/s in this wind:"
    yield ""
    yield from table(["part", "recorded", model.airframe, "unit"], beside_rows(found, model), "lrrl")
    if model.ended:
        yield f"The model's flight ended before the recording: {model.ended}."


def beside_rows(found: Assessment, model: ModelFlight) -> list[list[str]]:
    """The cells of that table: part, recorded, model, unit."""
    return [
        [recorded.part.title, _interval(recorded), _interval(model.assessment[recorded.part.title]), recorded.part.unit]
        for recorded in found.findings
    ]


def _is_bound(finding: PartFinding) -> bool:
    """Whether the value is only an upper bound."""
    return finding.word == Verdict.UNDECIDED and finding.low == 0.0


def _interval(finding: PartFinding) -> str:
    if finding.word == CANNOT:
        return "-"
    if _is_bound(finding):
        return f"<= {number(finding.value)}"
    return f"{number(finding.value)} [{number(finding.low)}, {number(finding.high)}]"


def as_json(found: Assessment) -> dict[str, Any]:
    """The assessment for JSON; SI, rad."""
    return {
        "begin_s": found.begin,
        "end_s": found.end,
        "findings": [
            {
                "part": finding.part.title,
                "unit": finding.part.unit,
                "word": str(finding.word),
                "reason": finding.reason,
                "value": _known(finding.value),
                "low": _known(finding.low),
                "high": _known(finding.high),
                "windows": finding.windows,
                "windows_needed": finding.needed,
            }
            for finding in found.findings
        ],
        "wind": asdict(found.wind) if found.wind else None,
        "autopilots_wind": {name: _known(value) for name, value in asdict(found.estimated).items()}
        if found.estimated
        else None,
        "notes": list(found.notes),
    }


def _known(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value
