"""Flights chosen for review: from their recordings, or flown again from their rows; with names that tell them apart."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from harness.log import FlightLog
from harness.loop import simulate
from harness.plants.ladder import PLANTS
from harness.review.reading import read_logs
from harness.runs.recall import RowAddress, fly_again, recall
from harness.runs.recordings import recording_path
from harness.runs.store import find, on_each_plant
from harness.settings import SettingsError, document, flight_from_document
from harness.settings.columns import by_column

Say = Callable[[str], None]
_MOST_WORDS = 3  # of a name


def flight_of_row(folder: Path, beginning: str, say: Say) -> FlightLog:
    """The flight of a row: its recording where that holds what the row says, else flown again and compared.

    Raises `StoreError`; ValueError when it cannot start. What is remarkable is said.
    """
    stored = find(folder, beginning)
    key, digest = stored.row["key"], stored.row["digest"]
    try:
        (log,) = read_logs(recording_path(folder, key)).values()
        if log.digest == digest:
            return log
        say(f"{key}: the recording is not of the flight that is stored: flown again")
    except FileNotFoundError:
        pass
    except (OSError, ValueError) as error:
        say(f"{key}: its recording cannot be used ({error}): flown again")
    recalled = recall(RowAddress(folder, key))
    if not digest:
        say(f"{key}: ended in {stored.row['outcome']} without a log; flown again, there is nothing to compare with")
        return simulate(recalled.flight)
    again = fly_again(recalled)
    if again.deviation:
        why = (
            f"changed since: {', '.join(recalled.changed)}" if recalled.changed else "though nothing known has changed"
        )
        say(f"warning: {key}: not the flight that is stored ({why}): {again.deviation}")
    return again.log


def pair_of_row(folder: Path, beginning: str, say: Say) -> list[FlightLog]:
    """The same flight on each plant, the simplest first; on a plant that the run left out it is flown anew."""
    stored = find(folder, beginning)
    keys = on_each_plant(folder, stored.row["flight"])
    settings = recall(RowAddress(folder, stored.row["key"])).settings
    logs = []
    for plant in PLANTS:
        if plant in keys:
            logs.append(flight_of_row(folder, keys[plant], say))
            continue
        say(f"{plant}: not in {folder}, flown anew")
        try:
            logs.append(simulate(flight_from_document({**settings, "plant": plant})))
        except (ValueError, SettingsError) as error:
            say(f"{plant}: left out, it cannot start: {error}")
    return logs


def named(logs: Sequence[FlightLog]) -> dict[str, FlightLog]:
    """Flights by names made of the settings in which they differ."""
    several = [by_column(document(log.flight)) for log in logs]
    keys = list(dict.fromkeys(key for one in several for key in one))
    differ = [key for key in keys if len({str(one.get(key)) for one in several}) > 1]
    if "law.gains" in differ or "law.name" in differ:  # which say what the single gains are
        differ = [key for key in differ if not key.startswith("law.") or key in ("law.name", "law.gains")]
    names: dict[str, FlightLog] = {}
    for log, one in zip(logs, several, strict=True):
        name = " ".join(_word(key, one) for key in differ[:_MOST_WORDS] if one.get(key) is not None) or log.flight.plant
        unique = next(n for i in range(1, len(logs) + 2) if (n := name if i == 1 else f"{name} {i}") not in names)
        names[unique] = log
    return names


def _word(key: str, settings: Mapping[str, object]) -> str:
    value = settings[key]
    text = f"{value:g}" if isinstance(value, float) else str(value)
    plain = key in ("plant", "aircraft", "law.name", "law.gains", "wind.turbulence", "estimator.kind")
    return text if plain else f"{key.rpartition('.')[2]}={text}"
