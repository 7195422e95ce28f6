"""The one loop: target, sensor, estimator, observation, guidance law, plant."""

import math
from collections.abc import Callable
from struct import Struct

import numpy as np

from autopilot.guidance import Guidance, LawStep, Observation
from harness.checks import problems
from harness.flight import Flight, air_of, plant_of
from harness.knowledge import Estimation, told
from harness.log import COLUMNS, LOOP_COLUMNS, SEEN_COLUMNS, FlightLog
from harness.plants.plant import End, Outcome, Plant
from harness.plants.state import State
from harness.world.target import TargetState

_OWN = Observation._fields.index("nominal_airspeed")  # the first fields of both are the same
assert State._fields[:_OWN] == Observation._fields[:_OWN]


Watch = Callable[[float, Callable[[], FlightLog]], None]  # gets the time, s, and how to ask for the log so far


def simulate(flight: Flight, watch: Watch | None = None, *, plant: Plant | None = None) -> FlightLog:
    """Flies the flight: once started it always ends in a log. ValueError, or `PlantError`, when it cannot.

    `watch` is called after each row; it may take its time. A `plant` flies in place of the one that the flight names.
    """
    for problem in problems(flight):
        raise ValueError(f"{problem.name}: {problem.message}")
    target, law = flight.target.start(), flight.law.start()
    estimation = Estimation(flight, target) if flight.estimator.kind == "ekf" else None
    tell = told(flight.estimator)
    flying = (plant or plant_of(flight)).start(flight.start, air_of(flight))
    period, last = flight.guidance_period, flight.periods
    wind, nominal_airspeed = flight.wind.steady, flight.start.airspeed
    monitoring_range = flight.metrics.monitoring_range
    row, stride = Struct(f"{len(LOOP_COLUMNS)}d"), 8 * len(COLUMNS)
    table, rows = bytearray((last + 1) * stride), 0
    outcome, reason = Outcome.COMPLETED, ""

    def so_far() -> FlightLog:
        log = FlightLog(flight, outcome, reason, np.frombuffer(table).reshape(-1, len(COLUMNS))[:rows])
        return completed(log, estimation.rows[:rows] if estimation else None)

    try:
        for k in range(last + 1):
            state, truth = flying.state, target(k * period)
            seen = estimation.at(k) if estimation else tell(truth) if tell else truth
            guidance = command(law, observe(state, nominal_airspeed, wind, seen))
            row.pack_into(table, rows * stride, k * period, *state, *truth, *guidance)
            rows += 1
            if watch:
                watch(k * period, so_far)
            if monitoring_range and math.dist(state[:2], truth[:2]) > monitoring_range:
                raise End(Outcome.TARGET_LOST, f"beyond the monitoring range, {monitoring_range:g} m")
            if k < last:
                flying.advance(guidance.heading_rate, period)
    except End as end:
        outcome, reason = end.outcome, str(end)
    return so_far()


def completed(log: FlightLog, estimates: list[tuple[float, ...]] | None) -> FlightLog:
    """The log with the columns that the loop leaves: true range error, and what was seen of the target (None: all)."""
    x_r, y_r = log["north"] - log["target_north"], log["east"] - log["target_east"]
    log["range_error"][:] = np.sqrt(x_r * x_r + y_r * y_r) - log.flight.law.standoff  # as the laws compute it
    seen = log.table[:, COLUMNS.index(SEEN_COLUMNS[0]) :]
    if estimates is None:
        first = COLUMNS.index(TargetState._fields[0])
        seen[:, :4], seen[:, 4:] = log.table[:, first : first + 4], math.nan
    elif estimates:
        seen[:] = estimates
    return log


def observe(state: State, nominal_airspeed: float, wind: tuple[float, float], seen: TargetState) -> Observation:
    """What the law gets to know: the aircraft's own state, the steady wind, the target as `seen`.

    psi_a is measured alike on every plant, from ground velocity and steady wind. Where gusts blow that is not the
    psi_a of Eq. (1), and a law that saw this one would miss how they carry the aircraft.
    """
    W_x, W_y = wind
    if state.wind_north != W_x or state.wind_east != W_y:
        state = state._replace(heading=math.atan2(state.velocity_east - W_y, state.velocity_north - W_x))
    return Observation._make((*state[:_OWN], nominal_airspeed, *wind, *seen))


def command(law: LawStep, observation: Observation) -> Guidance:
    """The law's answer. Raises `End` when it fails or is not finite: a law's fault is a flight's outcome."""
    try:
        guidance = law(observation)
    except Exception as error:
        raise End(Outcome.INVALID, f"the law raised {type(error).__name__}: {error}") from error
    if not math.isfinite(guidance.heading_rate):
        raise End(Outcome.INVALID, f"the law commanded {guidance.heading_rate}")
    return guidance
