"""`harness run`: a matrix of flights."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from harness.runs.matrix import Matrix
    from harness.runs.run import Options, Progress


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="The directory of the results; needed but for --dry-run.")
@click.option("--workers", type=click.IntRange(0, 1024), help="Processes; 0: this one. [default: one per processor]")
@click.option("--limit", type=click.IntRange(1), metavar="N", help="Only the first N flights of the matrix.")
@click.option(
    "--log",
    type=click.Choice(["all", "sample", "failed", "none"]),
    help="Which flights are recorded, in OUT/flights. [default: all up to 50 flights, else sample]",
)
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="Set a key for all flights; repeatable.")
@click.option("--retry", type=click.Choice(["failed"]), help="Fly those again that failed.")
@click.option("--flight-timeout", type=float, metavar="S", help="End a flight after S. [default: 20 x its estimate]")
@click.option("--dry-run", is_flag=True, help="Say what would be flown, and how long it would take.")
def run(
    file: Path,
    out: Path | None,
    workers: int | None,
    limit: int | None,
    log: str | None,
    overrides: tuple[str, ...],
    retry: str | None,
    flight_timeout: float | None,
    dry_run: bool,
) -> None:
    """Fly the matrix of FILE. The same command goes on where it was stopped.

    \b
    Examples:
      harness run experiments/wind.toml --dry-run
      harness run experiments/wind.toml --out out/wind
      harness run experiments/wind.toml --out out/wind --retry failed
    """
    import os

    from harness.cli._input import BadInput, busy
    from harness.cli._progress import surveyed, tell_results, tell_survey, tell_time
    from harness.runs.matrix import read_matrix
    from harness.runs.results import export
    from harness.runs.run import Options, positions_done
    from harness.runs.store import StoreError
    from harness.runs.workers import WorkersError
    from harness.settings import SettingsError, read_settings

    if out is None and not dry_run:
        raise BadInput("--out DIR is missing: the directory of the results")
    if flight_timeout is not None and not flight_timeout > 0:
        raise BadInput(f"--flight-timeout is {flight_timeout:g}, must be > 0")
    workers = (os.cpu_count() or 1) if workers is None else workers
    try:
        matrix = read_matrix(read_settings(file, overrides))
        done = positions_done(matrix, out, retry_failed=retry is not None) if out else frozenset[int]()
        found = surveyed(matrix, limit, done)
        if dry_run or out is None:
            tell_survey(matrix, found, len(done))
            tell_time(found, len(done), max(1, workers), log)
            return
        options = Options(workers=workers, limit=limit, log=log, retry_failed=retry is not None, timeout=flight_timeout)
        tell_survey(matrix, found, len(done))
        progress = _flown(matrix, out, options)
        with busy("writing the table of flights"):
            export(out)
        tell_results(matrix, out, progress)
    except (SettingsError, StoreError, WorkersError) as error:
        raise BadInput(str(error)) from None
    except OSError as error:
        raise BadInput(f"{error.filename or out}: {error.strerror or error}") from None
    raise SystemExit(1 if progress.failed else 0)


def _flown(matrix: Matrix, out: Path, options: Options) -> Progress:
    """Flies, and shows how far it is."""
    import signal

    from harness.cli._progress import shown
    from harness.runs.run import run as fly

    progress = None
    states = shown(fly(matrix, out, options))
    try:
        while (state := next(states, None)) is not None:
            progress = state
    except KeyboardInterrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # what is left to do takes no time
        kept = progress.earlier + progress.done if progress else 0
        click.echo(f"{kept} flights are kept in {out}; the same command goes on", err=True)
        raise
    assert progress
    return progress
