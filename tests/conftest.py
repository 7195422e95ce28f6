"""What every test starts from.

The numeric libraries use one thread: the matrices are small, and threads that wait cost more than they bring. Commands
can be interrupted, also where a shell runs the suite in the background, which leaves an interrupt ignored.
"""

import os
import signal

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")  # before a test loads them
signal.signal(signal.SIGINT, signal.default_int_handler)
