"""The verdict: what differs between the plants, with intervals, and which part of the assumption holds."""
