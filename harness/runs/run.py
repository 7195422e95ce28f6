"""A run: flies the flights of a matrix that are not done yet and keeps their rows in a store."""

import time
import warnings
from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from harness.key import Identity, files, identity, version_of
from harness.plants.plant import Outcome
from harness.provenance import decided_bits, decides_bits, differences, provenance
from harness.runs.cluster import Cluster
from harness.runs.journal import JOURNAL, reading
from harness.runs.matrix import Matrix
from harness.runs.recordings import lacks_recording, recording_path
from harness.runs.row import row
from harness.runs.store import Store, examples, positions
from harness.runs.wall_time import TimeLeft, WallTime
from harness.runs.workers import TIMEOUT, Done, Fly, Task, WorkersError, fly_all, fly_task
from harness.settings import SettingsError, flight_from_document
from harness.settings.laws import is_unchanged

RECORDED = 50  # flights: a run of at most so many records all of them, a larger run a sample of this size
LOGS = ("all", "sample", "failed", "none")


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """How a matrix is flown. No option changes a result."""

    workers: int
    limit: int | None = None  # fly only so many flights, the first of the matrix
    log: str | None = None  # one of LOGS; None: all of up to `RECORDED` flights, otherwise a sample
    retry_failed: bool = False
    timeout: float = TIMEOUT  # s of a worker's own time in which a flight gains no simulated time
    typical: Mapping[str, float] = field(default_factory=dict)  # s: wall time of the flights to fly, by plant
    compiled: bool = False  # flown by compiled loops where that can be
    fly: Fly = fly_task
    cluster: Cluster | None = None  # whose workers fly, in place of processes of this machine


@dataclass(slots=True)
class Progress:
    """The progress of a run. Counts are of flights."""

    total: int
    earlier: int = 0  # done by an earlier run
    done: int = 0  # by this run, failed ones included
    failed: int = 0  # by this run or an earlier one
    repeated: int = 0  # the same as another flight of the matrix; not in `total`
    out: int = 0  # sent to the workers and not back
    recorded: int = 0  # of the earlier ones: flown again for a recording that is missing
    unrecorded: list[str] = field(default_factory=list)  # what went wrong, for each recording that is missing
    seconds: float = 0.0  # since the first flight was sent out
    left: float | None = None  # estimated time until the end, s; None while it is unknown
    note: str = ""  # a remark beside the counts


def run(matrix: Matrix, folder: Path, options: Options) -> Iterator[Progress]:
    """Flies the flights that are not done yet, and yields the progress at least a few times a second.

    The flights of `matrix` have been checked. Finished flights are kept, however the run ends. Raises `StoreError`,
    `WorkersError`, and `SettingsError` for a draft with mistakes.
    """
    if matrix.mistakes:
        raise SettingsError(matrix.mistakes)
    with Store(folder) as store:
        warn_of_flights_from_elsewhere(store)
        experiment = matrix.experiment
        store.begin(provenance(matrix.file.path, matrix.file.text, experiment.title, experiment.question))
        count = len(matrix)
        progress = Progress(count if options.limit is None else min(count, options.limit))
        pending: dict[str, Pending] = {}
        time_left = TimeLeft(options.typical, options.workers)
        tasks = _tasks(matrix, store, options, progress, pending, time_left)
        for _ in flown(tasks, store, options, progress, pending, time_left):
            yield progress
        store.end()
        yield progress


def flown(
    tasks: Iterator[Task | None],
    store: Store,
    options: Options,
    progress: Progress,
    pending: "dict[str, Pending]",
    time_left: TimeLeft,
) -> Iterator[Done | None]:
    """Flies the tasks, each entered in `pending` by its key, and keeps and counts them: see `fly_all`."""
    flying = _flying(tasks, store.folder, options)
    begin = time.monotonic()
    try:
        for done in flying:
            now = time.monotonic() - begin
            if done is not None:
                _keep(store, done, pending.pop(done.task.key), progress)
                time_left.learn(done.task.flight, done.result.result.seconds, now)
            store.tick()
            progress.out, progress.seconds, progress.left = len(pending), now, time_left.seconds(now)
            yield done
    finally:
        flying.close()


def _flying(tasks: Iterator[Task | None], folder: Path, options: Options) -> Generator[Done | None]:
    if options.cluster:
        seconds = sum(options.typical.values())
        return options.cluster.fly_all(tasks, folder, wall_time=WallTime(), timeout=options.timeout, seconds=seconds)
    return fly_all(
        tasks, folder, workers=options.workers, wall_time=WallTime(), timeout=options.timeout, fly=options.fly
    )


def warn_of_flights_from_elsewhere(store: Store) -> None:
    """Once: the run that begins now is the latest the next time."""
    earlier = store.latest_run()
    if earlier and (apart := list(differences(decided_bits(earlier), decides_bits()))):
        warnings.warn(
            f"{store.folder}: its flights were flown elsewhere ({'; '.join(apart)}), and those flown here may differ "
            "from them in the last bits: `harness doctor` says by how much",
            stacklevel=1,
        )


class Pending(NamedTuple):
    """A flight that was sent out."""

    identity: Identity
    earlier: Outcome | None  # how it ended when its row was made: it is flown again for its recording


def _keep(store: Store, done: Done, pending: Pending, progress: Progress) -> None:
    task, (result, version, problem) = done
    outcome = Outcome(result.outcome)
    if version != task.version:
        raise WorkersError(
            "a law, an airframe or a track has changed during the run: run the same command again, in a notebook after "
            "a restart of its kernel"
        )
    if problem or (pending.earlier and outcome.failed):
        progress.unrecorded.append(problem or f"{recording_path(store.folder, task.key)}: {outcome}: {result.reason}")
    if pending.earlier:
        progress.recorded += 1
        _count_earlier(progress, pending.earlier)
        return
    store.add_version(pending.identity.version, files(task.flight))
    store.add(row(task.flight, pending.identity, result), result, version, task.position)
    progress.done += 1
    progress.failed += outcome.failed


def _count_earlier(progress: Progress, outcome: Outcome) -> None:
    progress.earlier += 1
    progress.failed += outcome.failed


def _tasks(
    matrix: Matrix,
    store: Store,
    options: Options,
    progress: Progress,
    pending: dict[str, Pending],
    time_left: TimeLeft,
) -> Iterator[Task]:
    """The flights that are not done yet or lack their recording, one at a time, each entered in `pending`."""
    number = matrix.identifier
    finished = positions_done(matrix, store.folder, retry_failed=options.retry_failed)
    known = store.done(retry_failed=options.retry_failed)
    recorded = _recorded(matrix, options, progress.total)
    met: set[str] = set()
    left = progress.total
    for position in range(matrix.positions):
        if not left:
            return
        record, key, this = recorded(position), finished.get(position), None
        if key is None or lacks_recording(store.folder, key, record, known[key]):
            combination = matrix.at(position)
            if combination is None:
                continue
            flight = matrix.flight(combination)
            this = identity(flight)
            key = this.key
            store.place(number, position, key)
        left -= 1
        earlier = known.get(key)
        if key in met:
            progress.repeated, progress.total = progress.repeated + 1, progress.total - 1
            if this:
                time_left.leave_out(flight)
        elif earlier and not (this and lacks_recording(store.folder, key, record, earlier)):
            _count_earlier(progress, earlier)
        elif this:
            pending[key] = Pending(this, earlier)
            yield Task(key, position, flight, this.version.number, record, options.compiled)
        met.add(key)


def positions_done(matrix: Matrix, folder: Path, *, retry_failed: bool) -> Mapping[int, str]:
    """The key of each flight of the matrix that is done with today's code and files, by its position.

    They are read from the store, without expanding the matrix. Raises `StoreError`.
    """
    if not (folder / JOURNAL).exists():
        return {}
    with reading(folder) as journal:
        current = []
        for version, decides, settings in examples(journal):
            try:
                is_unchanged(settings, decides["content"])
                now = version_of(flight_from_document(settings))
            except (SettingsError, OSError):
                continue  # its files are gone
            if now.number == version:
                current.append(version)
        done = positions(journal, matrix.identifier, current, retry_failed=retry_failed)
    return {position: key for position, key in done.items() if matrix.has(position)}


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
