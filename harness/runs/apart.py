"""Flies a third-party model in a separate process, so that a crash of it is an outcome."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from harness.checks import model_of_another
from harness.child import ChildError, alive, limited
from harness.flight import Flight
from harness.log import COLUMNS, FlightLog
from harness.loop import Watch, simulate
from harness.plants.plant import Outcome

_STALLED = 15.0  # s without a new row of the log, after which a flight has hung
_MEMORY = 6 << 30  # bytes: the longest log has 2 GB, as the gusts of the longest flight


def fly(flight: Flight, watch: Watch | None = None) -> FlightLog:
    """`simulate`, but a model that does not come with the harness is flown in a child, before anybody watches it.

    Raises what `simulate` raises.
    """
    if model_of_another(flight) is None:
        return simulate(flight, watch)
    try:
        outcome, reason, table, channels = limited("the flight", _STALLED, _MEMORY, _flown, flight)
    except ChildError as error:
        died = Outcome.TIMEOUT if error.is_late else Outcome.WORKER_DIED
        return FlightLog(flight, died, str(error), np.empty((0, len(COLUMNS))))
    return simulate(flight, watch) if watch else FlightLog(flight, outcome, reason, table, channels)


def _flown(flight: Flight) -> tuple[Outcome, str, NDArray[np.float64], Mapping[str, NDArray[np.float64]]]:
    log = simulate(flight, alive)
    return log.outcome, log.reason, log.table, log.channels
