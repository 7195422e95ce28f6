"""The threads of the numeric libraries: one, since the matrices are small, and on a busy machine threads wait."""

import os

_VARIABLES = (  # by which the libraries are told how many
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)


def use_one_thread() -> None:
    """For this process and those that it starts. Before NumPy is imported: a library asks once."""
    os.environ.update(dict.fromkeys(_VARIABLES, "1"))
