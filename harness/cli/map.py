"""`harness map`: where the answer changes over two settings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from harness.cli._flying import flying

if TYPE_CHECKING:
    from harness.search.map import Map

PICTURE = "map.svg"  # in the report
_PICTURES = ("map.png", PICTURE)


@click.command("map")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--x", "across", required=True, metavar="KEY=LO:HI", help="The setting across.")
@click.option("--y", "upwards", required=True, metavar="KEY=LO:HI", help="The setting upwards.")
@click.option(
    "--of",
    "asked",
    default="converged",
    show_default=True,
    metavar="METRIC|outcome|'NAME OP VALUE'",
    help="What is evaluated for each flight.",
)
@click.option(
    "--resolution", type=int, default=200, show_default=True, metavar="N", help="Locate borders to 1/N of a range."
)
@click.option("--out", type=click.Path(path_type=Path), required=True, help="The folder of the results.")
@click.option(
    "--flights",
    type=int,
    metavar="N",
    help="At most N flights.  [default: a tenth of the full grid's, or four times the lattice's]",
)
@flying
def map_(
    file: Path,
    across: str,
    upwards: str,
    asked: str,
    resolution: int,
    out: Path,
    flights: int | None,
    workers: int | None,
    dask: str | None,
    overrides: tuple[str, ...],
    retry: str | None,
    engine: str | None,
    flight_timeout: float | None,
) -> None:
    """Map where the answer changes over two settings.

    Flies a coarse lattice, and then only where the answer changes. Each combination of the [matrix] of FILE, such as
    each plant, is a separate panel. Flights that differ only in the seed are combined: the median for a numeric
    metric, otherwise the most frequent answer. A key of the map must not be an axis of the [matrix];
    `wind.steady_mps.north` is one component of a vector. A positive range of a decade or more is divided
    logarithmically.

    The answer is whether the flight converges (converged), its outcome, a metric, or whether it satisfies NAME OP
    VALUE, as in 'range_error_peak_m < 5'. For a numeric metric a border is drawn where neighbouring points differ by
    more than a tenth of its range. A feature that lies between the points of the coarse lattice (with the default
    resolution, narrower than 1/18 of a range) may be missed: see the guide.

    Prints the share of each answer in each panel and the number of flights. Writes OUT/map.png and OUT/map.svg,
    which `harness report` shows, OUT/points.csv and OUT/border.csv. The result does not depend on the number of
    workers. The same command resumes an interrupted map; the flights are rows of OUT as of `harness run`.

    \b
    Examples:
      harness map experiments/gains.toml --out out/map --x law.k2=0.5:20 --y law.k3=0:10 --of chatters
      harness map experiments/stationary.toml --out out/basin --x start.position_m.east=-400:400 \\
          --y start.heading_deg=0:360 --set plant=kinematic
      harness map experiments/basin.toml --out out/wide --x start.position_m.east=-400:400 \\
          --y start.heading_deg=0:360 --dask 127.0.0.1:8786
    """
    from dataclasses import replace

    from harness.cli._input import BadInput
    from harness.cli._matrix import engine_of, flown_out, many_flights, print_endings, print_survey, processes, surveyed
    from harness.cli._paths import writable_folder
    from harness.cli._progress import busy
    from harness.drawing import save
    from harness.error import HarnessError
    from harness.files import replacing
    from harness.runs.results import export
    from harness.search.dimension import dimension
    from harness.search.map import map_of, question
    from harness.search.picture import drawn
    from harness.search.space import Space
    from harness.settings import read_settings

    workers = processes(workers, flight_timeout, dask)
    try:
        dimensions = [dimension(across, "--x"), dimension(upwards, "--y")]
        space = Space(read_settings(file, overrides), dimensions)
        found = map_of(space, question(asked), resolution=resolution, flights=flights)
        _, matrix, _ = space.tried  # of the middle: at the ends settings may be refused, which the map shows
        middle = surveyed(matrix)
        writable_folder(out)
        print_survey(space.matrix, middle, 0)
        _print_search(found)
        with many_flights(workers, dask, retry, flight_timeout) as options:
            options = replace(options, compiled=engine_of(middle, engine, found.flights / middle.flights))
            progress = flown_out(found.fly(out, options), out)
        with busy("writing the table of flights"):
            export(out)
            found.write(out)
        with busy("drawing"):
            figure = drawn(found)
            for name in _PICTURES:
                with replacing(out / name) as partial:
                    save(figure, partial, Path(name).suffix)
    except HarnessError as error:
        raise BadInput(str(error)) from None
    except OSError as error:
        raise BadInput(f"{error.filename or out}: {error.strerror or error}") from None
    _print_found(found)
    print_endings(out)
    click.echo(
        f"{progress.done} flown, {progress.earlier} earlier, {progress.failed} failed; results in {out}, the map in "
        f"{out / _PICTURES[0]}"
    )
    raise SystemExit(1 if progress.failed else 0)


def _print_search(found: Map) -> None:
    """Prints the question, the resolution, and the largest number of flights."""
    from harness.tables import counted

    border = found.panels[0].border
    click.echo(f"a map of {found.question.text} over")
    for d in (found.x, found.y):
        click.echo(f"  {d}{', by factors' if d.is_log else ''}")
    click.echo(
        f"in {counted(len(found.panels), 'panel')}: a lattice of {border.side // border.coarse + 1} x "
        f"{border.side // border.coarse + 1} points first, then the border in steps of 1/{border.side}; "
        f"{found.flights} flights at most"
    )


def _print_found(found: Map) -> None:
    """The share of each answer in each panel, and the flights that it took; what is not located or not flown."""
    from harness.tables import counted, table

    rows = []
    for panel in found.panels:
        full = (panel.border.side + 1) ** 2 * len(panel.conditions)
        name = ", ".join(f"{key} = {value}" for key, value in panel.at.items()) or "all"
        rows.append([name, found.told(panel), str(panel.flights), f"1/{full / max(1, panel.flights):.0f}"])
    for line in table(["panel", "the answer over the area", "flights", "of a full grid"], rows, "llrr"):
        click.echo(line)
    unlocated = sum(panel.open for panel in found.panels)
    if found.stopped:
        click.echo(
            f"stopped before more than {found.flights} flights: in {counted(unlocated, 'square')} the border is not "
            "located; the same command with more --flights goes on"
        )
    for panel in found.panels:
        if panel.refused:
            first = next(iter(panel.refused.values()))
            click.echo(f"{counted(len(panel.refused), 'point')} not flown, the settings refuse them: {first}")
