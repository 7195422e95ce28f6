"""`harness plot`: figures of flights, or a map of a run, in print size."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from harness.cli._setting import SETTING

if TYPE_CHECKING:
    from harness.drawing import Picture

_PANELS = ("track", "error", "rate", "bank", "sideslip", "spectrum")
_MAP = "map"


@click.command()
@click.argument("places", metavar="DIR:KEY|FILE.rrd|DIR...", nargs=-1, required=True)
@click.option("--what", type=click.Choice([*_PANELS, _MAP]), multiple=True, help="A panel to draw; repeatable.")
@click.option(
    "--save", type=click.Path(path_type=Path), required=True, metavar="FILE", help="The figure: .png, .svg or .pdf."
)
@click.option("--metric", metavar="METRIC", help="The metric of --what map.  [default: range_error_rms_m]")
@click.option(
    "--where", multiple=True, type=SETTING, metavar="KEY=VALUE", help="With --what map: only flights with this setting."
)
def plot(
    places: tuple[str, ...], what: tuple[str, ...], save: Path, metric: str | None, where: tuple[str, ...]
) -> None:
    """Draw flights, or a map of a run, as a figure in print size.

    Flights, up to six: track, |range error| on a log scale, heading rate, bank and sideslip, and the spectrum of the
    command; without --what all of them, for more than two flights a selection. A flight of a run without a recording
    is flown again. With --what map: a metric of all flights of DIR over the two numeric settings with most values. The
    colours suit colour-blind eyes. Prints the file and its content.

    \b
    Examples:
      harness plot out/wind:3f2a out/wind:9c01 --save pair.pdf
      harness plot flight.rrd --what track --what error --save flight.svg
      harness plot out/gains --what map --metric chatters --where plant=sixdof --save gains.png
    """
    from harness.cli._flights import flights_of
    from harness.cli._input import BadInput
    from harness.cli._paths import writable
    from harness.drawing import SUFFIXES
    from harness.drawing import save as write
    from harness.files import replacing

    if save.suffix.lower() not in SUFFIXES:
        raise BadInput(f"--save {save}: must end with {', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]}")
    writable(save)
    if _MAP in what:
        if len(what) > 1 or len(places) > 1:
            raise BadInput("--what map: is a figure of its own, of one DIR")
        figure, shows = _map(Path(places[0]), metric or "range_error_rms_m", where)
    else:
        if metric is not None or where:
            raise BadInput("--metric and --where require --what map")
        from harness.log.figure import picture

        flights = flights_of(places)
        try:
            figure, shows = picture(flights, what), ", ".join(flights)
        except ValueError as error:
            raise BadInput(str(error)) from None
    with replacing(save) as partial_file:
        write(figure, partial_file, save.suffix.lower())
    click.echo(f"{save}: {shows}")


def _map(folder: Path, metric: str, where: tuple[str, ...]) -> tuple[Picture, str]:
    """The maps of a run as a figure, and what they are. Raises `BadInput`."""
    from harness.cli._comparison import wanted
    from harness.cli._input import BadInput
    from harness.comparison import chosen
    from harness.drawing import COLUMN, PAGE, picture
    from harness.limit_cycle.predicted import MARGIN
    from harness.runs.comparable import comparable
    from harness.runs.journal import StoreError
    from harness.settings import SettingsError
    from harness.verdict import figures, grid
    from harness.verdict.following import with_predicted
    from harness.verdict.pairs import CompareError, axes, entered, spread

    if not folder.is_dir():
        raise BadInput(f"{folder}: must be a folder that `harness run` wrote")
    try:
        flights, assess, *_ = comparable([folder])
        table = entered(with_predicted(chosen(flights, wanted(where)), [MARGIN]), assess.circling_error)
        varies = axes(spread(table))
        grids = grid.maps(table, varies, metric)
    except (StoreError, SettingsError, CompareError) as error:
        text = str(error)
        raise BadInput(text if text.startswith(str(folder)) else f"{folder}: {text}") from None
    if not grids:
        raise BadInput(
            f"{folder}: a map takes two settings with numeric values, flown on a grid; these vary: "
            + (", ".join(varies) or "-")
        )
    if not any(cell.value == cell.value for each in grids for cell in each.cells.values()):
        raise BadInput(f"{folder}: no flight here has {metric}")
    if len(grids) > figures.MOST_MAPS:
        fixed = ", ".join(f"{axis} ({len(varies[axis])})" for axis in grids[0].at)
        raise BadInput(f"{folder}: makes {len(grids)} maps, one for each {fixed}; choose with --where KEY=VALUE")
    across = min(len(grids), figures.MOST_ACROSS)
    width = COLUMN if across == 1 else PAGE
    height = 0.5 + -(-len(grids) // across) * (0.85 * width / across + 0.1 * len(grids[0].at))
    shows = f"{metric} by {grids[0].rows[0]} and {grids[0].columns[0]}, {len(grids)} map{'s' * (len(grids) > 1)}"
    return picture(partial(figures.heat_maps, grids=grids), width, height), shows
