"""The numeric libraries use one thread: the matrices are small, and threads that wait cost more than they bring."""

import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")  # before a test loads them
