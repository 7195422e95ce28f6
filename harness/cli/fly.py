"""`harness fly`: one flight, of a file or of a row."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from harness.cli._paths import PATH, PATH_OR_ROW

if TYPE_CHECKING:
    from harness.review.live import Live
    from harness.runs.recall import Recalled, RowAddress
    from harness.runs.row import FlightResult


@click.command()
@click.argument("what", metavar="FILE|DIR:KEY", type=PATH_OR_ROW)
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="Override a setting; repeatable.")
@click.option("--rrd", type=PATH, help="Write a Rerun recording to this file.")
@click.option("--live", is_flag=True, help="Stream the flight to an open viewer, `harness view`.")
@click.option(
    "--pace", type=click.FloatRange(0, min_open=True), help="Speed of --live, in times real time.  [default: 1]"
)
@click.option("--port", type=click.IntRange(1, 65535), help="Port of the viewer, for --live.  [default: 9876]")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of the table.")
def fly(
    what: str,
    overrides: tuple[str, ...],
    rrd: Path | None,
    live: bool,
    pace: float | None,
    port: int | None,
    as_json: bool,
) -> None:
    """Fly one flight and print its metrics.

    FILE describes the flight; DIR:KEY is a flight of a run, flown again and compared with what is stored, where the
    beginning of the key is enough. Prints whether the circle can be held, a table of metrics, the outcome, the key
    and the digest; warnings go to standard error. Exit code 1 when the computation failed.

    \b
    Examples:
      harness fly experiments/stationary.toml --rrd flight.rrd
      harness fly experiments/stationary.toml --set plant=kinematic --set law.name=smc --set law.gains=paper --json
      harness fly experiments/stationary.toml --live --pace 10
      harness fly out/wind:3f2a --set wind.steady_mps=[0.0,0.0]
    """
    from harness.cli._input import BadInput, flight_of, read_file, typed
    from harness.cli._paths import writable
    from harness.feasibility import feasibility_line, warnings
    from harness.key import identity
    from harness.loop import simulate
    from harness.runs.description import metric_lines
    from harness.runs.recall import row_address
    from harness.runs.row import json_of, result_of, row

    if not live and (pace is not None or port is not None):
        raise BadInput("--pace and --port require --live")
    place = row_address(what)
    if not place and Path(what).is_dir():
        raise BadInput(f"{what}: is a folder; a flight in it is {what}:KEY, and `harness show {what}` lists the keys")
    recalled = _recalled(place) if place else None
    settings = recalled.file(what, overrides) if recalled else read_file(Path(what), overrides)
    flight = flight_of(settings)
    if rrd is not None:
        writable(rrd)
    stream = _stream(flight.plant, Path(what).stem, pace, port) if live else None
    click.echo(feasibility_line(flight), err=as_json)
    for warning in warnings(flight):
        click.echo(f"warning: {warning}", err=True)
    log = simulate(flight, stream)
    if stream:
        stream.finish(log, typed())
        if stream.gone:
            click.echo("warning: the viewer was closed during the flight", err=True)
    result = result_of(log)
    flight_row = row(flight, identity(flight), result)
    if recalled and not overrides:
        flight_row.update(key=recalled.stored.row["key"], flight=recalled.stored.row["flight"])
        _compare(recalled, result)
    if rrd is not None:
        from harness.review.recording import write_recording

        write_recording(rrd, {flight.plant: log}, Path(what).stem, command=typed())
    if as_json:
        click.echo(json_of(flight_row))
    else:
        for line in metric_lines(flight_row["metrics"]):
            click.echo(line)
        click.echo(f"outcome: {log.outcome}{f': {log.reason}' if log.reason else ''}")
        click.echo(f"key {flight_row['key']}  digest {flight_row['digest']}")
    raise SystemExit(1 if log.outcome.failed else 0)


def _stream(name: str, title: str, pace: float | None, port: int | None) -> Live:
    """The stream to the viewer that is open. Raises `BadInput` when there is none."""
    from harness.cli._input import BadInput
    from harness.review.live import Live
    from harness.review.viewer import PORT, ViewerError

    try:
        return Live(name, title, pace or 1.0, port or PORT)
    except ViewerError as error:
        raise BadInput(str(error)) from None


def _recalled(place: RowAddress) -> Recalled:
    from harness.cli._input import BadInput
    from harness.runs.recall import recall
    from harness.runs.store import StoreError

    try:
        return recall(place)
    except StoreError as error:
        raise BadInput(str(error)) from None


def _compare(recalled: Recalled, result: FlightResult) -> None:
    """Says whether the flight is the stored one, to the last bit."""
    from harness.runs.recall import deviation

    if not recalled.digest:
        click.echo(
            f"the stored flight ended in {recalled.stored.row['outcome']} and has no digest to compare with", err=True
        )
    elif apart := deviation(recalled.stored, result):
        click.echo(f"warning: differs from the stored flight ({recalled.changes}): {apart}", err=True)
    else:
        click.echo("the same flight as stored, to the last bit", err=True)
