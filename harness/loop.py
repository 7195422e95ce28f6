"""The one loop: target, sensor and estimator, observation, guidance law, plant."""

import math
import struct
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from autopilot.guidance import Context, Guidance, Law, LawStep, Observation, Telling, started
from harness.checks import problems
from harness.feasibility import margins_in_flight
from harness.flight import Flight, air_of, command_delay, context_of, plant_of
from harness.knowledge import Estimation, Instruments, heading_in, perfect_estimator, sighting
from harness.log import COLUMNS, LOOP_COLUMNS, SEEN_COLUMNS, FlightLog
from harness.plants.late import Late
from harness.plants.plant import End, Outcome, Plant
from harness.plants.state import State
from harness.world.target import TargetState

_OWN = Observation._fields.index("nominal_airspeed")  # State and Observation begin with the same fields
assert State._fields[:_OWN] == Observation._fields[:_OWN]

Watch = Callable[[float, Callable[[], FlightLog]], None]  # called with the time, s, and a function for the log so far


def simulate(
    flight: Flight, watch: Watch | None = None, *, plant: Plant | None = None, context: Context | None = None
) -> FlightLog:
    """Flies the flight and returns its log, whatever its outcome.

    `watch` is called after each row of the log and may take its time. `plant` flies in place of the plant that the
    flight names, and `context` is then the law's context. Raises ValueError for settings that contradict each
    other, `PlantError` when the plant cannot start.
    """
    for problem in problems(flight):
        raise ValueError(f"{problem.name}: {problem.message}")
    period, last = flight.guidance_period, flight.periods
    nominal_airspeed, instruments = flight.start.airspeed, Instruments(flight)
    monitoring_range = flight.metrics.monitoring_range

    target = flight.target.start()
    estimation = Estimation(sighting(flight)) if flight.estimator.filters else None
    estimator = estimation.at if estimation else perfect_estimator(flight.estimator)
    known = context or context_of(flight)
    flying = (plant or plant_of(flight)).start(flight.start, air_of(flight))
    if flight.errors.command_delay:
        flying = Late(flying, *command_delay(flight))

    table, rows = bytearray((last + 1) * _ROW_BYTES), 0
    outcome, reason = Outcome.COMPLETED, ""
    told: dict[int, Mapping[str, float]] = {}  # the law's own channels, by row

    def log_so_far() -> FlightLog:
        columns = np.frombuffer(table).reshape(-1, len(COLUMNS))[:rows]
        log = FlightLog(flight, outcome, reason, columns, channels_of(told, rows))
        return completed(log, estimation.rows[:rows] if estimation else None)

    try:
        law = begun(flight.law, known)
        for k in range(last + 1):
            time = k * period
            state, truth = flying.state, target(time)
            estimate = estimator(k, truth)
            observation = observe(instruments.read(state), nominal_airspeed, instruments.wind, estimate, time)
            guidance = command(law, observation)

            _write_row(table, rows * _ROW_BYTES, time, *state, *truth, *guidance)
            if type(guidance) is Telling:
                told[rows] = guidance.channels
            rows += 1
            if watch:
                watch(time, log_so_far)
            if monitoring_range and math.dist(state[:2], truth[:2]) > monitoring_range:
                raise lost(flight)

            if k < last:
                flying.advance(guidance.heading_rate, period)
    except End as end:
        outcome, reason = end.outcome, str(end)
    except struct.error as error:
        outcome, reason = Outcome.INVALID, f"the law answered what is no number: {error}"
    return log_so_far()


def observe(
    state: State, nominal_airspeed: float, wind: tuple[float, float], estimate: TargetState, time: float = 0.0
) -> Observation:
    """The law's observation: the measured state of its aircraft, the estimated steady wind and target. SI, rad.

    Its heading psi_a is measured alike on every plant, as the direction of (ground velocity - estimated wind). In gusts
    this differs from the psi_a of Eq. (1), with which a law would not see the drift by gusts.
    """
    W_x, W_y = wind
    if state.wind_north != W_x or state.wind_east != W_y:
        state = state._replace(heading=heading_in(wind, state.velocity_north, state.velocity_east))
    return Observation._make((*state[:_OWN], nominal_airspeed, *wind, *estimate, time))


def lost(flight: Flight) -> End:
    """The end of a flight whose aircraft is too far from its target."""
    return End(Outcome.TARGET_LOST, f"beyond the monitoring range, {flight.metrics.monitoring_range:g} m")


def begun(law: Law, context: Context) -> LawStep:
    """The law in flight. Raises `End` when it cannot start."""
    try:
        return started(law, context)
    except (Exception, SystemExit) as error:
        raise End(Outcome.INVALID, f"the law cannot start: {type(error).__name__}: {error}") from error


def command(law: LawStep, observation: Observation) -> Guidance:
    """The law's answer. Raises `End` when the law fails or its command is not finite: an outcome of the flight."""
    try:
        guidance = law(observation)
        is_finite = math.isfinite(guidance.heading_rate)
    except End:  # it took too long
        raise
    except (Exception, SystemExit) as error:
        raise End(Outcome.INVALID, f"the law raised {type(error).__name__}: {error}") from error
    if not is_finite:
        raise End(Outcome.INVALID, f"the law commanded {guidance.heading_rate}")
    return guidance


def channels_of(told: Mapping[int, Mapping[str, float]], rows: int) -> dict[str, NDArray[np.float64]]:
    """The law's own channels as columns, (rows,), by the names of a log; NaN if the law did not report one."""
    columns = {f"law_{name}": np.full(rows, math.nan) for channels in told.values() for name in channels}
    for row, channels in told.items():
        if row < rows:
            for name, value in channels.items():
                columns[f"law_{name}"][row] = value
    return columns


def completed(log: FlightLog, estimates: NDArray[np.float64] | None) -> FlightLog:
    """The log with the columns that the loop does not write: range error, margin, and the target as the law saw it.

    `estimates` are the rows of an `Estimation`; None stands for a law that knows the true position and velocity.
    """
    x_r, y_r = log["north"] - log["target_north"], log["east"] - log["target_east"]
    log["range_error"][:] = np.sqrt(x_r * x_r + y_r * y_r) - log.flight.law.standoff  # the arithmetic of the laws
    wind, velocity = (log.table[:, i : i + 2] for i in map(COLUMNS.index, ("wind_north", "target_velocity_north")))
    log["feasibility_margin"][:] = margins_in_flight(log.flight, wind, velocity)
    seen = log.table[:, COLUMNS.index(SEEN_COLUMNS[0]) :]
    if estimates is None:
        first = COLUMNS.index(TargetState._fields[0])
        seen[:, :4], seen[:, 4:] = log.table[:, first : first + 4], math.nan
    elif len(estimates):
        seen[:] = estimates
    return log


_ROW_BYTES = 8 * len(COLUMNS)
_write_row = struct.Struct(f"{len(LOOP_COLUMNS)}d").pack_into  # the fastest way to put a row of floats into the table
