"""The limit cycle of a guidance law behind an inner loop: predicted, and observed in flight."""
