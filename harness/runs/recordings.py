"""The recording of a flight of a run: DIR/flights/KEY.rrd."""

from pathlib import Path

from harness.log import FlightLog

FOLDER = "flights"


def record(log: FlightLog, key: str, folder: Path) -> str:
    """Writes it, and says what went wrong; empty when nothing did."""
    from harness.review.recording import write_recording

    path = recording_path(folder, key)
    try:
        path.parent.mkdir(exist_ok=True)
        write_recording(path, {log.flight.plant: log}, key, command=f"harness fly {folder}:{key}")
    except OSError as error:
        return f"{path}: cannot be written: {error.strerror or error}"
    return ""


def recording_path(folder: Path, key: str) -> Path:
    """Where it is."""
    return folder / FOLDER / f"{key}.rrd"
