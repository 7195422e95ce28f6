"""What is predicted of a flight as numbers by name, for tables of results and for requirements."""

import math
from collections.abc import Callable, Collection, Mapping
from types import MappingProxyType

import aircraft
from autopilot.guidance import uses_response
from harness.error import HarnessError
from harness.flight import Flight
from harness.limit_cycle.margin import Following, following
from harness.limit_cycle.prediction import LimitCycle
from harness.plants.identified import is_stale
from harness.plants.ladder import PLANTS


def _known(found: Following) -> LimitCycle | None:
    """The predicted limit cycle, where its numbers are known."""
    return found.cycle if found.cycle and found.cycle.is_known else None


MARGIN = "limit_cycle_margin"
LARGEST = 99.0  # a margin beyond it is written as this: it decides nothing more

_OF_CYCLE = frozenset({"predicted_cycle_hz", "predicted_cycle_amplitude_deg_s"})
PREDICTED: Mapping[str, Callable[[Following], float | None]] = MappingProxyType(
    {
        "heading_rate_gain_slow": lambda found: found.low_frequency_gain,
        "heading_rate_delay_s": lambda found: found.crossover_delay,
        MARGIN: lambda found: None if found.margin is None else min(found.margin, LARGEST),
        "predicted_cycle_hz": lambda found: cycle.frequency if (cycle := _known(found)) else None,
        "predicted_cycle_amplitude_deg_s": lambda found: (
            math.degrees(cycle.heading_rate) if (cycle := _known(found)) else None
        ),
    }
)


def predicted(flight: Flight, names: Collection[str] = tuple(PREDICTED)) -> dict[str, float | None]:
    """The numbers of `PREDICTED` with these names; None where unknown, and of a limit cycle where there is none.

    Without those of the limit cycle it takes a quarter of the time.
    """
    reason = _why_not(flight)
    found = Following(reason=reason) if reason else following(flight, cycle=not _OF_CYCLE.isdisjoint(names))
    return {name: PREDICTED[name](found) for name in names}


def predicted_margin(flight: Flight) -> float | None:
    """The one of `MARGIN` alone."""
    return predicted(flight, (MARGIN,))[MARGIN]


def why_unknown(flight: Flight) -> str:
    """Why the margin to the limit cycle is unknown; empty where it is known."""
    return _why_not(flight) or following(flight, cycle=False).reason


def unforeseen(flight: Flight) -> str:
    """The active errors of the flight that the prediction does not model, in a sentence; empty where there is none."""
    misled = flight.errors.response_speed != 1.0 and uses_response(flight.law)
    left_out = [*flight.errors.of_loop, *(["response_speed"] if misled else [])]
    return f"the prediction leaves out {', '.join(f'errors.{name}' for name in left_out)}" if left_out else ""


def _why_not(flight: Flight) -> str:
    """What keeps from asking for a prediction; empty when nothing does."""
    if reason := unforeseen(flight):
        return reason
    if not PLANTS[flight.plant].has_airframe:
        return f"the plant {flight.plant} has no airframe"
    try:
        stale = is_stale(aircraft.folder(flight.aircraft))
    except (HarnessError, OSError) as error:
        return str(error)
    return f"the model of {flight.aircraft} has changed since it was identified" if stale else ""
