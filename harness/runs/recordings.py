"""The recordings of a run's flights: DIR/flights/KEY.rrd."""

from pathlib import Path

from harness.files import make_folder
from harness.log import FlightLog

FOLDER = "flights"


def record(log: FlightLog, key: str, folder: Path) -> str:
    """Writes the recording of a flight. Returns what went wrong in one line, or an empty string."""
    from harness.review.recording import write_recording

    path = recording_path(folder, key)
    try:
        make_folder(path.parent)
        write_recording(path, {log.flight.plant: log}, key, command=f"harness fly {folder}:{key}")
    except OSError as error:
        return f"{path}: cannot be written: {error.strerror or error}"
    return ""


def recording_path(folder: Path, key: str) -> Path:
    """The path of the recording of the flight with this key."""
    return folder / FOLDER / f"{key}.rrd"
