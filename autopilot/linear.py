"""A linear system in discrete time: the form in which a law with memory gives its linearisation."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Linear(NamedTuple):
    """x(k+1) = A x + B i, o = C x + D i, at the sampling instants."""

    A: Array
    B: Array
    C: Array
    D: Array

    def at(self, z: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """The transfer function at the points `z`; shape (len(z), outputs, inputs)."""
        left = z[:, np.newaxis, np.newaxis] * np.eye(len(self.A)) - self.A
        return np.asarray(self.C @ np.linalg.solve(left, np.broadcast_to(self.B, (len(z), *self.B.shape))) + self.D)
