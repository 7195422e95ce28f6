"""All that `harness reproduce` computes, in parts that any number of processes may share."""

import os
from collections.abc import Callable, Mapping
from functools import partial
from typing import NamedTuple

from harness.pool import computed
from harness.studies.paper.claims import CLAIMS
from harness.studies.paper.columns import COLUMNS, GRID, Column
from harness.studies.paper.decision import Decision
from harness.studies.paper.experiments import EXPERIMENTS, flight, flown
from harness.studies.paper.figures import LAWS_DRAWN, Sketch, sketch
from harness.studies.paper.ledger import Decisions, FlownClaim, decided
from harness.studies.paper.reproduce import Number, Reproduced, by_flight, in_order, reproduced

Sketches = Mapping[tuple[str, str], Sketch]  # by experiment and law


class Reproduction(NamedTuple):
    """Some of what is computed, or all of it."""

    numbers: list[Reproduced]
    sketches: Sketches
    decisions: Decisions


Job = Callable[[], Reproduction]


def jobs(*, airframes: bool) -> list[Job]:
    """What there is to compute, the longest first; with the airframes if they are asked for."""
    flown = [title for title, claims in CLAIMS.items() if any(isinstance(claim, FlownClaim) for claim in claims)]
    sections = sorted(flown, key=lambda title: title.startswith("4"), reverse=True)
    return [
        *(partial(_numbers, numbers) for numbers in reversed(by_flight())),
        *(flown_claims(title, column) for title in sections for column in COLUMNS),
        *(flown_claims(title, column) for title in sections for column in GRID if airframes),
        *(partial(_sketched, experiment, law) for experiment in EXPERIMENTS for law in LAWS_DRAWN),
        theory,
    ]


def _numbers(numbers: tuple[Number, ...]) -> Reproduction:
    return Reproduction(reproduced(numbers), {}, {})


def _sketched(experiment: str, law: str) -> Reproduction:
    return Reproduction([], {(experiment, law): sketch(flown(flight(experiment, law)))}, {})


def flown_claims(title: str, column: Column) -> Job:
    """What flights decide of a section, in a column."""
    return partial(_decided, title, column)


def _decided(title: str, column: Column) -> Reproduction:
    return Reproduction([], {}, decided(CLAIMS[title], column))


def theory() -> Reproduction:
    """What formulas decide."""
    return Reproduction([], {}, decided([claim for claims in CLAIMS.values() for claim in claims], None))


def everything(todo: list[Job], workers: int, done: Callable[[], None] = lambda: None) -> Reproduction:
    """The parts of these jobs together, the same for any number of workers; `done` is called after each."""
    numbers: list[Reproduced] = []
    sketches: dict[tuple[str, str], Sketch] = {}
    decisions: dict[tuple[str, str], Decision] = {}
    for part in computed(todo, workers):
        numbers += part.numbers
        sketches.update(part.sketches)
        decisions.update(part.decisions)
        done()
    return Reproduction(in_order(numbers), sketches, decisions)


def workers() -> int:
    """Two, or what the machine has."""
    return min(2, os.cpu_count() or 1)
