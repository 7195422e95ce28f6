"""The recordings of a run's flights: DIR/flights/KEY.rrd."""

from pathlib import Path

from harness.files import make_folder
from harness.log import FlightLog
from harness.plants.plant import Outcome

FOLDER = "flights"


def record(log: FlightLog, key: str, folder: Path, home: Path) -> str:
    """Writes the recording of a flight of the run in `home` to `folder`.

    Returns what went wrong in one line, or an empty string.
    """
    from harness.review.recording import write_recording

    path = recording_path(folder, key)
    try:
        make_folder(path.parent)
        write_recording(path, {log.flight.plant: log}, key, command=f"harness fly {home}:{key}")
    except OSError as error:
        return f"{path}: cannot be written: {error.strerror or error}"
    return ""


def wanted(record: str, outcome: Outcome) -> bool:
    """Whether a flight that ended so is recorded; `record` is all, failed (whatever ended it early) or none."""
    return record == "all" or (record == "failed" and outcome is not Outcome.COMPLETED)


def lacks_recording(folder: Path, key: str, record: str, outcome: Outcome) -> bool:
    """Whether a finished flight is to be recorded and is not: the disk was full, or another command requested fewer."""
    return wanted(record, outcome) and not outcome.failed and not recording_path(folder, key).exists()


def recording_path(folder: Path, key: str) -> Path:
    """The path of the recording of the flight with this key."""
    return folder / FOLDER / f"{key}.rrd"
