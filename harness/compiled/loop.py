"""The loop of a compiled flight: that of `harness.loop` over what is known before the flight, row by row.

Law and plant are the functions that fly elsewhere; what stands here is lifted and compiled together with them.
"""

import math
from collections.abc import Callable
from typing import Any

from autopilot.guidance import Guidance, LawStep, Observation, Recalling
from autopilot.response import Piece
from harness.knowledge import heading_in, turned
from harness.log import LOOP_COLUMNS
from harness.plants.level import Motion, Move, States, carried, level_state
from harness.plants.state import State
from harness.world.target import Leg, TargetState

COMPLETED, TARGET_LOST, UNUSUAL, NOT_FLYING = range(4)  # how it ended; unusual: the flight is left to Python
_TARGET = 1 + len(State._fields)  # the first column of the target
_GUIDANCE = _TARGET + len(TargetState._fields)
assert len(LOOP_COLUMNS) == _GUIDANCE + 6

Look = Callable[..., tuple[int, float, Any]]
Step = Callable[[Motion, States, float, float, int, Any], tuple[Motion, States]]


def at_once(move: Move) -> Step:
    """A plant without memory."""

    def step(now: Motion, states: States, rate: float, length: float, part: int, line: Any) -> tuple[Motion, States]:
        return move(now, rate, length), states

    return step


def in_pieces(
    commanded: Callable[[float], float],
    piece: Callable[[Motion, States, float, Piece], tuple[Motion, States]],
    ended: Callable[[Motion, States, float, float], Motion],
) -> Step:
    """A plant behind a delay: `line` says which pieces each part has, and which command acts in each."""

    def step(now: Motion, states: States, rate: float, length: float, part: int, line: Any) -> tuple[Motion, States]:
        given_so_far, begins, sources, kinds, lengths, outputs, integrals, ends, airspeeds = line
        given = commanded(rate)
        given_so_far[part] = given
        acts = 0.0
        for i in range(begins[part], begins[part + 1]):
            acts = given_so_far[sources[i]] if sources[i] >= 0 else 0.0
            p = kinds[i]
            rows = Piece(lengths[p], outputs[p], integrals[p], ends[p], airspeeds[p])
            now, states = piece(now, states, acts, rows)
        return ended(now, states, acts, given), states

    return step


def moving(at: Callable[[Leg, float], TargetState]) -> Callable[..., Any]:
    """A target that moves in legs, at each row."""

    def fill(rows: Any, legs: Any, period: float) -> Any:
        """Fills the rows with the fields of `TargetState`; `legs` has the fields of a `Leg` in each row."""
        i = 0
        for k in range(len(rows)):
            time = k * period
            while i + 1 < len(legs) and legs[i + 1, 0] <= time:
                i += 1
            leg = Leg(legs[i, 0], legs[i, 1], legs[i, 2], legs[i, 3], legs[i, 4], legs[i, 5], legs[i, 6])
            state = at(leg, time)
            for j in range(6):
                rows[k, j] = state[j]

    return fill


def forgetting(law: LawStep) -> Recalling[Any]:
    """A law without memory."""

    def step(seen: Observation, memory: Any) -> tuple[Guidance, Any]:
        return law(seen), memory

    return step


def looking(law: Recalling[Any]) -> Look:
    """What is done at the beginning of a period: the law sees, answers, and the row is written."""

    def look(
        table: Any, target: Any, estimate: Any, noise: Any, told: Any, k: int, state: State, known: Any, memory: Any
    ) -> Any:
        """How the flight ended, the command, and the law's memory; `known` is what of a flight does not change."""
        period, nominal_airspeed, W_x, W_y, scale, monitoring_range = known
        time = k * period
        v_a, psi, v_x, v_y = state.airspeed, state.heading, state.velocity_north, state.velocity_east
        if scale != 1.0:
            v_a = scale * v_a
        if len(noise):
            v_x, v_y = turned(v_x, v_y, noise[k])
            psi = heading_in((W_x, W_y), v_x, v_y)
        if state.wind_north != W_x or state.wind_east != W_y:
            psi = heading_in((W_x, W_y), v_x, v_y)
        seen = Observation(
            state.north, state.east, v_x, v_y, v_a, psi, state.heading_rate, state.bank, state.roll_rate,
            nominal_airspeed, W_x, W_y, estimate[k, 0], estimate[k, 1], estimate[k, 2], estimate[k, 3],
            estimate[k, 4], estimate[k, 5], time,
        )  # fmt: skip
        guidance, memory = law(seen, memory)
        if not math.isfinite(guidance.heading_rate):
            return UNUSUAL, 0.0, memory
        table[k, 0] = time
        for i in range(len(state)):
            table[k, 1 + i] = state[i]
        for i in range(6):
            table[k, _TARGET + i] = target[k, i]
        table[k, _GUIDANCE] = guidance.heading_rate
        table[k, _GUIDANCE + 1] = guidance.range_error
        table[k, _GUIDANCE + 2] = guidance.sliding_variable
        table[k, _GUIDANCE + 3] = guidance.heading_error
        table[k, _GUIDANCE + 4] = guidance.feed_forward
        table[k, _GUIDANCE + 5] = guidance.unlimited_command
        for i in range(6, len(guidance)):
            told[k, i - 6] = guidance[i]
        x_r, y_r = state.north - target[k, 0], state.east - target[k, 1]
        if monitoring_range < math.inf and math.hypot(x_r, y_r) > monitoring_range:
            return TARGET_LOST, 0.0, memory
        return COMPLETED, guidance.heading_rate, memory

    return look


def flown(look: Look, step: Step) -> Callable[..., Any]:
    """The loop with a law that looks, and this plant."""

    def fly(
        table: Any, target: Any, estimate: Any, noise: Any, told: Any, air: Any, drift: Any, late: Any, line: Any,
        rows: Any, altitude: float, known: Any, now: Any, states: States, memory: Any,
    ) -> Any:  # fmt: skip
        """Fills the rows of the table from `first` on, until `end`; a flight ends with the row `last`.

        `late` is a place for the commands, the number of periods by which they are late, and the lengths of the parts
        of a period, s: a period has two where the next command arrives within it. Returns how it ended, the number of
        rows that are filled, and from what it goes on.
        """
        first, end, last = rows
        commands, whole, parts = late
        x, y, v_a, psi, rate, bank, roll_rate, bank_command = now
        moved = Motion(x, y, v_a, psi, rate, bank, roll_rate, bank_command)
        for k in range(first, end):
            state = level_state(moved, altitude, air[k, 0], air[k, 1], air[k, 2])
            ended, command, memory = look(table, target, estimate, noise, told, k, state, known, memory)
            if ended != COMPLETED:
                return ended, k + 1, now, states, memory
            if k < last:
                commands[k] = command
                for i in range(len(parts)):
                    given, part = k - whole - (len(parts) - 1 - i), k * len(parts) + i
                    rate = commands[given] if given >= 0 else 0.0
                    moved, states = step(moved, states, rate, parts[i], part, line)
                    moved = carried(moved, drift[part, 0], drift[part, 1])
                x, y, v_a, psi, rate, bank, roll_rate, bank_command = moved
                now = (x, y, v_a, psi, rate, bank, roll_rate, bank_command)
        return COMPLETED, end, now, states, memory

    return fly
