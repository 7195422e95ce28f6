"""One thread for the numeric libraries, before any test loads them: matrices are small, and waiting threads cost more."""

import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")
