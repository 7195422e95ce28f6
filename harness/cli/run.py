"""`harness run`: a matrix of flights."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from harness.cli._flying import flying
from harness.cli._paths import PATH

if TYPE_CHECKING:
    from harness.runs.matrix import Shard


@click.command()
@click.argument("file", type=PATH)
@click.option("--out", type=PATH, help="The folder of the results; required without --dry-run.")
@click.option("--limit", type=click.IntRange(1), metavar="N", help="Fly the first N flights of the matrix only.")
@click.option(
    "--shard", metavar="I/N", help="Fly the I-th of N parts, each on a machine of its own; see harness merge."
)
@click.option(
    "--log",
    type=click.Choice(["all", "sample", "failed", "none"]),
    help="Which flights are recorded, in OUT/flights. [default: all up to 50 flights, else sample]",
)
@click.option("--dry-run", is_flag=True, help="Print the size of the matrix, its warnings and the time it takes.")
@flying
def run(
    file: Path,
    out: Path | None,
    workers: int | None,
    dask: str | None,
    limit: int | None,
    shard: str | None,
    log: str | None,
    overrides: tuple[str, ...],
    retry: str | None,
    engine: str | None,
    flight_timeout: float | None,
    dry_run: bool,
) -> None:
    """Fly a matrix of flights, or resume it where it stopped.

    Prints the question of FILE, the number of flights, what varies between them, and the warnings; then a table of
    the results, one line for each combination of settings, with medians over the seeds. The results are kept in OUT.
    The same command resumes an interrupted run; flights that are done are not flown again.

    \b
    Examples:
      harness run experiments/wind.toml --dry-run
      harness run experiments/wind.toml --out out/wind
      harness run experiments/wind.toml --out out/wind --retry failed
      harness run experiments/stationary.toml --out out/k2 --set 'law.k2=[1,3,12]' --set 'seed={start=0,count=8}'
      harness run experiments/wind.toml --out out/wind_2 --shard 2/4
      harness run experiments/wind.toml --out out/wind --dask 127.0.0.1:8786
    """
    from harness.cli._input import BadInput
    from harness.cli._matrix import engine_of, fly_matrix, many_flights, print_survey, print_time, processes, surveyed
    from harness.cli._paths import writable_folder
    from harness.error import HarnessError
    from harness.runs.matrix import read_matrix
    from harness.runs.run import positions_done
    from harness.settings import read_settings

    if out is None and not dry_run:
        raise BadInput("--out DIR is missing: the folder of the results")
    workers = processes(workers, flight_timeout, dask)
    try:
        matrix = replace(read_matrix(read_settings(file, overrides), draft=True), shard=_shard(shard))
        done = positions_done(matrix, out, retry_failed=retry is not None) if out else {}
        size = surveyed(matrix, limit, done)
        if out is not None and not dry_run:
            writable_folder(out)
        print_survey(matrix, size, len(done))
        if dry_run or out is None:
            print_time(size, len(done), max(1, workers), log)
            return
        with many_flights(workers, dask, retry, flight_timeout) as options:
            options = replace(options, limit=limit, log=log, typical=size.typical, compiled=engine_of(size, engine))
            progress = fly_matrix(matrix, out, options)
    except HarnessError as error:
        raise BadInput(str(error)) from None
    except OSError as error:
        raise BadInput(f"{error.filename or out}: {error.strerror or error}") from None
    click.echo(f"next: harness show {out}, harness compare {out}")
    raise SystemExit(1 if progress.failed or progress.unrecorded else 0)


def _shard(text: str | None) -> Shard | None:
    """The part that `I/N` names. Raises `BadInput`."""
    from harness.cli._input import BadInput
    from harness.runs.matrix import Shard

    if text is None:
        return None
    numbers = re.fullmatch(r"([0-9]{1,6})/([0-9]{1,6})", text)
    part = Shard(int(numbers[1]), int(numbers[2])) if numbers else Shard(0, 0)
    if not 1 <= part.number <= part.of:
        raise BadInput(f"--shard is {text!r}, must be I/N with I from 1 to N, as in 2/4")
    return part
