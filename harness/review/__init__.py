"""Review of flights in Rerun: writing and reading recordings, the viewer, and streaming a flight while it is flown."""
