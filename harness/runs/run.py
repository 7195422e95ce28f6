"""A run: flies the flights of a matrix that are not done yet and keeps their rows in a store."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from harness.key import Identity, files, identity, version_of
from harness.plants.plant import Outcome
from harness.provenance import provenance
from harness.runs.matrix import Matrix
from harness.runs.row import row
from harness.runs.store import JOURNAL, Store, examples, positions, reading
from harness.runs.wall_time import WallTime
from harness.runs.workers import Done, Fly, Task, WorkersError, fly_all, fly_task
from harness.settings import SettingsError, flight_from_document

RECORDED = 50  # flights: a run of at most so many records all of them, a larger run a sample of this size
LOGS = ("all", "sample", "failed", "none")


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """How a matrix is flown. No option changes a result."""

    workers: int
    limit: int | None = None  # fly only so many flights, the first of the matrix
    log: str | None = None  # one of LOGS; None: all of up to `RECORDED` flights, otherwise a sample
    retry_failed: bool = False
    timeout: float | None = None  # s per flight; None: 20 times the expected wall time
    fly: Fly = fly_task


@dataclass(slots=True)
class Progress:
    """The progress of a run. Counts are of flights."""

    total: int
    earlier: int = 0  # done by an earlier run
    done: int = 0  # by this run, failed ones included
    failed: int = 0
    out: int = 0  # sent to the workers and not back
    reasons: dict[str, int] = field(default_factory=dict)  # of failures, with their counts
    recordings: list[str] = field(default_factory=list)  # what went wrong in writing them
    seconds: float = 0.0  # since the first flight was sent out
    ahead: float = 0.0  # estimated time of one worker for the flights left, s


def run(matrix: Matrix, folder: Path, options: Options) -> Iterator[Progress]:
    """Flies the flights that are not done yet, and yields the progress at least a few times a second.

    The flights of `matrix` have been checked. Finished flights are kept, however the run ends. Raises `StoreError`,
    `WorkersError`, and `SettingsError` for a draft with mistakes.
    """
    if matrix.mistakes:
        raise SettingsError(matrix.mistakes)
    with Store(folder) as store:
        experiment = matrix.experiment
        store.begin(provenance(matrix.file.path, matrix.file.text, experiment.title, experiment.question))
        count = len(matrix)
        progress = Progress(count if options.limit is None else min(count, options.limit))
        pending: dict[str, Identity] = {}
        wall_time = WallTime()
        tasks = _tasks(matrix, store, options, progress, pending)
        flying = fly_all(
            tasks, folder, workers=options.workers, wall_time=wall_time, timeout=options.timeout, fly=options.fly
        )
        begin = time.monotonic()
        try:
            for done in flying:
                if done is not None:
                    _keep(store, done, pending.pop(done.task.key), progress)
                store.tick()
                progress.out, progress.seconds = len(pending), time.monotonic() - begin
                yield progress
        finally:
            flying.close()
        store.end()
        yield progress


def _keep(store: Store, done: Done, identity: Identity, progress: Progress) -> None:
    task, (result, version, problem) = done
    if version != task.version:
        raise WorkersError(
            "a law, an airframe or a track has changed during the run: run the same command again, in a notebook after "
            "a restart of its kernel"
        )
    if problem:
        progress.recordings.append(problem)
    store.add_version(identity.version, files(task.flight))
    store.add(row(task.flight, identity, result), result, version, task.position)
    progress.done += 1
    if Outcome(result.outcome).failed:
        progress.failed += 1
        reason = f"{result.outcome}: {result.reason}"
        progress.reasons[reason] = progress.reasons.get(reason, 0) + 1


def _tasks(
    matrix: Matrix, store: Store, options: Options, progress: Progress, pending: dict[str, Identity]
) -> Iterator[Task]:
    """The flights that are not done yet, one at a time, each entered in `pending`."""
    number = matrix.identifier
    finished = positions_done(matrix, store.folder, retry_failed=options.retry_failed)
    known = store.keys(failed=not options.retry_failed)
    recorded = _recorded(matrix, options, progress.total)
    flights = 0
    for position in range(matrix.positions):
        if flights >= progress.total:
            return
        if position in finished:
            flights += 1
            progress.earlier += 1
            continue
        combination = matrix.at(position)
        if combination is None:
            continue
        flights += 1
        flight = matrix.flight(combination)
        this = identity(flight)
        store.place(number, position, this.key)
        if this.key in known:
            progress.earlier += 1
            continue
        known.add(this.key)
        pending[this.key] = this
        yield Task(this.key, position, flight, this.version.number, recorded(position))


def positions_done(matrix: Matrix, folder: Path, *, retry_failed: bool) -> frozenset[int]:
    """The positions of the matrix whose flights are done with today's code and files.

    They are read from the store, without expanding the matrix. Raises `StoreError`.
    """
    if not (folder / JOURNAL).exists():
        return frozenset()
    with reading(folder) as journal:
        current = []
        for version, settings in examples(journal):
            try:
                now = version_of(flight_from_document(settings))
            except (SettingsError, OSError):
                continue  # its files are gone
            if now.number == version:
                current.append(version)
        return frozenset(positions(journal, matrix.identifier, current, failed=not retry_failed))


def _recorded(matrix: Matrix, options: Options, total: int) -> Callable[[int], str]:
    """A function from a position to when its flight is recorded: all | failed | none.

    A sample consists of complete groups of flights that differ in the plant alone, evenly spread over the matrix.
    """
    log = options.log or ("all" if total <= RECORDED else "sample")
    if log != "sample":
        return lambda position: log
    plants = max((len(a) for block in matrix.blocks for a in block.axes if a.keys == ("plant",)), default=1)
    groups, wanted = -(-total // plants), max(1, RECORDED // plants)
    stride = -(-groups // wanted)
    return lambda position: "all" if matrix.group(position) % stride == 0 else "none"
