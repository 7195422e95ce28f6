"""Which engine flies the flights of a run: Python, or compiled loops where that can be and is worth it."""

from collections.abc import Mapping
from typing import NamedTuple

from harness.checks import model_of_another
from harness.compiled.engine import why_plain
from harness.compiled.kernel import is_installed
from harness.error import HarnessError
from harness.flight import Flight
from harness.plants.ladder import PLANTS
from harness.runs.survey import Survey
from harness.settings.laws import kind_of_class, short, source_of

ENGINES = ("python", "compiled")
WORTH = 20.0  # s that are saved, in one process: a loop is compiled in some seconds
_OF_BODY = 0.07  # share of a 6-DOF flight's time that is saved; of the others nearly all


class EngineError(HarnessError):
    """The flights cannot be flown by the requested engine; the message gives the reason."""


class Engine(NamedTuple):
    """The engine of a run."""

    compiled: bool  # where a flight can be compiled
    notes: tuple[str, ...] = ()  # on the user-defined laws that Python flies


def engine_for(size: Survey, asked: str | None, times: float = 1.0) -> Engine:
    """The requested engine, or else the faster one; `times`: how often the flights are flown.

    What is compiled now the workers find on the disk. Raises `EngineError`.
    """
    if asked == "python" or not size.flights:
        return Engine(False)
    if asked is None and not (is_installed() and times * _saved(size.typical) >= WORTH):
        return Engine(False)
    compiled, notes = False, []
    for flight in size.examples.values():
        if model_of_another(flight):  # it may end the process that flies it, which is the workers' business
            compiled |= asked is not None
            continue
        why = why_plain(flight)
        if why and asked:
            raise EngineError(f"--engine compiled: {_named(flight)} on {flight.plant}: {why}")
        if why and source_of(flight.law):
            notes.append(f"{_named(flight)} on {flight.plant} is not compiled: {why}")
        compiled |= not why
    return Engine(compiled, tuple(notes) if compiled or asked is None else ())


def _saved(typical: Mapping[str, float]) -> float:
    """The time that compiled loops may save, s, of what the flights of each plant take in Python."""
    return sum(seconds * (_OF_BODY if PLANTS[plant].has_body else 1.0) for plant, seconds in typical.items())


def _named(flight: Flight) -> str:
    known = kind_of_class(type(flight.law))
    return f"the law {short(known[0]) if known else type(flight.law).__name__}"
