"""The content of a recorded flight, as lines: channels, their units, their origin, and their update rates."""

import math
from collections.abc import Iterator
from typing import Any

from harness.recorded.recorded_flight import QUANTITIES, Channel, RecordedFlight
from harness.tables import number, table

SHOWN = {"rad": ("deg", 180.0 / math.pi), "rad/s": ("deg/s", 180.0 / math.pi)}


HEADINGS = ("channel", "new values\n/s", "rows\n/s", "longest gap\ns", "least", "greatest", "unit", "what it is")


def contents(flight: RecordedFlight) -> Iterator[str]:
    """The lines that report what was read."""
    files = flight.sources[0] if len(flight.sources) == 1 else f"{len(flight.sources)} files"
    yield f"{flight.name}: {duration(flight):.1f} s of flight log, from {files}"
    if flight.vehicle:
        yield f"vehicle: {flight.vehicle}"
    yield f"clock: {flight.clock}; times in s since the log's first row"
    yield ""
    yield from table(HEADINGS, rows(flight), "lrrrrrl")
    remarks = list(_remarks(flight))
    if remarks:
        yield from ("", *remarks)


def _remarks(flight: RecordedFlight) -> Iterator[str]:
    for event in flight.events:
        yield f"at {event.time:.1f} s: {event.text}"
    if flight.failure:
        yield f"at {flight.failure.time:.1f} s: failure: {flight.failure.text}"
    for problem in flight.problems:
        yield f"note: {problem}"
    for refusal in flight.refusals:
        yield f"cannot be judged: {refusal}"


def rows(flight: RecordedFlight) -> Iterator[list[str]]:
    """The cells below `HEADINGS`, a row for each channel."""
    return (_row(name, flight) for name in QUANTITIES if name in flight)


def duration(flight: RecordedFlight) -> float:
    """Time from the first to the last sample, s."""
    return flight.end - flight.begin


def as_json(flight: RecordedFlight) -> dict[str, Any]:
    """The content for JSON; SI, rad."""
    return {
        "name": flight.name,
        "sources": list(flight.sources),
        "vehicle": flight.vehicle,
        "clock": flight.clock,
        "begin_s": flight.begin,
        "end_s": flight.end,
        "channels": {name: _described(name, channel) for name, channel in flight.channels.items()},
        "events": [event._asdict() for event in flight.events],
        "failure": flight.failure._asdict() if flight.failure else None,
        "problems": list(flight.problems),
        "refusals": list(flight.refusals),
    }


def _row(name: str, flight: RecordedFlight) -> list[str]:
    channel = flight[name]
    unit, scale = SHOWN.get(QUANTITIES[name].unit, (QUANTITIES[name].unit, 1.0))
    what = ", ".join(filter(None, (channel.basis, channel.note)))
    least, greatest = (number(float(value), scale) for value in (channel.values.min(), channel.values.max()))
    repeats = channel.rows > len(channel)  # then its rows go on after its last new value
    span = flight.end - flight.begin if repeats else channel.time[-1] - channel.time[0]
    rates = channel.rate, (channel.rows - 1) / span if span else math.nan, channel.longest_gap
    return [name, *map(_finite, rates), least, greatest, unit, what]


def _finite(value: float) -> str:
    return number(value) if math.isfinite(value) and value > 0.0 else "-"


def _described(name: str, channel: Channel) -> dict[str, Any]:
    return {
        "unit": QUANTITIES[name].unit,
        "basis": str(channel.basis),
        "source": channel.source,
        "note": channel.note,
        "samples": len(channel),
        "rows": channel.rows,
        "new_values_per_s": channel.rate,
        "longest_gap_s": channel.longest_gap if math.isfinite(channel.longest_gap) else None,
    }
