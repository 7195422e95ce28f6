"""Thinning of long logs: which rows are read, so that a log of any size takes bounded memory."""

import math

MOST = 300_000  # rows of one file, topic or message: 100 minutes at 50 Hz


def every(rows: int) -> int:
    """Every how many rows one is read, where their number is known from the start."""
    return max(1, math.ceil(rows / MOST))


def said(source: str, rows: int, step: int) -> str:
    """The report on a log of which one row in `step` is read."""
    return f"{source}: one row in {step} is read of its {rows}, to bound the memory"
