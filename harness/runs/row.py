"""A flight as one row of results: printed by `fly --json`, kept by the store."""

import json
import math
import sys
from typing import Any, NamedTuple

import numpy as np

from harness.checks import model_of_another
from harness.compiled import engine
from harness.feasibility import feasibility_margin
from harness.flight import Flight
from harness.key import Identity
from harness.log import COLUMNS, FlightLog
from harness.log.metric import METRICS, measure
from harness.loop import Watch, simulate
from harness.plants.plant import Outcome, PlantError
from harness.runs import apart

# key, outcome, reason, digest, flight, metrics, feasibility_margin_deg_s: none without a limit, -inf where no heading
# rate holds the circle
FlightRow = dict[str, Any]


class FlightResult(NamedTuple):
    """How a flight went; every value is fit for JSON."""

    outcome: str
    reason: str
    digest: str
    metrics: dict[str, float | bool | None]
    final: dict[str, float]  # the last row of the log: see `final`
    seconds: float | None  # wall time of the simulation, s


def row(flight: Flight, identity: Identity, result: FlightResult) -> FlightRow:
    """The row of a flight with this result."""
    margin = math.degrees(feasibility_margin(flight))
    return {
        "key": identity.key,
        "outcome": result.outcome,
        "reason": result.reason,
        "digest": result.digest,
        "flight": identity.settings,
        "metrics": result.metrics,
        "feasibility_margin_deg_s": margin if margin < math.inf else None,
    }


def json_of(row: FlightRow) -> str:
    """The row as JSON. That has no infinity: the largest number below zero stands for a margin of -inf."""
    margin = row["feasibility_margin_deg_s"]
    finite = None if margin is None else max(margin, -sys.float_info.max)
    return json.dumps({**row, "feasibility_margin_deg_s": finite}, allow_nan=False)


def result_of(log: FlightLog, seconds: float | None = None) -> FlightResult:
    """How a flight went, from its log; `seconds` is the wall time of its simulation."""
    if log.outcome.of_machine and not len(log):
        return failed_result(log.outcome, log.reason)
    return FlightResult(log.outcome.value, log.reason, log.digest, measure(log), final(log), seconds)


def failed_result(outcome: Outcome, reason: str) -> FlightResult:
    """The result of a flight that failed without a log."""
    return FlightResult(outcome.value, reason, "", dict.fromkeys(METRICS), {}, None)


def simulate_safely(
    flight: Flight, watch: Watch | None = None, *, compiled: bool = False, in_worker: bool = True
) -> FlightLog:
    """Like `simulate`, but a flight that cannot start is an `invalid` log: one of many must not stop the others.

    With `compiled` by a compiled loop where possible, bit-identical. A third-party model may crash a worker, but no
    other process.

    Raises MemoryError.
    """
    try:
        if not in_worker and model_of_another(flight):
            return apart.fly(flight)
        return engine.simulate(flight, watch) if compiled else simulate(flight, watch)
    except MemoryError:
        raise  # the machine's fault, not the flight's
    except Exception as error:  # any kind: the other flights of the run are unaffected
        reason = f"{error.key}: {error}" if isinstance(error, PlantError) else f"{type(error).__name__}: {error}"
        return FlightLog(flight, Outcome.INVALID, f"it cannot start: {reason}", np.empty((0, len(COLUMNS))))


def final(log: FlightLog) -> dict[str, float]:
    """The finite numbers of the log's last row, by column, SI: they measure how far another flight deviates."""
    if not len(log):
        return {}
    return {name: x for name, x in zip(COLUMNS, log.table[-1].tolist(), strict=True) if math.isfinite(x)}
