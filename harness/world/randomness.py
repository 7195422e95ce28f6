"""Random numbers by seed and purpose."""

import numpy as np


def stream(seed: int, purpose: str) -> np.random.Generator:
    """Random numbers that the seed and their purpose name: never the position in a matrix, the plant or the law."""
    return np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=tuple(purpose.encode()))))
