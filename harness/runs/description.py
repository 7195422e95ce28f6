"""The description of a flight of a run: what was flown, how it ended, its metrics, and where it comes from."""

import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from harness.log.metric import METRICS, Value, window_in_words
from harness.plants.ladder import PLANTS
from harness.plants.plant import Outcome
from harness.runs.recordings import recording_path
from harness.runs.store import Stored
from harness.settings import document, flight_from_document
from harness.settings.columns import by_column
from harness.tables import number, table


def description(folder: Path, stored: Stored) -> Iterator[str]:
    """The lines that `harness show DIR:KEY` prints."""
    row, run, settings = stored.row, stored.run, stored.row["flight"]
    yield f"flight {row['key']}"
    yield from (text for text in (run["title"], run["question"]) if text)
    yield ""
    yield from _flight_lines(row, settings)
    yield ""
    yield from metric_lines(row["metrics"])
    yield ""
    yield "settings that differ from their defaults:"
    yield from table([], ([f"  {key}", json.dumps(value)] for key, value in _own_settings(settings).items()))
    yield ""
    changes = ", with uncommitted changes" if run["git_dirty"] else ""
    path = recording_path(folder, row["key"])
    recorded = path if path.is_file() else f"none; to write one: harness fly {folder}:{row['key'][:8]} --rrd flight.rrd"
    origin = {
        "command": run["command"],
        "started": run["started"],
        "code": f"commit {run['git_commit'] or 'unknown'}{changes}",
        "platform": f"{run['platform']}, Python {run['python']}",
        "wall time": f"{number(stored.seconds)} s" if stored.seconds is not None else "unknown",
        "digest": row["digest"] or "none",
        "recording": recorded,
    }
    yield from table([], ([f"{what}:", str(value)] for what, value in origin.items()))


def metric_lines(metrics: Mapping[str, Value]) -> Iterator[str]:
    """A flight's metrics: a table of name, value, unit and meaning; then over which part its circling was judged."""
    rows = []
    for name, value in metrics.items():
        metric = METRICS.get(name)  # none for one that an earlier version knew
        rows.append([name, number(value), metric.unit if metric else "", metric.meaning if metric else ""])
    yield from table(["metric", "value", "unit", "meaning"], rows, "lrll")
    yield from (sentence for sentence in [window_in_words(metrics)] if sentence)


def _flight_lines(row: Mapping[str, Any], settings: Mapping[str, Any]) -> Iterator[str]:
    law, plant = settings["law"], settings["plant"]
    airframe = f" {settings['aircraft']}" if PLANTS[plant].has_airframe else ""
    yield (
        f"law {law['name']} with gains {law['gains']}, on plant {plant}{airframe}, for {settings['duration_s']:g} s "
        f"in {_air(settings['wind'])}, seed {settings['seed']}"
    )
    margin = row["feasibility_margin_deg_s"]
    limit = f"{float(law['max_heading_rate_deg_s']):g} deg/s"
    if margin is None:
        held = ""
    elif margin == -math.inf:
        held = ": INFEASIBLE, it cannot be held at any heading rate"
    else:
        held = f": {'feasible' if margin >= 0 else 'INFEASIBLE'}, margin {margin:+.2f} deg/s"
    yield f"circle of {law['standoff_m']:g} m with a heading-rate limit of {limit}{held}"
    reason = f": {row['reason']}" if row["reason"] else ""
    yield f"{Outcome(row['outcome']).sentence}{reason}."
    if row["outcome"] == Outcome.COMPLETED:
        settled, tolerance = row["metrics"]["convergence_time_s"], settings["metrics"]["tolerance_m"]
        yield (
            f"The flight did not settle on its circle within {tolerance:g} m."
            if settled is None
            else f"The flight settled on its circle within {tolerance:g} m in {number(settled)} s."
        )


def _own_settings(settings: Mapping[str, Any]) -> dict[str, object]:
    """The plant, the law, and every setting whose value is not the default of both, by its dotted key."""
    chosen = {"plant": settings["plant"], "law": {"name": settings["law"]["name"]}}
    default = by_column(document(flight_from_document(chosen)))
    return {
        key: value
        for key, value in by_column(settings).items()
        if key in ("plant", "law.name") or value != default.get(key)
    }


def _air(wind: Mapping[str, Any]) -> str:
    """What the flight meets, in words."""
    north, east = wind["steady_mps"]
    parts = [f"wind of {north:g} m/s towards north and {east:g} m/s towards east"] if north or east else []
    parts += ["shear"] if any(wind["shear_mps_per_m"]) else []
    parts += ["gusts"] if wind["gusts"] else []
    parts += [f"{wind['turbulence']} turbulence"] if wind["turbulence"] != "none" else []
    return ", ".join(parts) or "still air"
