"""`harness fly`: one flight, of a file or of a row."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from harness.cli._paths import PATH, PATH_OR_ROW
from harness.cli._setting import SETTING

if TYPE_CHECKING:
    from collections.abc import Callable

    from harness.flight import Flight
    from harness.log import FlightLog
    from harness.review.live import Live
    from harness.runs.recall import Recalled, RowAddress
    from harness.runs.row import FlightResult, FlightRow


@click.command()
@click.argument("what", metavar="FILE|DIR:KEY", type=PATH_OR_ROW)
@click.option(
    "--set", "overrides", multiple=True, type=SETTING, metavar="KEY=VALUE", help="Override a setting; repeatable."
)
@click.option("--rrd", type=PATH, help="Write a Rerun recording to this file.")
@click.option("--live", is_flag=True, help="Stream the flight to an open viewer, `harness view`.")
@click.option(
    "--pace", type=click.FloatRange(0, min_open=True), help="Speed of --live, in times real time.  [default: 1]"
)
@click.option("--port", type=click.IntRange(1, 65535), help="Port of the viewer, for --live.  [default: 9876]")
@click.option("--against", metavar="DIR:KEY", type=PATH_OR_ROW, help="Compare with this flight of a run.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of the table.")
def fly(
    what: str,
    overrides: tuple[str, ...],
    rrd: Path | None,
    live: bool,
    pace: float | None,
    port: int | None,
    against: str | None,
    as_json: bool,
) -> None:
    """Fly one flight and print its metrics.

    FILE describes the flight; DIR:KEY is a flight of a run, flown again and compared with what is stored, where the
    beginning of the key is enough. Prints whether the circle can be held, what is flown, how it ended, a table of
    metrics, the outcome, the key and the digest; warnings go to standard error. With --against also which settings
    differ from those of an earlier flight, and each metric's difference to it. Exit code 1 when the computation failed.

    \b
    Examples:
      harness fly experiments/stationary.toml --rrd flight.rrd
      harness fly experiments/stationary.toml --set plant=kinematic --set law.name=smc --set law.gains=paper --json
      harness fly experiments/stationary.toml --live --pace 10
      harness fly out/wind:3f2a --set wind.steady_mps=[0.0,0.0] --against out/wind:3f2a
    """
    from harness.cli._input import BadInput, flight_of, read_file, typed
    from harness.cli._paths import writable
    from harness.feasibility import feasibility_line, warnings
    from harness.key import identity
    from harness.runs.description import changes, ending, flown, metric_lines
    from harness.runs.recall import row_address
    from harness.runs.row import json_of, result_of, row
    from harness.settings.laws import source_of
    from harness.settings.tried import slowness

    if against is not None and as_json:
        raise BadInput("--against and --json exclude each other")
    if not live and (pace is not None or port is not None):
        raise BadInput("--pace and --port require --live")
    place = row_address(what)
    if not place and Path(what).is_dir():
        raise BadInput(f"{what}: is a folder; a flight in it is {what}:KEY, and `harness show {what}` lists the keys")
    recalled = _recalled(place) if place else None
    settings = recalled.file(what, overrides) if recalled else read_file(Path(what), overrides)
    flight = flight_of(settings)
    earlier = _earlier(against) if against is not None else None
    if rrd is not None:
        writable(rrd)
    stream = _stream(flight.plant, Path(what).stem, pace, port) if live else None
    this = identity(flight)
    click.echo(feasibility_line(flight), err=as_json)
    click.echo(flown(this.settings), err=as_json)
    own = source_of(flight.law) is not None
    for warning in [*warnings(flight, of_circle=False), *(slowness(flight) if own else ())]:
        click.echo(f"warning: {warning}", err=True)
    log = log_of(flight, stream)
    if stream:
        stream.finish(log, typed())
        if stream.gone:
            click.echo("warning: the viewer was closed during the flight", err=True)
    result = result_of(log)
    flight_row = row(flight, this, result)
    if recalled and not overrides:
        flight_row.update(key=recalled.stored.row["key"], flight=recalled.stored.row["flight"])
        _compare(recalled, result)
    if rrd is not None:
        from harness.review.recording import write_recording

        write_recording(rrd, {flight.plant: log}, Path(what).stem, command=typed())
    if as_json:
        click.echo(json_of(flight_row))
    else:
        for line in ending(flight_row):
            click.echo(line)
        if earlier:
            differing = changes(flight_row["flight"], earlier["flight"])
            told = [f"{key} {now} instead of {then}" for key, (now, then) in differing.items()] or ["the same settings"]
            if log.outcome != earlier["outcome"]:
                told.append(f"{log.outcome} instead of {earlier['outcome']}")
            click.echo(f"against flight {earlier['key'][:8]}: {', '.join(told)}")
        for line in metric_lines(flight_row["metrics"], earlier and earlier["metrics"]):
            click.echo(line)
        click.echo(f"outcome: {log.outcome}{f': {log.reason}' if log.reason else ''}")
        click.echo(f"key {flight_row['key']}  digest {flight_row['digest']}")
    raise SystemExit(1 if log.outcome.failed else 0)


def log_of(flight: Flight, stream: Live | None = None) -> FlightLog:
    """The flight, flown. A user's law or a third-party model is watched or isolated, so that it cannot hang."""
    from harness.checks import model_of_another
    from harness.runs import apart
    from harness.settings.laws import source_of

    own = source_of(flight.law) is not None
    return _watched(flight, stream) if own and model_of_another(flight) is None else apart.fly(flight, stream)


def _watched(flight: Flight, stream: Live | None) -> FlightLog:
    """The flight of a user-defined law, which may hang: that ends it."""
    from harness.loop import simulate
    from harness.settings import tried

    with tried.within(tried.ANSWERS_WITHIN) as anew:

        def watch(time: float, so_far: Callable[[], FlightLog]) -> None:
            if stream:
                stream(time, so_far)
            anew()

        return simulate(flight, watch)


def _stream(name: str, title: str, pace: float | None, port: int | None) -> Live:
    """The stream to the viewer that is open. Raises `BadInput` when there is none."""
    from harness.cli._input import BadInput
    from harness.review.live import Live
    from harness.review.viewer import PORT, ViewerError

    try:
        return Live(name, title, pace or 1.0, port or PORT)
    except ViewerError as error:
        raise BadInput(str(error)) from None


def _earlier(text: str) -> FlightRow:
    """The row of an earlier flight."""
    from harness.cli._input import BadInput
    from harness.runs.journal import StoreError
    from harness.runs.recall import row_address
    from harness.runs.store import find

    place = row_address(text)
    if place is None:
        raise BadInput(
            f"--against {text}: must be DIR:KEY, a folder that `harness run` wrote and the beginning of a key"
        )
    try:
        return find(*place).row
    except StoreError as error:
        raise BadInput(f"--against {text}: {error}") from None


def _recalled(place: RowAddress) -> Recalled:
    from harness.cli._input import BadInput
    from harness.runs.journal import StoreError
    from harness.runs.recall import recall

    try:
        return recall(place)
    except StoreError as error:
        raise BadInput(str(error)) from None


def _compare(recalled: Recalled, result: FlightResult) -> None:
    """Reports whether the flight is bit-identical to the stored one."""
    from harness.runs.recall import deviation

    if not recalled.digest:
        click.echo(
            f"the stored flight ended in {recalled.stored.row['outcome']} and has no digest to compare with", err=True
        )
    elif apart := deviation(recalled.stored, result):
        click.echo(f"warning: differs from the stored flight ({recalled.changes}): {apart}", err=True)
    else:
        click.echo("the same flight as stored, to the last bit", err=True)
