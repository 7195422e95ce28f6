"""A row of a run told in words."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from harness.metric import METRICS, window_in_words
from harness.plants.ladder import PLANTS
from harness.plants.plant import Outcome
from harness.runs.recordings import recording_path
from harness.runs.store import Stored
from harness.settings import document, flight_from_document
from harness.settings.columns import by_column
from harness.tables import number, table


def story(folder: Path, stored: Stored) -> Iterator[str]:
    """Settings, metrics, end and origin, in lines."""
    row, run, settings = stored.row, stored.run, stored.row["flight"]
    law = settings["law"]
    yield f"flight {row['key']}"
    if run["title"]:
        yield f"of {run['title']!r}: {run['question']}"
    what = (
        settings["plant"]
        if not PLANTS[settings["plant"]].has_airframe
        else f"{settings['plant']} {settings['aircraft']}"
    )
    yield (
        f"{law['name']} ({law['gains']}) on {what}, {settings['duration_s']:g} s in {_air(settings['wind'])}, "
        f"seed {settings['seed']}, "
        f"to circle at {law['standoff_m']:g} m with {law['max_heading_rate_deg_s']} deg/s at most"
    )
    margin = row["feasibility_margin_deg_s"]
    if margin is not None:
        yield f"The circle is {'feasible' if margin >= 0 else 'INFEASIBLE'}, by a margin of {margin:+.2f} deg/s."
    reason = f": {row['reason']}" if row["reason"] else ""
    yield f"{Outcome(row['outcome']).sentence}{reason}."
    converged = row["metrics"]["convergence_time_s"]
    if row["outcome"] == "completed":
        tolerance = settings["metrics"]["tolerance_m"]
        yield (
            f"It settled to {tolerance:g} m in {converged:g} s."
            if converged is not None
            else f"It did not settle to {tolerance:g} m."
        )
    if judged := window_in_words(row["metrics"]):
        yield judged
    yield ""
    known = ((name, value, METRICS.get(name)) for name, value in row["metrics"].items())  # None: of an earlier version
    named = ([name, number(value), metric.meaning if metric else ""] for name, value, metric in known)
    yield from (f"  {line}" for line in table([], named, "lrl"))
    yield ""
    yield "settings that are not the default's:"
    columns = by_column(settings)
    usual = by_column(document(flight_from_document({"plant": settings["plant"], "law": {"name": law["name"]}})))
    for name, value in columns.items():
        if name in ("plant", "law.name") or value != usual.get(name):
            yield f"  {name} = {json.dumps(value)}"
    yield ""
    dirty = {None: "", 0: "", 1: ", with changes"}[run["git_dirty"]]
    yield f"flown by: {run['command']}"
    yield f"at {run['started']}, commit {run['git_commit'] or 'unknown'}{dirty}"
    yield f"on {run['platform']}, Python {run['python']}"
    if stored.seconds is not None:
        yield f"in {stored.seconds:.3g} s; digest {row['digest'] or 'none'}"
    path = recording_path(folder, row["key"])
    yield (
        f"recording: {path}"
        if path.is_file()
        else f"to record it: harness fly {folder}:{row['key'][:8]} --rrd flight.rrd"
    )


def _air(wind: Mapping[str, Any]) -> str:
    """What the flight meets, in words."""
    north, east = wind["steady_mps"]
    met = [f"wind of {north:g} m/s north, {east:g} m/s east"] if north or east else []
    met += ["shear"] if any(wind["shear_mps_per_m"]) else []
    met += ["gusts"] if wind["gusts"] else []
    met += [f"{wind['turbulence']} turbulence"] if wind["turbulence"] != "none" else []
    return " and ".join(met) or "still air"
