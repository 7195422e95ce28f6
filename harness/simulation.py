"""The one loop: target, observation, guidance law, plant."""

import math
from array import array

import numpy as np

from autopilot.guidance import Guidance, Observation, Step
from harness.flight import Flight, plant_of, problems
from harness.flight_log import COLUMNS, FlightLog
from harness.plant import End, Outcome
from harness.state import State
from harness.target import TargetState


def simulate(flight: Flight) -> FlightLog:
    """Flies the flight. ValueError (`PlantError` from the plant) when it cannot start; once started it always ends in a log."""
    for problem in problems(flight):
        raise ValueError(f"{problem.name}: {problem.message}")
    target = flight.target.start()
    law = flight.law.start()
    flying = plant_of(flight).start(flight.start, flight.wind)
    period, last = flight.guidance_period, flight.periods
    rows = array("d")
    outcome, reason = Outcome.COMPLETED, ""
    try:
        for k in range(last + 1):
            state = flying.state
            seen = target(k * period)
            guidance = _command(law, _observe(flight, state, seen))
            rows.extend((k * period, *state, *seen, *guidance))
            _keep_in_sight(flight, guidance.range_error)
            if k < last:
                flying.advance(guidance.heading_rate, period)
    except End as end:
        outcome, reason = end.outcome, str(end)
    return FlightLog(flight, outcome, reason, np.frombuffer(rows).reshape(-1, len(COLUMNS)))


def _observe(flight: Flight, state: State, seen: TargetState) -> Observation:
    start = flight.start
    return Observation(
        state.north, state.east, state.velocity_north, state.velocity_east, state.airspeed, start.airspeed,
        state.heading, state.heading_rate, state.bank, state.roll_rate, *flight.wind.steady, *seen,
    )  # fmt: skip


def _command(law: Step, observation: Observation) -> Guidance:
    try:
        guidance = law(observation)
    except Exception as error:
        raise End(Outcome.INVALID, f"the law raised {type(error).__name__}: {error}") from error
    if not math.isfinite(guidance.heading_rate):
        raise End(Outcome.INVALID, f"the law commanded {guidance.heading_rate}")
    return guidance


def _keep_in_sight(flight: Flight, range_error: float) -> None:
    limit = flight.metrics.monitoring_range
    if limit is not None and range_error + flight.law.standoff > limit:
        raise End(Outcome.TARGET_LOST, f"the target is beyond the monitoring range, {limit:g} m")
