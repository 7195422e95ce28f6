"""Looking at flights in Rerun: recordings written and read, the viewer, and flights shown while they are flown."""
