"""`harness tune`: the settings that do best."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from harness.cli._flying import flying

if TYPE_CHECKING:
    from harness.requirement import Requirement
    from harness.search.tune import Tuning

_MOST_LINES = 30  # largest number of lines of a front


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--over", multiple=True, required=True, metavar="KEY=LO:HI", help="Search this setting; repeatable.")
@click.option(
    "--minimise", "goals", multiple=True, required=True, metavar="METRIC", help="What to minimise; twice: a front."
)
@click.option(
    "--subject-to",
    "required",
    multiple=True,
    metavar="'NAME OP VALUE'",
    help="Require this of every flight; repeatable.",
)
@click.option("--out", type=click.Path(path_type=Path), required=True, help="The folder of the results.")
@click.option(
    "--flights", type=click.IntRange(1), default=200, show_default=True, metavar="N", help="At most N flights."
)
@click.option(
    "--aggregate",
    type=click.Choice(["worst", "mean"]),
    default="worst",
    show_default=True,
    help="How a metric is aggregated over the conditions.",
)
@click.option(
    "--seed",
    type=click.IntRange(0),
    default=0,
    show_default=True,
    help="Random seed of the search; flights keep their own.",
)
@flying
def tune(
    file: Path,
    over: tuple[str, ...],
    goals: tuple[str, ...],
    required: tuple[str, ...],
    out: Path,
    flights: int,
    aggregate: str,
    seed: int,
    workers: int | None,
    dask: str | None,
    overrides: tuple[str, ...],
    retry: str | None,
    engine: str | None,
    flight_timeout: float | None,
) -> None:
    """Search for the settings that do best.

    Each trial flies all flights of the [matrix] of FILE, its conditions, with the same seeds; a searched key must not
    be an axis of the [matrix]. The objective is the worst value of a metric over the conditions, or the worst distance
    from its ideal value. A constraint on every flight is NAME OP VALUE: a metric, the outcome, or a quantity that is
    predicted without a flight (limit_cycle_margin, feasibility_margin_deg_s, ...) against a value. By default the
    outcome must be `completed` and limit_cycle_margin at least 1.5 (where it can be predicted);
    --subject-to on either replaces its default. Settings that violate a predicted constraint are not flown.

    Prints the best settings, their results and the active constraints. Writes OUT/best.toml, which `harness fly`
    takes, and OUT/trials.csv. With two metrics there is a file for each point of the front: best_1.toml, ... The result
    does not depend on the number of workers. The same command resumes an interrupted search, and goes on with more
    --flights; the flights are rows of OUT as of `harness run`.

    \b
    Examples:
      harness tune experiments/tune.toml --out out/tune --over law.k2=0.5:20 --over law.k3=0:10 \\
          --minimise range_error_rms_m --subject-to chatters=false
      harness tune experiments/tune.toml --out out/front --over law.k2=0.5:20 \\
          --minimise range_error_peak_m --minimise convergence_time_s --subject-to 'range_error_peak_m < 5'
      harness tune experiments/tune.toml --out out/tune --over law.k2=0.5:20 --minimise range_error_rms_m \\
          --dask 127.0.0.1:8786
    """
    from dataclasses import replace

    from harness.cli._input import BadInput
    from harness.cli._matrix import engine_of, flown_out, many_flights, print_endings, print_survey, processes, surveyed
    from harness.cli._paths import writable_folder
    from harness.cli._progress import busy
    from harness.error import HarnessError
    from harness.runs.results import export
    from harness.search.dimension import dimension
    from harness.search.files import write_best, write_trials
    from harness.search.space import Space
    from harness.search.tune import tuning
    from harness.settings import read_settings

    workers = processes(workers, flight_timeout, dask)
    try:
        space = Space(read_settings(file, overrides), [dimension(text) for text in over])
        asked = _requirements(required)
        margin = space.matrix.experiment.assess.limit_cycle_margin
        search = tuning(space, goals, asked, margin=margin, aggregate=aggregate, flights=flights, seed=seed)
        _, middle, _ = (surveyed(matrix) for matrix in space.tried)
        writable_folder(out)
        print_survey(space.matrix, middle, 0)
        _print_search(search)
        trials = flights // len(space.conditions)
        typical = {plant: trials * seconds for plant, seconds in middle.typical.items()}
        with many_flights(workers, dask, retry, flight_timeout) as options:
            options = replace(options, typical=typical, compiled=engine_of(middle, engine, trials))
            progress = flown_out(
                search.fly(out, options), out, "looking for settings that meet the predicted constraints"
            )
        with busy("writing the table of flights"):
            export(out)
            best, table = write_best(search, out), write_trials(search, out)
    except HarnessError as error:
        raise BadInput(str(error)) from None
    except OSError as error:
        raise BadInput(f"{error.filename or out}: {error.strerror or error}") from None
    _print_found(search, best)
    _warn_of_unchecked(search)
    print_endings(out)
    click.echo(
        f"{progress.done} flown, {progress.earlier} earlier, {progress.failed} failed; results in {out}, all trials in "
        f"{table}"
    )
    raise SystemExit(1 if progress.failed or not best else 0)


def _requirements(texts: Sequence[str]) -> list[Requirement]:
    from harness.cli._input import BadInput
    from harness.requirement import RequirementError, requirement

    asked = []
    for text in texts:
        try:
            asked.append(requirement(text))
        except RequirementError as error:
            raise BadInput(f"--subject-to {text!r}: {error}") from None
    return asked


def _print_search(search: Tuning) -> None:
    """The searched settings and the constraints; a warning where the margin to the limit cycle is unknown."""
    from collections import Counter

    from harness.limit_cycle.predicted import MARGIN, why_unknown
    from harness.tables import counted

    click.echo("every trial flies these; searched:")
    for dimension in search.space.dimensions:
        click.echo(f"  {dimension}{', by factors' if dimension.is_log else ''}")
    click.echo(f"required of every flight: {', '.join(map(str, search.requirements))}")
    if any(one.name == MARGIN and one.where_known for one in search.requirements):
        reasons = Counter(filter(None, map(why_unknown, search.space.middle.flights)))
        for reason, count in reasons.items():
            of = f"{count} of {counted(len(search.space.conditions), 'flight')}"
            click.echo(f"warning: {MARGIN} is unknown in {of} and not required there: {reason}", err=True)


def _print_found(search: Tuning, files: Sequence[Path]) -> None:
    """The best settings, their results, why the others were refused, and the active constraints of the best."""
    from harness.tables import counted, table

    refusals = "; ".join(
        f"{what} refused {count}{', before they were flown' if before else ''}"
        for what, (count, before) in search.refusals.items()
    )
    if not files:
        click.echo(f"no settings meet the requirements in {counted(len(search.attempts), 'trial')}: {refusals}")
        return
    for line in table(*_front(search)):
        click.echo(line)
    flown = f"{counted(search.trials, 'trial')} of {counted(len(search.space.conditions), 'flight')} flown"
    click.echo(f"{flown}; {refusals or 'none was refused'}")
    for attempt, file in zip(search.front, files, strict=True):
        if reasons := list(search.constrained(attempt)):
            click.echo(f"{file.stem} is constrained by {' and '.join(reasons)}")
    click.echo(f"next: harness fly {files[0]}")


def _warn_of_unchecked(search: Tuning) -> None:
    from harness.tables import counted

    for name, count in search.unchecked.items():
        if count:
            of = f"{count} of {counted(search.trials, 'trial')}"
            click.echo(f"warning: {name} was unknown in {of} and was not checked there", err=True)


def _front(search: Tuning) -> tuple[list[str], list[list[str]], str]:
    """A table of the best: headings, cells and alignment."""
    from harness.log.metric import METRICS
    from harness.tables import number

    keys = [dimension.key for dimension in search.space.dimensions]
    names = list(dict.fromkeys(one.name for one in search.requirements if isinstance(one.value, float)))
    heads = [f"|{goal} - {METRICS[goal].ideal:g}|" if METRICS[goal].ideal else goal for goal in search.goals]
    asked = [name for name in names if name not in search.goals]
    rows = []
    for i, attempt in enumerate(search.front[:_MOST_LINES], start=1):
        name = "best" if len(search.goals) == 1 else f"best_{i}"
        settings = [f"{attempt.candidate.values[key]:g}" for key in keys]
        rows.append([name, *settings, *map(number, attempt.goals), *(number(search.least(attempt, n)) for n in asked)])
    return ["", *keys, *heads, *asked], rows, "lr"
