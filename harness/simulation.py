"""The one loop: target, observation, guidance law, plant."""

import math
from struct import Struct

import numpy as np

from autopilot.guidance import Guidance, Observation, Step
from harness.flight import Flight, plant_of, problems
from harness.flight_log import COLUMNS, FlightLog
from harness.plant import End, Outcome
from harness.state import State
from harness.target import TargetState

_OWN = Observation._fields.index("nominal_airspeed")  # the first fields of both are the same
assert State._fields[:_OWN] == Observation._fields[:_OWN]


def simulate(flight: Flight) -> FlightLog:
    """Flies the flight: once started it always ends in a log. ValueError, or `PlantError`, when it cannot."""
    for problem in problems(flight):
        raise ValueError(f"{problem.name}: {problem.message}")
    target, law = flight.target.start(), flight.law.start()
    flying = plant_of(flight).start(flight.start, flight.wind)
    period, last = flight.guidance_period, flight.periods
    wind, nominal_airspeed = flight.wind.steady, flight.start.airspeed
    in_sight = (flight.metrics.monitoring_range or math.inf) - flight.law.standoff
    row = Struct(f"{len(COLUMNS)}d")
    table, rows = bytearray((last + 1) * row.size), 0
    outcome, reason = Outcome.COMPLETED, ""
    try:
        for k in range(last + 1):
            state, seen = flying.state, target(k * period)
            guidance = command(law, observe(state, nominal_airspeed, wind, seen))
            row.pack_into(table, rows * row.size, k * period, *state, *seen, *guidance)
            rows += 1
            if guidance.range_error > in_sight:
                raise End(Outcome.TARGET_LOST, f"beyond the monitoring range, {flight.metrics.monitoring_range:g} m")
            if k < last:
                flying.advance(guidance.heading_rate, period)
    except End as end:
        outcome, reason = end.outcome, str(end)
    return FlightLog(flight, outcome, reason, np.frombuffer(table)[: rows * len(COLUMNS)].reshape(rows, -1))


def observe(state: State, nominal_airspeed: float, wind: tuple[float, float], seen: TargetState) -> Observation:
    """What the law gets to know: the aircraft's own state, the steady wind, the target as `seen`."""
    return Observation._make((*state[:_OWN], nominal_airspeed, *wind, *seen))


def command(law: Step, observation: Observation) -> Guidance:
    """The law's answer. Raises `End` when it fails or is not finite: a law's fault is a flight's outcome."""
    try:
        guidance = law(observation)
    except Exception as error:
        raise End(Outcome.INVALID, f"the law raised {type(error).__name__}: {error}") from error
    if not math.isfinite(guidance.heading_rate):
        raise End(Outcome.INVALID, f"the law commanded {guidance.heading_rate}")
    return guidance
