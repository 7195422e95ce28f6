"""Flies the trials of a search in batches: each over all its conditions, and each flight is a row of the store."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from harness.flight import Flight
from harness.key import identity
from harness.provenance import provenance
from harness.requirement import OUTCOME, Facts
from harness.runs.matrix import Matrix
from harness.runs.run import Options, Pending, Progress, flown, warn_of_flights_from_elsewhere
from harness.runs.store import Store
from harness.runs.wall_time import TimeLeft
from harness.runs.workers import Task


@dataclass(slots=True)
class Candidate:
    """Settings that a search tries: a flight for each condition, what is foreseen of it, and what it brought."""

    values: Mapping[str, float]  # by key, in file units
    flights: Sequence[Flight]
    foreseen: Sequence[Facts]  # of each flight
    facts: list[Facts] = field(default_factory=list)  # of each flight, once it is flown
    keys: list[str] = field(default_factory=list)


def fly_search(
    batches: Iterable[Sequence[Candidate]], matrix: Matrix, folder: Path, options: Options, progress: Progress
) -> Iterator[Progress]:
    """Flies the batches of a search over this matrix, whose flights are kept in `folder`: see `fly_batches`.

    What is kept there is not flown again: the same search goes on where it stopped. Raises `StoreError` and
    `WorkersError`.
    """
    file, experiment = matrix.file, matrix.experiment
    with Store(folder) as store:
        warn_of_flights_from_elsewhere(store)
        store.begin(provenance(file.path, file.text, experiment.title, experiment.question))
        yield from fly_batches(batches, store, options, progress)
        store.end()


def fly_batches(
    batches: Iterable[Sequence[Candidate]], store: Store, options: Options, progress: Progress
) -> Iterator[Progress]:
    """Flies one batch after the other, and yields the progress at least a few times a second.

    `batches` is asked for the next batch when every candidate of the last one has its facts. What the store has is not
    flown again. Raises `StoreError` and `WorkersError`.
    """
    waiting: dict[str, list[tuple[Candidate, int]]] = {}
    pending: dict[str, Pending] = {}
    time_left = TimeLeft(options.typical, options.workers)
    tasks = _tasks(batches, store, options, progress, waiting, pending, time_left)
    for done in flown(tasks, store, options, progress, pending, time_left):
        if done is not None:
            result = done.result.result
            for candidate, i in waiting.pop(done.task.key):
                candidate.facts[i] = {**candidate.foreseen[i], **result.metrics, OUTCOME: result.outcome}
        yield progress
    yield progress


def _tasks(
    batches: Iterable[Sequence[Candidate]],
    store: Store,
    options: Options,
    progress: Progress,
    waiting: dict[str, list[tuple[Candidate, int]]],
    pending: dict[str, Pending],
    time_left: TimeLeft,
) -> Iterator[Task | None]:
    position = 0
    for batch in batches:
        for candidate in batch:
            candidate.facts = list(candidate.foreseen)
            for i, flight in enumerate(candidate.flights):
                this = identity(flight)
                candidate.keys.append(this.key)
                position += 1
                if kept := store.found(this.key, retry_failed=options.retry_failed):
                    outcome, metrics = kept
                    progress.earlier += 1
                    progress.failed += outcome.failed
                    time_left.leave_out(flight)
                    candidate.facts[i] = {**candidate.foreseen[i], **metrics, OUTCOME: outcome.value}
                elif this.key in waiting:
                    progress.earlier += 1
                    time_left.leave_out(flight)
                    waiting[this.key].append((candidate, i))
                else:
                    waiting[this.key] = [(candidate, i)]
                    pending[this.key] = Pending(this, None)
                    record = options.log or "none"
                    yield Task(this.key, position - 1, flight, this.version.number, record, options.compiled)
        while waiting:
            yield None
