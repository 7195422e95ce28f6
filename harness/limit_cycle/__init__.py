"""The limit cycle of a law behind an inner loop: predicted, and observed in flight."""
