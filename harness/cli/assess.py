"""`harness assess`: judges the coordinated-flight assumption on the log of a real flight."""

from __future__ import annotations

import math
from pathlib import Path

import click

from harness.cli._paths import PATH


@click.command()
@click.argument("logs", metavar="LOG...", nargs=-1, required=True, type=PATH)
@click.option("--map", "map_name", metavar="FILE.toml|NAME", help="Which column of a CSV is what; see the guide.")
@click.option("--from", "begin", type=float, default=-math.inf, help="Ignore the log before this time, s.")
@click.option("--to", "end", type=float, default=math.inf, help="Ignore the log after this time, s.")
@click.option(
    "--fit",
    type=PATH,
    metavar="FILE.toml",
    help="Write an aircraft fitted to this flight, for the plants lagged and coordinated.",
)
@click.option("--airframe", metavar="NAME", help="Fly this airframe's 6-DOF model for comparison: a name or a folder.")
@click.option("--rrd", type=PATH, help="Write a Rerun recording to this file.")
@click.option("--out", type=PATH, metavar="PAGE.html", help="Write the assessment, with figures, as one HTML page.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of tables.")
def assess(
    logs: tuple[Path, ...],
    map_name: str | None,
    begin: float,
    end: float,
    fit: Path | None,
    airframe: str | None,
    rrd: Path | None,
    out: Path | None,
    as_json: bool,
) -> None:
    """Judge the coordinated-flight assumption on the log of a real flight.

    LOG is a ULog file (PX4), a DataFlash file (ArduPilot), or CSV files of one flight; a folder stands for the logs in
    it. Prints each channel: its true update rate, since logs repeat rows; whether it was measured, estimated by a
    filter, commanded or derived; and the defects of the log. Then the verdict on each part of the assumption, with the
    terms and margins of harness compare and an interval over independent windows of flight; and what cannot be judged,
    with the reason. The time is in seconds since the log's first row.

    With --airframe the 6-DOF model of that airframe is flown with the recorded bank, at the recorded airspeed and in
    the recorded wind, and judged in the same way.

    With --fit the identified response of bank or heading rate to its command is written to a file, which stands for an
    aircraft in settings (aircraft = "FILE.toml"): fly and predict use it on the plant lagged, and on coordinated where
    the log has a bank command. It is refused if the log does not excite the response enough.

    \b
    Examples:
      harness assess flight.ulg --from 60 --to 300
      harness assess alfa/ --map alfa --rrd flight.rrd --out flight.html
      harness assess flight.bin --fit my_flight.toml
    """
    import json

    from harness.checks import airframe_of
    from harness.cli._input import BadInput, typed
    from harness.cli._paths import writable
    from harness.files import write_text
    from harness.plants.identified import read
    from harness.recorded import contents, fitted_plant, said
    from harness.recorded.assessment import assess as assessed
    from harness.recorded.beside import beside
    from harness.recorded.read import read_log

    if not begin < end:
        raise BadInput(f"--from {begin:g} --to {end:g}: the first must be less than the second")
    written = [writable(path) for path in (fit, rrd, out) if path is not None]
    if len({path.resolve() for path in written}) < len(written):
        raise BadInput("--fit, --rrd and --out: must be different files")
    if fit is not None:
        _check_fit(fit)
    whole = read_log(logs, map_name)
    flight = whole.between(begin, end)
    if not flight.channels:
        raise BadInput(f"--from {begin:g} --to {end:g}: the log goes from {whole.begin:.2f} to {whole.end:.2f} s")
    try:
        model_of = None if airframe is None else airframe_of(airframe)
    except ValueError as error:
        raise BadInput(f"--airframe: {error}") from None
    found = assessed(whole, begin, end)
    model = None if model_of is None else beside(found, model_of)
    if rrd is not None:
        from harness.recorded.recording import write_recording_of

        write_recording_of(rrd, whole, found, typed())
    if out is not None:
        from harness.recorded.page import page

        write_text(out, page(whole, found, typed(), model))
    if as_json:
        told = {**contents.as_json(flight), "assessment": said.as_json(found)}
        if model:
            told["model"] = {"airframe": model.airframe, "ended": model.ended, **said.as_json(model.assessment)}
        click.echo(json.dumps(told, indent=2))
    else:
        for line in (*contents.contents(flight), "", *said.lines(found)):
            click.echo(line)
        if model:
            for line in ("", *said.beside_lines(found, model)):
                click.echo(line)
    if fit is not None:  # last: a refusal loses nothing of the above
        write_text(fit, fitted_plant.document(found))
    if fit and not as_json:
        plants = "plants lagged and coordinated" if read(fit)[0].bank else "plant lagged"
        click.echo(f"\naircraft = {json.dumps(str(fit))}: for the {plants}")


def _check_fit(fit: Path) -> None:
    """BadInput for a name that no aircraft has, or the name of a file that is none."""
    from harness.cli._input import BadInput
    from harness.plants.identified import IdentifiedError, read

    if fit.suffix != ".toml":
        raise BadInput(f"--fit {fit}: must end with .toml")
    try:
        if fit.exists():
            read(fit)
    except IdentifiedError:
        raise BadInput(f"--fit {fit}: exists and is not a file of --fit; choose another name") from None
