"""The check of a user-defined law: finite, limited, mirrored, reproducible, and independent between flights."""

import ast
import math
import pickle
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from autopilot.guidance import Guidance, Law, Observation, started
from autopilot.standoff import mirrored
from harness.flight import Flight, context_of
from harness.limit_cycle.linear import has_memory
from harness.limit_cycle.prediction import Loop
from harness.loop import simulate
from harness.plants.identified import identified
from harness.plants.plant import End
from harness.settings import document, flight_from_document
from harness.settings.tried import SLOW, TRIED_WITHIN, answers, cost, observations, within

_SEEN, _FEW = 200, 60  # numbers of observations of a check
_SAME = 1e-9  # rad/s: tolerance of equal commands


class Found(NamedTuple):
    """An answer to a question that was put to a law."""

    question: str
    is_right: bool
    text: str


def classes(file: Path) -> list[str]:
    """The classes in a file that have a method `start`, else all, found without running it.

    Raises OSError, SyntaxError.
    """
    found = [node for node in ast.parse(file.read_bytes(), str(file)).body if isinstance(node, ast.ClassDef)]
    laws = [node.name for node in found if any(getattr(inner, "name", "") == "start" for inner in node.body)]
    return laws or [node.name for node in found]


def flights(name: str, sets: Sequence[str]) -> dict[str, Flight]:
    """A flight for each gain set of the law, by what it is called; of a law without sets one with its defaults."""
    law: dict[str, object] = {"name": name}
    settings = {"plant": "kinematic", "duration_s": 100.0}
    if not sets:
        return {"": flight_from_document({**settings, "law": law}, run=True)}
    return {gains: flight_from_document({**settings, "law": {**law, "gains": gains}}, run=True) for gains in sets}


def examined(flight: Flight) -> Iterator[Found]:
    """The answers to all questions, one after the other."""
    for question, asked in _QUESTIONS.items():
        try:
            with within(TRIED_WITHIN):
                text = asked(flight)
        except _Wrong as wrong:
            yield Found(question, False, str(wrong))
        except End as end:
            yield Found(question, False, str(end))
            return  # it would not answer the others either
        except (Exception, SystemExit) as error:
            yield Found(question, False, f"it raised {type(error).__name__}: {error}")
        else:
            yield Found(question, True, text)


class _Wrong(Exception):  # noqa: N818 - no fault of the program
    """The law returns a wrong answer; the message describes it."""


def _finite(flight: Flight) -> str:
    seen = [*observations(flight, _SEEN), *_extreme(flight)]
    step = started(flight.law, context_of(flight))
    for observation in seen:
        answer = step(observation)
        if not isinstance(answer, Guidance):
            raise _Wrong(f"it answers {answer!r}, must be a Guidance")
        if not math.isfinite(answer.heading_rate):
            raise _Wrong(f"it commands {answer.heading_rate} for {_shown(observation)}")
    return f"for {len(seen)} observations, also on the target, far away, and in wind above the airspeed"


def _limited(flight: Flight) -> str:
    if flight.law.command == "course_rate":
        return "not checked: it limits its course rate"
    most = max(abs(a.heading_rate) for a in answers(flight, flight.law, [*observations(flight, _SEEN)]))
    if most > flight.law.max_heading_rate * (1.0 + _SAME):
        raise _Wrong(f"it commands {most:.4g} rad/s, its max_heading_rate is {flight.law.max_heading_rate:.4g} rad/s")
    return f"up to {most:.3g} of {flight.law.max_heading_rate:.3g} rad/s"


def _deterministic(flight: Flight) -> str:
    seen = observations(flight, _FEW)
    _compare(seen, answers(flight, flight.law, seen), answers(flight, flight.law, seen), "started anew it answers")
    return "started twice it answers the same"


def _without_traces(flight: Flight) -> str:
    seen, others = observations(flight, _FEW), observations(flight, _FEW, seed=2)
    alone = answers(flight, flight.law, seen)
    one, other = (started(flight.law, context_of(flight)) for _ in range(2))
    together = []
    for mine, theirs in zip(seen, others, strict=True):
        together.append(one(mine))
        other(theirs)
    _compare(seen, alone, together, "beside another flight it answers")
    return "two simultaneous flights are independent"


def _mirrored(flight: Flight) -> str:
    law: Any = flight.law
    if not hasattr(law, "direction"):
        return "not checked: it has no setting `direction`, and circles in one sense"
    seen = observations(flight, _FEW)
    there: Law = replace(law, direction="mirrored")
    step = mirrored(started(there, context_of(flight)))
    way = "in the mirrored world, with the direction mirrored, it answers"
    _compare(seen, answers(flight, replace(law, direction="paper"), seen), [step(o) for o in seen], way, _SAME)
    return "mirrored in the mirrored world"


def _kept(flight: Flight) -> str:
    again = flight_from_document(document(flight))
    if again != flight:
        raise _Wrong(f"from its settings it is made again as {again.law!r}, it was {flight.law!r}")
    if pickle.loads(pickle.dumps(flight)) != flight:
        raise _Wrong("on the way to a worker it changes")
    return "a file and a worker get the same law"


def _memory(flight: Flight) -> str:
    airspeed = flight.start.airspeed
    response = identified(_folder(flight), airspeed).heading_rate
    if not has_memory(Loop(flight.law, response, airspeed, flight.guidance_period)):
        return "none: `harness predict` evaluates it at any point"
    if hasattr(flight.law, "linearised"):
        return "it has, with a linearisation for `harness predict`"
    return "it has, without a method `linearised`: `harness predict` gives no margin"


def _folder(flight: Flight) -> Path:
    import aircraft

    return aircraft.folder(flight.aircraft)


def _quick(flight: Flight) -> str:
    each = cost(flight)
    text = f"{1e6 * each:.3g} µs for a command, {each * (flight.periods + 1):.2g} s for a flight of 100 s"
    return f"{text}: SLOW" if each > SLOW else text


def _flown(flight: Flight) -> str:
    log = simulate(flight)
    if log.outcome.failed:
        raise _Wrong(f"on the kinematic plant it ends: {log.reason}")
    settled = log.metrics["convergence_time_s"]
    how = "does not settle on its circle in 100 s" if settled is None else f"settles on its circle in {settled:.3g} s"
    return f"on the kinematic plant it {how}"


_QUESTIONS: dict[str, Callable[[Flight], str]] = {
    "finite": _finite,
    "limited": _limited,
    "deterministic": _deterministic,
    "no global state": _without_traces,
    "mirrored": _mirrored,
    "kept": _kept,
    "memory": _memory,
    "time": _quick,
    "flown": _flown,
}


def _extreme(flight: Flight) -> Iterator[Observation]:
    """Observations at the edge of what there may be; each is finite."""
    usual = observations(flight, 1)[0]
    at = {"north": usual.target_north, "east": usual.target_east}
    for change in (
        at,
        {"north": usual.target_north + flight.law.standoff, "east": usual.target_east},
        {"north": 1e7, "east": -1e7},
        {"wind_north": 3.0 * usual.airspeed, "velocity_north": 4.0 * usual.airspeed},
        {"velocity_north": 0.0, "velocity_east": 0.0, "airspeed": 0.0},
        {"target_velocity_north": 5.0 * usual.airspeed, "target_turn_rate": 1.0, "target_acceleration": 5.0},
        {**at, "velocity_north": usual.wind_north, "velocity_east": usual.wind_east},
        {"heading": math.pi, "heading_rate": 1.0, "bank": 1.0, "roll_rate": 3.0},
    ):
        yield usual._replace(**change)


def _compare(
    seen: Sequence[Observation], one: Sequence[Guidance], other: Sequence[Guidance], how: str, tolerance: float = 0.0
) -> None:
    for observation, a, b in zip(seen, one, other, strict=True):
        if not abs(a.heading_rate - b.heading_rate) <= tolerance:
            raise _Wrong(f"{how} {b.heading_rate!r} instead of {a.heading_rate!r} rad/s at {_shown(observation)}")


def _shown(o: Observation) -> str:
    place = f"time {o.time:g} s, {o.north - o.target_north:.4g} m north and {o.east - o.target_east:.4g} m east of it"
    return f"{place}, heading {o.heading:.3g} rad"
