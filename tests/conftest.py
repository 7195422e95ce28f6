"""What every test starts from.

The numeric libraries use one thread, as in a command. Commands can be interrupted, also where a shell runs the suite in
the background, which leaves an interrupt ignored.
"""

import signal

from harness.threads import use_one_thread

use_one_thread()  # before a test loads them
signal.signal(signal.SIGINT, signal.default_int_handler)
