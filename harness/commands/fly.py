"""`harness fly`: one flight."""

from collections.abc import Mapping
from pathlib import Path

import click


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="Override a setting; may be repeated.")
@click.option("--rrd", type=click.Path(path_type=Path), help="Write a Rerun recording there.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout instead of the table.")
def fly(file: Path, overrides: tuple[str, ...], rrd: Path | None, as_json: bool) -> None:
    """Fly the flight that FILE describes, and print its metrics.

    \b
    Examples:
      harness fly experiments/stationary.toml --rrd flight.rrd
      harness fly experiments/stationary.toml --set plant=kinematic --set law.name=smc --set law.gains=paper --json
    """
    import json
    import math

    from harness.commands.telling import BadInput, feasibility_line, number, read_flight_file, writable
    from harness.flight import feasibility_margin, warnings
    from harness.key import flight_key
    from harness.metrics import MEANING, metrics
    from harness.settings import document
    from harness.simulation import simulate

    _, flight = read_flight_file(file, overrides)
    if rrd is not None:
        writable(rrd)
    click.echo(feasibility_line(flight), err=as_json)
    for warning in warnings(flight):
        click.echo(f"warning: {warning}", err=True)
    log = simulate(flight)
    judged = metrics(log)
    margin = math.degrees(feasibility_margin(flight))
    result = {
        "key": flight_key(flight),
        "outcome": log.outcome.value,
        "reason": log.reason,
        "digest": log.digest,
        "flight": document(flight),
        "metrics": judged,
        "feasibility_margin_deg_s": margin if math.isfinite(margin) else None,  # none without a limit
    }
    if rrd is not None:
        from harness.review.recording import write_recording

        rows = "\n".join(f"| {name} | {number(value)} |" for name, value in judged.items())
        set_to = json.dumps(result["flight"], indent=1)
        notes = f"{feasibility_line(flight)}\n\n| metric | |\n|---|---|\n{rows}\n\n```json\n{set_to}\n```"
        try:
            write_recording(rrd, {flight.plant: log}, file.stem, notes)
        except OSError as error:
            raise BadInput(f"{rrd}: cannot be written: {error.strerror or error}") from None
    if as_json:
        click.echo(json.dumps(result, allow_nan=False))
    else:
        _tell(result, {name: (number(value), MEANING[name]) for name, value in judged.items()})
    raise SystemExit(1 if log.outcome.failed else 0)


def _tell(result: Mapping[str, object], rows: dict[str, tuple[str, str]]) -> None:
    for name, (value, meaning) in rows.items():
        click.echo(f"  {name:30}{value:>9}  {click.style(meaning, dim=True)}")
    reason = f": {result['reason']}" if result["reason"] else ""
    click.echo(f"{result['outcome']}{reason}")
    click.echo(f"key {result['key']}  digest {result['digest']}")
