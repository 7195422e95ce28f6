"""The threads of the numeric libraries: one, since the matrices are small, and on a busy machine threads wait."""

import os

_VARIABLES = (  # that set the number of threads of the libraries
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)


def use_one_thread() -> None:
    """Sets one thread for this process and its children. To be called before NumPy is imported, which reads it once."""
    os.environ.update(dict.fromkeys(_VARIABLES, "1"))
