"""Thirty flights of all plants, laws, airframes and airs, stored with the package and flown anew.

Equal digests: this machine and its libraries fly every flight as it was flown. Where another processor or another
version of a library moves the last bits, the stored numbers say by how much.
"""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from harness.doctor.finding import Finding, Soundness
from harness.loop import simulate
from harness.provenance import decides_bits, differences
from harness.settings import flight_from_document

STORED = Path(__file__).with_suffix(".json")
UNITS = {"north": "m", "east": "m", "altitude": "m", "heading": "rad", "airspeed": "m/s", "range_error": "m"}
EVERY = 10.0  # s: time between the rows whose numbers are stored
TOLERANCE = 1e-5  # SI, relative beyond 1: largest deviation of a flight by rounding


class StoredFlight(NamedTuple):
    """A flight, and what came of it."""

    flight: Mapping[str, Any]  # its [flight] table in file units
    outcome: str
    rows: int
    digest: str
    seen: Mapping[str, Sequence[float]]  # quantities by the log's columns, `EVERY` so often


class Deviation(NamedTuple):
    """How far a flight lies from the stored one."""

    by: float  # SI
    relative: float  # to the number, where that is larger than 1
    quantity: str


def flown(flight: Mapping[str, Any]) -> StoredFlight:
    """The flight as it is flown here and now."""
    log = simulate(flight_from_document(flight))
    step = round(EVERY / log.flight.guidance_period)
    seen = {name: [float(x) for x in log[name][step::step]] for name in UNITS}
    return StoredFlight(flight, log.outcome.value, len(log), log.digest, seen)


def moved(then: StoredFlight, now: StoredFlight) -> Deviation | None:
    """The largest deviation; infinite if the flight ended otherwise, None if all bits are equal."""
    if now.digest == then.digest:
        return None
    if (now.outcome, now.rows) != (then.outcome, then.rows):
        return Deviation(math.inf, math.inf, f"its end ({now.outcome} after {now.rows} rows)")
    apart = [
        Deviation(abs(x - stored), abs(x - stored) / max(1.0, abs(stored)), name)
        for name, values in then.seen.items()
        for stored, x in zip(values, now.seen[name], strict=True)
    ]
    return max(apart, key=lambda each: each.relative)


def stored() -> tuple[Mapping[str, str], dict[str, StoredFlight]]:
    """The environment that decided the bits of the stored flights, see `decides_bits`; and the flights by name."""
    content = json.loads(STORED.read_text(encoding="utf-8"))
    return content["bits"], {name: StoredFlight(**flight) for name, flight in content["flights"].items()}


def compared() -> Iterator[Finding]:
    """All stored flights, flown anew; where some have moved, also what is not as it was."""
    bits, flights = stored()
    by_name = {name: found for name, then in flights.items() if (found := moved(then, flown(then.flight)))}
    if not by_name:
        yield Finding("stored flights", f"{len(flights)} of {len(flights)} equal to the last bit", Soundness.OK)
        return
    name, worst = max(by_name.items(), key=lambda item: item[1].relative)
    yield Finding(
        "stored flights",
        f"{len(by_name)} of {len(flights)} moved, at most by {worst.by:.1e} {UNITS.get(worst.quantity, '')} in "
        f"{worst.quantity}, {TOLERANCE:g} allowed ({name})",
        Soundness.OK if worst.relative <= TOLERANCE else Soundness.BAD,
    )
    apart = list(differences(bits, decides_bits())) or ["nothing that is known to move bits"]
    yield from (Finding("not as stored", each, Soundness.OK) for each in apart)
