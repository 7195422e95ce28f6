"""Recorded flights: read from their logs, judged, and compared with the simulated aircraft."""
