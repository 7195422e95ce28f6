"""Reviewing flights: recordings, their layout, and the viewer. The only folder with Rerun in it."""
