"""Random streams, named by seed and purpose."""

import numpy as np


def stream(seed: int, purpose: str) -> np.random.Generator:
    """A random stream that depends on the seed and its purpose alone, never on matrix position, plant or law."""
    return np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=tuple(purpose.encode()))))
