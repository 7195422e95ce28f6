"""The world that a flight meets: air, target, randomness. The same for every plant and law."""
