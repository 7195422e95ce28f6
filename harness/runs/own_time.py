"""The time that a worker process has for itself: it computes, or is blocked by what it does itself.

The rest is the machine's, and says nothing about a flight: the process waits for a processor or a disk, or is stopped.
Wall time would count it.
"""

import time
from typing import NamedTuple

import psutil

_MOST = 1.0  # s of one look while the process is blocked: the process that looks may have been stopped itself


class Spent(NamedTuple):
    """Seconds."""

    computed: float
    blocked: float


class OwnTime:
    """The own time of one process."""

    def __init__(self, pid: int) -> None:
        self._pid = pid
        self._used, _ = self._state()
        self._at = time.monotonic()

    def since_last_look(self) -> Spent:
        """Nothing when the process has ended."""
        (used, blocked), now = self._state(), time.monotonic()
        computed, passed = used - self._used, now - self._at
        self._used, self._at = used, now
        return Spent(max(0.0, computed), min(passed, _MOST) if blocked and not computed else 0.0)

    def _state(self) -> tuple[float, bool]:
        """The processor time so far, s, and whether the process is blocked, but not by a disk."""
        try:
            process = psutil.Process(self._pid)
            with process.oneshot():
                times = process.cpu_times()
                return times.user + times.system, process.status() == psutil.STATUS_SLEEPING
        except psutil.Error:
            return 0.0, False
