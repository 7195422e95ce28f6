"""All that `harness reproduce` computes, in parts that any number of processes may share."""

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import NamedTuple

from harness.studies.paper.claims import CLAIMS
from harness.studies.paper.columns import COLUMNS, GRID, Column
from harness.studies.paper.experiments import EXPERIMENTS, flight, flown
from harness.studies.paper.figures import LAWS_DRAWN, Sketch, sketch
from harness.studies.paper.ledger import Finding, Findings, Flown, decided
from harness.studies.paper.reproduce import Number, Reproduced, by_flight, in_order, reproduced

Sketches = Mapping[tuple[str, str], Sketch]  # by experiment and law


class Part(NamedTuple):
    """Some of what is computed, or all of it."""

    numbers: list[Reproduced]
    sketches: Sketches
    findings: Findings


Job = Callable[[], Part]


def jobs(*, airframes: bool) -> list[Job]:
    """What there is to compute, the longest first; with the airframes if they are asked for."""
    flown = [title for title, claims in CLAIMS.items() if any(isinstance(claim, Flown) for claim in claims)]
    sections = sorted(flown, key=lambda title: title.startswith("4"), reverse=True)
    return [
        *(partial(_numbers, numbers) for numbers in reversed(by_flight())),
        *(flown_claims(title, column) for title in sections for column in COLUMNS),
        *(flown_claims(title, column) for title in sections for column in GRID if airframes),
        *(partial(_sketched, experiment, law) for experiment in EXPERIMENTS for law in LAWS_DRAWN),
        theory,
    ]


def _numbers(numbers: tuple[Number, ...]) -> Part:
    return Part(reproduced(numbers), {}, {})


def _sketched(experiment: str, law: str) -> Part:
    return Part([], {(experiment, law): sketch(flown(flight(experiment, law)))}, {})


def flown_claims(title: str, column: Column) -> Job:
    """What flights decide of a section, in a column."""
    return partial(_decided, title, column)


def _decided(title: str, column: Column) -> Part:
    return Part([], {}, decided(CLAIMS[title], column))


def theory() -> Part:
    """What formulas decide."""
    return Part([], {}, decided([claim for claims in CLAIMS.values() for claim in claims], None))


def everything(todo: list[Job], workers: int, done: Callable[[], None] = lambda: None) -> Part:
    """The parts of these jobs together, the same for any number of workers; `done` is called after each."""
    numbers: list[Reproduced] = []
    sketches: dict[tuple[str, str], Sketch] = {}
    findings: dict[tuple[str, str], Finding] = {}
    for part in computed(todo, workers):
        numbers += part.numbers
        sketches.update(part.sketches)
        findings.update(part.findings)
        done()
    return Part(in_order(numbers), sketches, findings)


def computed(todo: list[Job], workers: int) -> Iterator[Part]:
    """The parts of these jobs, in any order."""
    if workers == 1:
        yield from (job() for job in todo)
        return
    heard = signal.signal(signal.SIGINT, signal.SIG_IGN)  # what the workers inherit: their parent ends them
    pool = multiprocessing.get_context("spawn").Pool(workers)
    signal.signal(signal.SIGINT, heard)
    with pool:
        yield from pool.imap_unordered(_done, todo)


def _done(job: Job) -> Part:
    return job()


def workers() -> int:
    """Two, or what the machine has."""
    return min(2, os.cpu_count() or 1)
