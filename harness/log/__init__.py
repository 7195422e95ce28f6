"""The log of a flight, the metrics that judge it, and its picture."""

from harness.log.flight_log import COLUMNS, LOOP_COLUMNS, SEEN_COLUMNS, FlightLog

__all__ = ["COLUMNS", "LOOP_COLUMNS", "SEEN_COLUMNS", "FlightLog"]
