"""A flight as a row: what `fly --json` prints and the store keeps, the same for both."""

import math
from typing import Any, NamedTuple

import numpy as np

from harness.feasibility import feasibility_margin
from harness.flight import Flight
from harness.key import Identity, identity
from harness.log import COLUMNS, FlightLog
from harness.loop import simulate
from harness.metric import METRICS, measure
from harness.plants.plant import Outcome, PlantError

FlightRow = dict[str, Any]  # key, outcome, reason, digest, flight, metrics, feasibility_margin_deg_s


class FlightResult(NamedTuple):
    """How a flight went; fit for JSON."""

    outcome: str
    reason: str
    digest: str
    metrics: dict[str, float | bool | None]
    final: dict[str, float]  # see `final`
    seconds: float | None  # wall time of the simulation


def row_of(log: FlightLog) -> FlightRow:
    """The row of a flight; fit for JSON, None where there is no number."""
    return row(log.flight, identity(log.flight), result_of(log))


def row(flight: Flight, of: Identity, result: FlightResult) -> FlightRow:
    """The row of a flight that went so."""
    margin = math.degrees(feasibility_margin(flight))
    return {
        "key": of.key,
        "outcome": result.outcome,
        "reason": result.reason,
        "digest": result.digest,
        "flight": of.settings,
        "metrics": result.metrics,
        "feasibility_margin_deg_s": margin if math.isfinite(margin) else None,  # none without a limit
    }


def result_of(log: FlightLog, seconds: float | None = None) -> FlightResult:
    """How the flight went."""
    return FlightResult(log.outcome.value, log.reason, log.digest, measure(log), final(log), seconds)


def failed_result(outcome: Outcome, reason: str) -> FlightResult:
    """A flight that left no log."""
    return FlightResult(outcome.value, reason, "", dict.fromkeys(METRICS), {}, None)


def simulate_safely(flight: Flight) -> FlightLog:
    """Flies the flight. What cannot start is an outcome here, `invalid`: one of many must not stop the others."""
    try:
        return simulate(flight)
    except Exception as error:  # of whatever kind: the others have nothing to do with it
        reason = f"{error.key}: {error}" if isinstance(error, PlantError) else f"{type(error).__name__}: {error}"
        return FlightLog(flight, Outcome.INVALID, f"it cannot start: {reason}", np.empty((0, len(COLUMNS))))


def final(log: FlightLog) -> dict[str, float]:
    """The last row of the log, SI, what is a number of it: enough to see how far a later flight is from this one."""
    if not len(log):
        return {}
    return {name: x for name, x in zip(COLUMNS, log.table[-1].tolist(), strict=True) if math.isfinite(x)}
