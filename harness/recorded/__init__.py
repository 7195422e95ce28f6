"""Flights that somebody recorded: read from their logs, judged, and held beside the simulated aircraft."""
