"""A flight as a row: what `fly --json` prints and the store keeps, the same for both."""

import math
import time
from typing import Any

import numpy as np

from harness.flight import Flight, feasibility_margin
from harness.flight_log import COLUMNS, FlightLog
from harness.key import Identity, identity
from harness.metrics import MEANING, metrics
from harness.plant import Outcome, PlantError
from harness.simulation import simulate

Row = dict[str, Any]  # key, outcome, reason, digest, flight, metrics, feasibility_margin_deg_s


def row_of(log: FlightLog) -> Row:
    """The row of a flight; fit for JSON, None where there is no number."""
    return _row(log.flight, identity(log.flight), log.outcome, log.reason, log.digest, metrics(log))


def failed_row(flight: Flight, of: Identity, outcome: Outcome, reason: str) -> Row:
    """The row of a flight that left no log."""
    return _row(flight, of, outcome, reason, "", dict.fromkeys(MEANING))


def _row(
    flight: Flight, of: Identity, outcome: Outcome, reason: str, digest: str, judged: dict[str, float | None]
) -> Row:
    margin = math.degrees(feasibility_margin(flight))
    return {
        "key": of.key,
        "outcome": outcome.value,
        "reason": reason,
        "digest": digest,
        "flight": of.settings,
        "metrics": judged,
        "feasibility_margin_deg_s": margin if math.isfinite(margin) else None,  # none without a limit
    }


def flown(flight: Flight) -> tuple[Row, FlightLog]:
    """Flies the flight. What cannot start is an outcome here, `invalid`: one of many must not stop the others."""
    begin = time.perf_counter()
    try:
        log = simulate(flight)
    except Exception as error:  # of whatever kind: the others have nothing to do with it
        reason = f"{error.key}: {error}" if isinstance(error, PlantError) else f"{type(error).__name__}: {error}"
        log = FlightLog(flight, Outcome.INVALID, f"it cannot start: {reason}", np.empty((0, len(COLUMNS))))
    seconds = time.perf_counter() - begin
    return {**row_of(log), "seconds": seconds, "final": final(log)}, log


def final(log: FlightLog) -> dict[str, float]:
    """The last row of the log, SI, what is a number of it: enough to see how far a later flight is from this one."""
    if not len(log):
        return {}
    return {name: x for name, x in zip(COLUMNS, log.table[-1].tolist(), strict=True) if math.isfinite(x)}
