"""What a flight leaves behind."""

import hashlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from autopilot.guidance import Guidance
from harness.flight import Flight
from harness.plant import Outcome
from harness.state import State
from harness.target import TargetState

GUIDANCE_COLUMNS = ("heading_rate_command", *Guidance._fields[1:])
COLUMNS = ("time", *State._fields, *TargetState._fields, *GUIDANCE_COLUMNS)


@dataclass(frozen=True, slots=True)
class FlightLog:
    """A flight and what happened, one row per guidance period. SI, rad; `log["range_error"]` is a column."""

    flight: Flight
    outcome: Outcome
    reason: str  # why it ended early, or empty
    table: NDArray[np.float64]  # (rows, len(COLUMNS))

    def __getitem__(self, column: str) -> NDArray[np.float64]:
        return self.table[:, COLUMNS.index(column)]

    def __len__(self) -> int:
        return len(self.table)

    @property
    def digest(self) -> str:
        """A hash of the trajectory to the last bit, and of how it ended."""
        content = hashlib.blake2b(repr((COLUMNS, self.outcome.value, self.reason)).encode(), digest_size=16)
        content.update(np.ascontiguousarray(self.table + 0.0).tobytes())  # + 0.0: minus zero is zero
        return content.hexdigest()
