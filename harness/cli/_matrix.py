"""A matrix of flights on the command line: what it holds, how long it takes, its flights flown, and their results."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from harness.cli._input import BadInput
from harness.cli._progress import busy, duration, of_run
from harness.tables import counted

if TYPE_CHECKING:
    from harness.runs.matrix import Matrix
    from harness.runs.run import Options, Progress
    from harness.runs.survey import Survey

_MOST_LINES = 60  # largest number of lines of the table of results
_MOST_REASONS = 5
_MOST_WARNINGS = 10


@contextmanager
def many_flights(workers: int, dask: str | None, retry: str | None, flight_timeout: float | None) -> Iterator[Options]:
    """How flights are flown: in these processes, or on the Dask cluster of a scheduler. Raises `ClusterError`."""
    from harness.runs.run import Options
    from harness.runs.workers import TIMEOUT

    options = Options(workers=workers, retry_failed=retry is not None, timeout=flight_timeout or TIMEOUT)
    if dask is None:
        yield options
        return
    from harness.runs.cluster import connected

    with connected(dask) as cluster:
        click.echo(f"{counted(cluster.workers, 'worker')} at {dask}", err=True)
        yield replace(options, workers=cluster.workers, cluster=cluster)


def processes(workers: int | None, flight_timeout: float | None, dask: str | None = None) -> int:
    """The number of workers: one per processor by default. BadInput for a time limit that cannot be kept."""
    if workers is not None and dask is not None:
        raise BadInput("--workers is for processes of this machine, --dask has workers of its own: leave one out")
    if flight_timeout is not None and not flight_timeout > 0:
        raise BadInput(f"--flight-timeout is {flight_timeout:g}, must be > 0")
    if flight_timeout is not None and workers == 0:
        raise BadInput("--flight-timeout needs a worker to end: --workers must be at least 1")
    return (os.cpu_count() or 1) if workers is None else workers


def surveyed(matrix: Matrix, limit: int | None = None, done: Collection[int] = ()) -> Survey:
    """Checks every flight of the matrix that is not done. Raises `SettingsError`."""
    from rich.console import Console

    from harness.runs.survey import survey

    with Console(stderr=True).status("checking the matrix") as status:
        for size in survey(matrix, limit, done):
            status.update(f"checking the matrix: {size.flights} flights")
    return size


def print_survey(matrix: Matrix, size: Survey, done: int) -> None:
    """The question, the number of flights and what varies; the warnings on standard error."""
    for text in (matrix.experiment.title, matrix.experiment.question):
        if text:
            click.echo(text)
    click.echo(counted(size.flights, "flight") + (f", {done} already done" if done else ""))
    for key, count in size.varies.items():
        click.echo(f"  {key}: {count} values")
    for key in matrix.draws:
        click.echo(f"  {key}: drawn from the seed")
    of = f"{counted(size.flights - done, 'flight')} to fly" if done else counted(size.flights, "flight")
    for repeated in matrix.repeated:
        click.echo(f"warning: {repeated}", err=True)
    for warning in list(size.warnings.values())[:_MOST_WARNINGS]:
        first = "" if warning.alike else " (the numbers are of the first of them)"
        click.echo(f"warning: {warning.flights} of {of}: {warning.text}{first}", err=True)
    if (more := len(size.warnings) - _MOST_WARNINGS) > 0:
        click.echo(f"warning: and {counted(more, 'more warning')}", err=True)
    if size.idle_seeds and not done:
        click.echo(
            f"warning: the {size.idle_seeds} seeds repeat the same flight: target and course are known exactly, "
            "the air has no turbulence, and no setting is drawn from the seed",
            err=True,
        )


def print_time(size: Survey, done: int, workers: int, log: str | None) -> None:
    """How long the flights take, and how much of the disk."""
    from harness.runs.run import RECORDED
    from harness.runs.survey import disk

    flights = size.flights - done
    if not flights:
        click.echo("all flights are done")
        return
    recorded = {"all": flights, "none": 0, "failed": 0}.get(log or "", min(RECORDED, flights))
    room = _size(disk(size, recorded))
    click.echo(
        f"about {duration(sum(size.typical.values()) / workers)} with {counted(workers, 'worker')}, {room} of disk"
    )


def engine_of(size: Survey, asked: str | None, times: float = 1.0) -> bool:
    """Whether flights are compiled where they can be: see `engine_for`. Reports a user's law that is not."""
    from harness.runs.engine import engine_for

    with busy("compiling"):
        engine = engine_for(size, asked, times)
    for note in engine.notes:
        click.echo(f"note: {note}; Python flies it, some ten times slower", err=True)
    return engine.compiled


def fly_matrix(matrix: Matrix, out: Path, options: Options) -> Progress:
    """Flies what is not done yet, shows how far it is, and prints the table of results.

    Raises `StoreError` and `WorkersError`.
    """
    from harness.runs.results import export
    from harness.runs.run import run

    progress = flown_out(run(matrix, out, options), out)
    with busy("writing the table of flights"):
        export(out)
    _print_results(matrix, out, progress)
    return progress


def flown_out(flying: Iterator[Progress], out: Path, first: str = "starting the workers") -> Progress:
    """Flies until all is done and shows the progress, `first` before it begins; on Ctrl-C reports what is kept."""
    import signal

    progress = None
    states = of_run(flying, first)
    try:
        while (state := next(states, None)) is not None:
            progress = state
    except KeyboardInterrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # what is left to do takes no time
        kept = progress.earlier + progress.done if progress else 0
        click.echo(f"kept in {out}: {counted(kept, 'flight')}; the same command resumes the run", err=True)
        raise
    assert progress
    return progress


def _print_results(matrix: Matrix, out: Path, progress: Progress) -> None:
    """A table by the axes: medians over what is drawn, outcomes; then the failures, and where the results are."""
    from harness.log.metric import METRICS
    from harness.runs.summary import summary
    from harness.tables import number, table

    results = summary(matrix, out, _MOST_LINES)
    metrics = [metric for metric in METRICS.values() if metric.in_short_tables]
    axes = [keys.replace(", ", ",\n") for keys in results.axes]
    ended = any(set(line.outcomes) != {"completed"} for line in results.lines)
    headings = [*axes, "settled", *(metric.column_heading for metric in metrics), *(["ended"] if ended else [])]
    rows = []
    for line in results.lines:
        cells = [*line.labels, f"{line.settled} of {line.flights}"]
        cells += [number(line.medians[metric.name], metric.scale) for metric in metrics]
        if ended:
            cells.append(", ".join(f"{count} {outcome}" for outcome, count in line.outcomes.items()))
        rows.append(cells)
    alignment = "l" * len(axes) + "r" * (1 + len(metrics)) + "l"
    for text in table(headings, rows, alignment):
        click.echo(text)
    if results.more:
        click.echo(
            f"... and {counted(results.more, 'line')} more; all flights: harness.load_results({str(out)!r}) in Python"
        )
    for failure, count in results.failures.most_common(_MOST_REASONS):
        click.echo(f"failed: {count} x {failure.outcome}: {failure.reason}")
    of_machine = sum(count for failure, count in results.failures.items() if failure.outcome.of_machine)
    if of_machine:
        click.echo(f"{counted(of_machine, 'flight')} failed; the same command flies them again")
    if invalid := results.failures.total() - of_machine:
        click.echo(f"{counted(invalid, 'flight')} failed; --retry failed flies them again")
    for problem in progress.unrecorded[:_MOST_REASONS]:
        click.echo(f"warning: {problem}", err=True)
    if progress.unrecorded:
        click.echo(f"{counted(len(progress.unrecorded), 'recording')} missing; the same command makes them up")
    if progress.recorded:
        click.echo(f"{counted(progress.recorded, 'earlier flight')} flown again for a recording that was missing")
    if progress.repeated:
        click.echo(
            f"{counted(progress.repeated, 'flight')} of the matrix the same as another one: flown and counted once"
        )
    click.echo(f"{progress.done} flown, {progress.earlier} earlier, {progress.failed} failed; results in {out}")


def print_endings(out: Path) -> None:
    """How flights ended that did not last, and how many did so."""
    from collections import Counter

    from harness.runs.journal import StoreError
    from harness.runs.results import load_results

    try:
        flights = load_results(out)
    except StoreError:
        return  # everything was refused before it was flown
    early = flights[flights["outcome"] != "completed"]
    endings = Counter(zip(early["outcome"], early["reason"], strict=True))
    for (outcome, reason), count in endings.most_common(_MOST_REASONS):
        click.echo(f"{count} x {outcome}: {reason}")


def _size(size: float) -> str:
    return f"{size / 1e6:.0f} MB" if size >= 1e6 else f"{max(1, round(size / 1e3))} kB"
