"""The description of a flight of a run: what was flown, how it ended, its metrics, and where it comes from."""

import json
import math
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

from autopilot.laws import LAWS
from harness.log.metric import METRICS, Value, window_in_words
from harness.plants.ladder import PLANTS
from harness.plants.plant import Outcome
from harness.runs.recordings import recording_path
from harness.runs.store import Stored
from harness.settings import document, flight_from_document
from harness.settings.columns import by_column
from harness.settings.laws import loaded_kind, short
from harness.tables import number, table


def description(folder: Path, stored: Stored, varying: Collection[str] = ()) -> Iterator[str]:
    """The lines that `harness show DIR:KEY` prints; settings that are `varying` in the run are shown in any case."""
    row, run, settings = stored.row, stored.run, stored.row["flight"]
    yield f"flight {row['key']}"
    yield from (text for text in (run["title"], run["question"]) if text)
    yield ""
    yield flown(settings)
    yield _circle(row, settings)
    yield from ending(row)
    yield ""
    yield from metric_lines(row["metrics"])
    yield ""
    yield f"settings that differ from their defaults{', or vary in this run' if varying else ''}:"
    own = _own_settings(settings, varying)
    yield from table([], ([f"  {key}", json.dumps(value)] for key, value in own.items()))
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


def metric_lines(metrics: Mapping[str, Value], earlier: Mapping[str, Value] | None = None) -> Iterator[str]:
    """A flight's metrics: a table of name, value, unit and meaning; then over which part its circling was judged.

    With those of an `earlier` flight, its values and the differences are beside them.
    """
    rows = []
    for name, value in metrics.items():
        metric = METRICS.get(name)  # none for one that an earlier version knew
        beside = [] if earlier is None else [number(earlier.get(name)), _difference(value, earlier.get(name))]
        rows.append([name, number(value), *beside, metric.unit if metric else "", metric.meaning if metric else ""])
    beside = [] if earlier is None else ["earlier", "difference"]
    yield from table(["metric", "value", *beside, "unit", "meaning"], rows, "lrrrl" if beside else "lrl")
    yield from (sentence for sentence in [window_in_words(metrics)] if sentence)


def flown(settings: Mapping[str, Any]) -> str:
    """The flight in one line: law, plant, airframe, length and air."""
    law, plant = settings["law"], settings["plant"]
    airframe = f" {settings['aircraft']}" if PLANTS[plant].has_airframe else ""
    single = "".join(f", {gain} = {value:g}" for gain, value in _single_gains(law).items())
    kind, gains = loaded_kind(law["name"]), law.get("gains")
    by_rule = "by the rule " if kind and gains in kind.rules else ""
    with_gains = f" with gains {by_rule}{gains}" if gains else ""
    return (
        f"law {short(law['name'])}{with_gains}{single}, on plant {plant}{airframe}, for "
        f"{settings['duration_s']:g} s in {_air(settings['wind'])}, seed {settings['seed']}"
    )


def ending(row: Mapping[str, Any]) -> Iterator[str]:
    """How a flight ended, in sentences."""
    reason = f": {row['reason']}" if row["reason"] else ""
    yield f"{Outcome(row['outcome']).sentence}{reason}."
    if row["outcome"] == Outcome.COMPLETED:
        settled, tolerance = row["metrics"]["convergence_time_s"], row["flight"]["metrics"]["tolerance_m"]
        yield (
            f"The flight did not settle on its circle within {tolerance:g} m."
            if settled is None
            else f"The flight settled on its circle within {tolerance:g} m in {number(settled)} s."
        )
    if infeasible := row["metrics"].get("infeasible_s"):  # none in a row of an earlier version
        yield f"For {infeasible:.4g} s the circle was infeasible: wind and target required more than the command limit."


def changes(now: Mapping[str, Any], then: Mapping[str, Any]) -> dict[str, tuple[object, object]]:
    """The settings that two flights do not share, by dotted key: the value now and then."""
    now, then = by_column(now), by_column(then)
    return {key: (now.get(key), then.get(key)) for key in dict.fromkeys([*now, *then]) if now.get(key) != then.get(key)}


def _difference(value: Value, earlier: Value) -> str:
    if value is None or earlier is None or isinstance(value, bool):
        return "-" if value is None or value != earlier else "0"
    return f"{value - earlier:+.3g}" if value != earlier else "0"


def _single_gains(law: Mapping[str, Any]) -> dict[str, float]:
    """The gains that are not those of the named set; of a rule those that it gave."""
    kind = loaded_kind(law["name"])
    named = kind.numbers(law["gains"]) if kind and "gains" in law else {}
    return {gain: law[gain] for gain, value in named.items() if law[gain] != value}


def _circle(row: Mapping[str, Any], settings: Mapping[str, Any]) -> str:
    law = settings["law"]
    margin = row["feasibility_margin_deg_s"]
    limit = f"{float(law['max_heading_rate_deg_s']):g} deg/s"
    if margin is None:
        held = ""
    elif margin == -math.inf:
        held = ": INFEASIBLE, it cannot be held at any heading rate"
    else:
        held = f": {'feasible' if margin >= 0 else 'INFEASIBLE'}, margin {margin:+.2f} deg/s"
    return f"circle of {law['standoff_m']:g} m with a heading-rate limit of {limit}{held}"


def _own_settings(settings: Mapping[str, Any], varying: Collection[str]) -> dict[str, object]:
    """Plant, law, the settings `varying`, and every one whose value is not the default of plant and law, by its key."""
    name = settings["law"]["name"]
    chosen = {"plant": settings["plant"], "law": {"name": name if name in LAWS else "nftsm"}}
    default = document(flight_from_document(chosen))
    if name not in LAWS:  # its code is not here, or not run to know its defaults
        default["law"] = {}
    default = by_column(default)
    return {
        key: value
        for key, value in by_column(settings).items()
        if key in ("plant", "law.name", *varying) or value != default.get(key)
    }


def _air(wind: Mapping[str, Any]) -> str:
    """The air of the flight, in words."""
    north, east = wind["steady_mps"]
    parts = [f"wind of {north:g} m/s towards north and {east:g} m/s towards east"] if north or east else []
    parts += ["shear"] if any(wind["shear_mps_per_m"]) else []
    parts += ["gusts"] if wind["gusts"] else []
    parts += [f"{wind['turbulence']} turbulence"] if wind["turbulence"] != "none" else []
    return ", ".join(parts) or "still air"
