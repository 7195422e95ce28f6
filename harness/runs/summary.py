"""The table at the end of a run: a line for each combination of the axes, over its seeds."""

import json
import statistics
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

from harness.runs.matrix import Matrix
from harness.runs.results import flat_settings
from harness.runs.store import reading

SHOWN: Mapping[str, tuple[str, str, float]] = MappingProxyType(
    {  # heading, unit, how many of them make the metric's own unit
        "convergence_time_s": ("settles", "s", 1.0),
        "range_error_rms_m": ("error", "m rms", 1.0),
        "range_error_peak_m": ("error", "m peak", 1.0),
        "saturation_fraction": ("saturated", "%", 100.0),
        "command_activity_deg_s2": ("activity", "deg/s2", 1.0),
        "bank_peak_deg": ("bank", "deg peak", 1.0),
        "sideslip_peak_deg": ("sideslip", "deg peak", 1.0),
    }
)


class Line(NamedTuple):
    """Flights alike but for what is drawn."""

    labels: tuple[str, ...]  # the value of each axis
    flights: int
    settled: int  # of them
    outcomes: Mapping[str, int]
    medians: Mapping[str, float | None]  # of those that have the metric


def summary(matrix: Matrix, folder: Path) -> tuple[list[str], list[Line]]:
    """The axes that lines are grouped by, and the lines, in the order of the matrix; flights of its positions only."""
    axes = [key for key in _axes(matrix) if key != "seed"]
    values: dict[tuple[str, ...], dict[str, list[float]]] = {}
    outcomes: dict[tuple[str, ...], dict[str, int]] = {}
    with reading(folder) as journal:
        rows = journal.execute(
            "SELECT f.outcome, f.settings, f.metrics FROM positions p JOIN flights f USING (key) "
            "WHERE p.matrix = ? ORDER BY p.position",
            (matrix.identifier,),
        )
        for outcome, settings, metrics in rows:
            flat, judged = flat_settings(json.loads(settings)), json.loads(metrics)
            label = tuple(_shown(flat.get(key)) for key in axes)
            count = outcomes.setdefault(label, {})
            count[outcome] = count.get(outcome, 0) + 1
            kept = values.setdefault(label, {name: [] for name in SHOWN})
            for name in SHOWN:
                if judged.get(name) is not None:
                    kept[name].append(judged[name])
    lines = []
    for label, kept in values.items():
        medians = {name: statistics.median(found) if found else None for name, found in kept.items()}
        count = outcomes[label]
        lines.append(Line(label, sum(count.values()), len(kept["convergence_time_s"]), count, medians))
    return axes, lines


def _axes(matrix: Matrix) -> list[str]:
    """The keys that vary and are not drawn."""
    several = len(matrix.blocks) > 1  # an included flight may differ from the matrix in a key of one value
    axes = [key for keys, count in matrix.varies.items() if several or count > 1 for key in keys.split(", ")]
    return [key for key in dict.fromkeys(axes) if key not in matrix.draws]


def _shown(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list):
        return ", ".join(map(_shown, value))
    return "-" if value is None else str(value)
