"""What `harness run` shows: the size of a matrix, how far it is, and its results."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from harness.runs.matrix import Matrix
    from harness.runs.run import Progress
    from harness.runs.survey import Survey

_MOST_LINES = 60  # of the final table
_MOST_REASONS = 5
_EVERY = 10.0  # s between plain lines


def surveyed(matrix: Matrix, limit: int | None = None, done: frozenset[int] = frozenset()) -> Survey:
    """Checks every flight of the matrix that is not done. Raises `SettingsError`."""
    from rich.console import Console

    from harness.runs.survey import survey

    with Console(stderr=True).status("checking the matrix") as status:
        for found in survey(matrix, limit, done):
            status.update(f"checking the matrix: {found.flights} flights")
    return found


def tell_survey(matrix: Matrix, found: Survey, done: int) -> None:
    """The question, the number of flights, what varies, what is remarkable."""
    for text in (matrix.experiment.title, matrix.experiment.question):
        if text:
            click.echo(text)
    click.echo(f"{found.flights} flight{'s' if found.flights != 1 else ''}" + (f", {done} done" if done else ""))
    for key, count in found.varies.items():
        click.echo(f"  {key}: {count} values")
    for key in matrix.draws:
        click.echo(f"  {key}: drawn from the seed")
    if found.infeasible:
        click.echo(
            f"{found.infeasible} circles are INFEASIBLE: the heading-rate limit is below what holding them takes"
            + (" (of those not done)" if done else "")
        )
    if found.idle_seeds and not done:
        click.echo(
            f"warning: the {found.idle_seeds} seeds change nothing, they fly the same flight again: the target is "
            "known truly, the air is without turbulence, and nothing is drawn",
            err=True,
        )


def tell_time(found: Survey, done: int, workers: int, log: str | None) -> None:
    """What flying it would take."""
    from harness.runs.run import RECORDED
    from harness.runs.survey import disk

    flights = found.flights - done
    if not flights:
        click.echo("nothing is left to fly")
        return
    recorded = {"all": flights, "none": 0, "failed": 0}.get(log or "", min(RECORDED, flights))
    seconds, size = found.seconds / workers, disk(found, recorded)
    click.echo(f"about {_duration(seconds)} with {workers} worker{'s' if workers > 1 else ''}, {_size(size)} of disk")


def shown(states: Iterable[Progress]) -> Iterator[Progress]:
    """The same, shown on a terminal as a line that moves, else as a line now and then; on stderr."""
    if sys.stderr.isatty():
        yield from _on_terminal(states)
        return
    told, state = time.monotonic(), None
    for state in states:
        if time.monotonic() - told >= _EVERY:
            told = time.monotonic()
            click.echo(_line(state), err=True)
        yield state
    if state is not None:
        click.echo(_line(state), err=True)


def _on_terminal(states: Iterable[Progress]) -> Iterator[Progress]:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    bar = Progress(BarColumn(), TextColumn("{task.description}"), console=Console(stderr=True), transient=True)
    with bar:
        task = bar.add_task("starting the workers", total=None)
        for state in states:
            bar.update(task, total=state.total, completed=state.earlier + state.done, description=_line(state))
            yield state


def _line(state: Progress) -> str:
    finished = state.earlier + state.done
    parts = [f"{finished} of {state.total} flights done"]
    if state.earlier:
        parts.append(f"{state.earlier} of them earlier")
    if state.out:
        parts.append(f"{state.out} with the workers")
    parts.append(f"{state.failed} failed")
    if state.done and state.seconds:
        rate = state.done / state.seconds
        parts.append(f"{rate:.3g} flights/s")
        if left := state.total - finished:
            parts.append(f"{_duration(left / rate)} left")
    return ", ".join(parts)


def tell_results(matrix: Matrix, out: Path, progress: Progress) -> None:
    """A table by the axes: medians over what is drawn, outcomes; then the failures, and where the results are."""
    from harness.metric import METRICS
    from harness.plants.plant import Outcome
    from harness.runs.summary import summary
    from harness.tables import number, table

    results = summary(matrix, out, _MOST_LINES)
    shown = [metric for metric in METRICS.values() if metric.in_short_tables]
    axes = [", ".join(key.rpartition(".")[2] for key in keys.split(", ")) for keys in results.axes]
    ended = any(set(line.outcomes) != {"completed"} for line in results.lines)
    headings = [*axes, "settled", *(metric.column_heading for metric in shown), *(["ended"] if ended else [])]
    rows = []
    for line in results.lines:
        cells = [*line.labels, f"{line.settled} of {line.flights}"]
        cells += [number(line.medians[metric.name], metric.scale) for metric in shown]
        if ended:
            cells.append(", ".join(f"{count} {outcome}" for outcome, count in line.outcomes.items()))
        rows.append(cells)
    alignment = "l" * len(axes) + "r" * (1 + len(shown)) + "l"
    for text in table(headings, rows, alignment):
        click.echo(text)
    if results.more:
        click.echo(f"... and {results.more} lines more; all: harness.load_results({str(out)!r}) in Python")
    for reason, count in sorted(progress.reasons.items(), key=lambda item: -item[1])[:_MOST_REASONS]:
        click.echo(f"failed: {count} x {reason}")
    for problem in progress.recordings[:_MOST_REASONS]:
        click.echo(f"warning: {problem}", err=True)
    lost = sum(count for line in results.lines for outcome, count in line.outcomes.items() if Outcome(outcome).failed)
    if lost:
        click.echo(f"{lost} results are failures; --retry failed flies them again")
    click.echo(f"{progress.done} flown, {progress.earlier} earlier, {progress.failed} failed; results in {out}")
    click.echo(f"to go on: harness show {out}, harness compare {out}")


def _duration(seconds: float) -> str:
    if seconds < 90.0:
        return f"{max(1, round(seconds))} s"
    return f"{round(seconds / 60.0)} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


def _size(size: float) -> str:
    return f"{size / 1e6:.0f} MB" if size >= 1e6 else f"{max(1, round(size / 1e3))} kB"
