"""How a process of the harness begins: spawned, so that it shares nothing with its parent, and with one thread."""

import multiprocessing

SPAWN = multiprocessing.get_context("spawn")
THREADS = (  # variables by which the numeric libraries are told how many
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)
