"""The recording of a flight of a run: DIR/flights/KEY.rrd."""

import json
from pathlib import Path

from harness.flight_log import FlightLog
from harness.runs.row import Judged
from harness.settings import document

FOLDER = "flights"


def record(log: FlightLog, how: Judged, key: str, folder: Path) -> str:
    """Writes it, and says what went wrong; empty when nothing did."""
    from harness.review.recording import write_recording

    metrics = "\n".join(
        f"| {name} | {'-' if value is None else f'{value:.3g}'} |" for name, value in how.metrics.items()
    )
    reason = f": {how.reason}" if how.reason else ""
    notes = (
        f"{how.outcome}{reason}\n\n| metric | |\n|---|---|\n{metrics}\n\n"
        f"```json\n{json.dumps(document(log.flight), indent=1)}\n```"
    )
    path = recording_path(folder, key)
    try:
        path.parent.mkdir(exist_ok=True)
        write_recording(path, {log.flight.plant: log}, key, notes)
    except OSError as error:
        return f"{path}: cannot be written: {error.strerror or error}"
    return ""


def recording_path(folder: Path, key: str) -> Path:
    """Where it is."""
    return folder / FOLDER / f"{key}.rrd"
