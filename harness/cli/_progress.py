"""How far a long job is: a line that moves on a terminal, a line now and then elsewhere; on standard error."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import TYPE_CHECKING, Protocol

import click

if TYPE_CHECKING:
    from harness.runs.run import Progress

_EVERY = 10.0  # s, between two lines where there is no terminal


def busy(what: str) -> AbstractContextManager[object]:
    """Names a step that takes some seconds, while it lasts; on a terminal alone."""
    from rich.console import Console

    terminal = Console(stderr=True)
    return terminal.status(what) if terminal.is_terminal else nullcontext()


class Advance(Protocol):
    """Called after a part of a job; `work` is how much of it that was."""

    def __call__(self, work: float = 1.0) -> None: ...


@contextmanager
def progress(what: str, whole: float, *, counted: bool = True) -> Iterator[Advance]:
    """The function to call after each part of a job, whose parts are `counted`, or are work of different size."""
    from rich.console import Console
    from rich.progress import MofNCompleteColumn
    from rich.progress import Progress as Bar

    terminal = Console(stderr=True)
    columns = (*Bar.get_default_columns(), *([MofNCompleteColumn()] if counted else []))
    with Bar(*columns, console=terminal, transient=True, disable=not terminal.is_terminal) as bar:
        task = bar.add_task(what, total=whole)
        begin = printed = time.monotonic()
        done = 0.0

        def advance(work: float = 1.0) -> None:
            nonlocal done, printed
            bar.advance(task, work)
            done += work
            now = time.monotonic()
            if not terminal.is_terminal and now - printed >= _EVERY:
                printed = now
                so_far = f"{done:g} of {whole:g}" if counted else f"{100 * done / whole:.0f} % done"
                click.echo(f"{what}: {so_far}, {duration((now - begin) * (whole / done - 1.0))} left", err=True)

        yield advance


def of_run(states: Iterable[Progress], first: str = "starting the workers") -> Iterator[Progress]:
    """The states of a run, passed on as they come and shown; until there is one, what is done `first`."""
    if sys.stderr.isatty():
        yield from _on_terminal(states, first)
        return
    printed, state = time.monotonic(), None
    for state in states:
        if time.monotonic() - printed >= _EVERY:
            printed = time.monotonic()
            click.echo(_line(state), err=True)
        yield state
    if state is not None:
        click.echo(_line(state), err=True)


def _on_terminal(states: Iterable[Progress], first: str) -> Iterator[Progress]:
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn
    from rich.progress import Progress as Bar

    bar = Bar(BarColumn(), TextColumn("{task.description}"), console=Console(stderr=True), transient=True)
    with bar:
        task = bar.add_task(first, total=None)
        for state in states:
            bar.update(task, total=state.total, completed=state.earlier + state.done, description=_line(state))
            yield state


def _line(state: Progress) -> str:
    finished = state.earlier + state.done
    parts = [f"{finished} of {state.total} flights done"]
    if state.earlier:
        parts.append(f"{state.earlier} of them by an earlier run")
    if state.out:
        parts.append(f"{state.out} in progress")
    parts.append(f"{state.failed} failed")
    if state.done and state.seconds:
        rate = state.done / state.seconds
        parts.append(f"{rate:.3g} flights/s")
        if state.left is not None and finished < state.total:
            parts.append(f"{duration(state.left)} left")
    if state.note:
        parts.append(state.note)
    return ", ".join(parts)


def duration(seconds: float) -> str:
    """A length of time in a unit that suits it."""
    if seconds < 90.0:
        return f"{max(1, round(seconds))} s"
    return f"{round(seconds / 60.0)} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
