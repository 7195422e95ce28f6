"""`harness falsify`: the flight that breaks a requirement most."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from harness.cli._flying import flying

if TYPE_CHECKING:
    from harness.search.falsify import Falsification

_MOST_LINES = 5  # largest number of lines of the table of the worst


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--over", multiple=True, required=True, metavar="KEY=LO:HI", help="Search this setting; repeatable.")
@click.option("--requirement", "asked", required=True, metavar="'NAME OP VALUE'", help="The requirement to violate.")
@click.option("--out", type=click.Path(path_type=Path), required=True, help="The folder of the results.")
@click.option(
    "--flights", type=click.IntRange(1), default=200, show_default=True, metavar="N", help="At most N flights."
)
@click.option(
    "--guide",
    "guiding",
    type=click.Choice(["kinematic", "lagged", "coordinated", "none"]),
    help="Search this cheaper plant first, as a guide. [default: coordinated for 6-DOF flights]",
)
@click.option(
    "--seed",
    type=click.IntRange(0),
    default=0,
    show_default=True,
    help="Random seed of the search; flights keep their own.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of the text.")
@flying
def falsify(
    file: Path,
    over: tuple[str, ...],
    asked: str,
    out: Path,
    flights: int,
    guiding: str | None,
    seed: int,
    workers: int | None,
    dask: str | None,
    overrides: tuple[str, ...],
    retry: str | None,
    engine: str | None,
    flight_timeout: float | None,
    as_json: bool,
) -> None:
    """Search for the flight that violates a requirement most.

    The requirement is NAME OP VALUE: a metric, or the outcome, against a value. Robustness is the margin to the value,
    divided by the value; negative means violated. A missing value counts as violated. Each trial flies all flights of
    the [matrix] of FILE and is judged by the worst of them; a searched key must not be an axis of the [matrix].

    A search of 6-DOF flights begins with 64 trials on a cheaper plant, which do not count among the N flights. Their
    result is the prior mean of the search, weighted by how well it predicts the flights on the plant itself.

    At least every fourth trial is drawn uniformly from the ranges (a positive range of a decade or more on a
    logarithmic scale). These trials give a 95 % upper bound on the share of the valid settings in the ranges that
    violates the requirement, for a number of flights fixed in advance. A search that finds no violation is no proof.

    Writes OUT/counterexample.toml, which `harness fly` and `harness view` take, and OUT/trials.csv. The result does
    not depend on the number of workers. The same command resumes an interrupted search, and goes on with more
    --flights; the flights are rows of OUT as of `harness run`. Exit code 0 whether a counter-example is found or
    not; 1 when a flight failed (invalid, timeout, worker_died).

    \b
    Examples:
      harness falsify experiments/falsify.toml --out out/falsify --over start.heading_deg=0:360 \\
          --over target.speed_mps=0:6 --requirement 'range_error_peak_m < 5'
      harness falsify experiments/falsify.toml --out out/lost --over target.speed_mps=0:12 \\
          --requirement 'outcome = completed'
      harness falsify experiments/falsify.toml --out out/lost --over target.speed_mps=0:12 \\
          --requirement 'outcome = completed' --dask 127.0.0.1:8786
    """
    from dataclasses import replace

    from harness.cli._input import BadInput
    from harness.cli._matrix import (
        engine_of,
        flown_out,
        many_flights,
        print_survey,
        processes,
        surveyed,
    )
    from harness.cli._paths import writable_folder
    from harness.cli._progress import busy
    from harness.error import HarnessError
    from harness.requirement import RequirementError, requirement
    from harness.runs.results import export
    from harness.search.dimension import dimension
    from harness.search.falsify import GUIDING, falsification, guide_to
    from harness.search.files import write_counterexample, write_probes
    from harness.search.space import Space
    from harness.settings import read_settings
    from harness.tables import counted

    workers = processes(workers, flight_timeout, dask)
    try:
        required = requirement(asked)
    except RequirementError as error:
        raise BadInput(f"--requirement {asked!r}: {error}") from None
    try:
        space = Space(read_settings(file, overrides), [dimension(text) for text in over])
        guide = guide_to(space, guiding) if guiding != "none" else None
        search = falsification(space, required, flights=flights, seed=seed, guide=guide)
        _, middle, _ = (surveyed(matrix) for matrix in space.tried)
        writable_folder(out)
        if not as_json:
            print_survey(space.matrix, middle, 0)
            click.echo("every trial flies these; searched:")
            for one in space.dimensions:
                click.echo(f"  {one}{', by factors' if one.is_log else ''}")
            click.echo(f"to be broken: {required}")
            if search.guide:
                click.echo(f"first {counted(search.guide.flights, 'flight')} on {search.guide.plant}, as a guide")
        sizes = [(middle, flights // len(space.conditions))]
        if guide:
            sizes.append((surveyed(guide.tried[1]), GUIDING))
        typical = {plant: times * seconds for size, times in sizes for plant, seconds in size.typical.items()}
        with many_flights(workers, dask, retry, flight_timeout) as options:
            compiled = [engine_of(size, engine, times) for size, times in sizes]
            options = replace(options, typical=typical, compiled=any(compiled))
            progress = flown_out(search.fly(out, options), out)
        with busy("writing the table of flights"):
            export(out)
            counterexample, table = write_counterexample(search, out), write_probes(search, out)
    except HarnessError as error:
        raise BadInput(str(error)) from None
    except OSError as error:
        raise BadInput(f"{error.filename or out}: {error.strerror or error}") from None
    if as_json:
        click.echo(_json(search, counterexample))
    else:
        _print_found(search, counterexample)
        click.echo(
            f"{progress.done} flown, {progress.earlier} earlier, {progress.failed} failed; results in {out}, all "
            f"trials in {table}"
        )
    raise SystemExit(1 if progress.failed else 0)


def _print_found(search: Falsification, counterexample: Path | None) -> None:
    """The worst trials, the counter-example or that there is none, and what the uniform trials say."""
    from collections import Counter

    from harness.tables import counted, table

    keys = [dimension.key for dimension in search.space.dimensions]
    name = search.requirement.name
    listed = search.broken[:_MOST_LINES] or ([search.worst] if search.worst else [])
    rows = []
    for trial in listed:
        settings = [f"{trial.candidate.values[key]:g}" for key in keys]
        rows.append([*settings, search.value(trial), f"{trial.robustness:.3g}", trial.candidate.keys[trial.decisive]])
    for line in table([*keys, name, "robustness", "flight"], rows, "r" * (len(keys) + 2) + "l"):
        click.echo(line)
    flown = counted(len(search.trials), "trial")
    if len(search.space.conditions) > 1:
        flown += f" of {counted(len(search.space.conditions), 'flight')}"
    if counterexample:
        click.echo(f"{len(search.broken)} of {flown} broke it, trial {search.first_broken} as the first")
        if all(trial.candidate.facts[trial.decisive].get(name) is None for trial in search.trials):
            click.echo(f"warning: {name} is unknown in every flight, which breaks any requirement on it", err=True)
    else:
        click.echo(f"none in {flown}; above is the one that came closest" if listed else f"none in {flown}")
    for what, count in Counter(search.refused).most_common(_MOST_LINES):
        click.echo(f"{counted(count, 'trial')} refused before it was flown: {what}")
    if search.guide:
        broken = f"broke it in {len(search.guide.broken)} of {counted(len(search.guide.trials), 'trial')}, as a guide"
        click.echo(f"{search.guide.plant} {broken if search.guide.knows else f'has no {name}, so it was no guide'}")
    bound = search.bound
    failed = f", and {bound.failed} failed and count as broken" if bound.failed else ""
    drawn = f"{bound.broken} of {counted(bound.trials, 'uniform trial')} broke it{failed}"
    share = f"at most {100.0 * bound.share:.3g} % of the valid settings do, with 95 % confidence"
    click.echo(f"{drawn}: {share if bound.share < 1.0 else 'no bound on the share of the valid settings that do'}")
    if counterexample:
        click.echo(f"next: harness fly {counterexample}, or harness view {counterexample}")


def _json(search: Falsification, counterexample: Path | None) -> str:
    import json

    worst, bound = search.worst, search.bound
    found = worst and {
        "settings": dict(worst.candidate.values),
        "value": worst.candidate.facts[worst.decisive].get(search.requirement.name),
        "robustness": worst.robustness,
        "flight": worst.candidate.keys[worst.decisive],
    }
    return json.dumps(
        {
            "requirement": str(search.requirement),
            "trials": len(search.trials),
            "broken": len(search.broken),
            "first_broken": search.first_broken,
            "worst": found,
            "counterexample": counterexample and str(counterexample),
            "uniform": {**bound._asdict()},
            "guide": search.guide
            and {"plant": search.guide.plant, "trials": len(search.guide.trials), "broken": len(search.guide.broken)},
        },
        allow_nan=False,
    )
