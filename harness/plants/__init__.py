"""The plants, a rung of the ladder each."""
