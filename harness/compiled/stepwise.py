"""A 6-DOF flight by compiled steps: JSBSim flies a period, and compiled code does all that Python does between two."""

import math
from collections.abc import Callable
from typing import Any

from harness.compiled.loop import NOT_FLYING, Look
from harness.plants.sixdof import is_flying, state_of


def reading(look: Look) -> Callable[..., Any]:
    """A law that looks at what is read from JSBSim."""

    def step(
        read: Any, table: Any, target: Any, estimate: Any, noise: Any, told: Any, k: int, judged: bool, stall: float,
        frame: Any, known: Any, memory: Any,
    ) -> Any:  # fmt: skip
        """How the flight ended, the command, and the law's memory.

        `read`: the values of the readers, then the heading a step before. An aircraft that is not flying is left to be
        judged, its state in its row; once it is, the law is asked.
        """
        state = state_of(
            (
                read[0], read[1], read[2], read[3], read[4], read[5], read[6], read[7], read[8], read[9], read[10],
                read[11], read[12], read[13], read[14], read[15], read[16], read[17], read[18], read[19], read[20],
                read[21], read[22], read[23], read[24],
            ),
            read[25],
            frame,
        )  # fmt: skip
        fine = judged or is_flying(state, stall)
        if not judged:
            for x in state:
                fine = fine and math.isfinite(x)
        if not fine:
            for i in range(len(state)):
                table[k, 1 + i] = state[i]
            return NOT_FLYING, 0.0, memory
        return look(table, target, estimate, noise, told, k, state, known, memory)

    return step
