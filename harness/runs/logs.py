"""The logs of flights chosen for review: read from their recordings, or flown again; with distinct names."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from harness.log import FlightLog
from harness.plants.ladder import PLANTS
from harness.review.reading import read_logs
from harness.runs import apart
from harness.runs.recall import RowAddress, fly_again, recall
from harness.runs.recordings import recording_path
from harness.runs.store import find, on_each_plant
from harness.settings import SettingsError, document, flight_from_document
from harness.settings.columns import by_column
from harness.settings.laws import short

Say = Callable[[str], None]
_MOST_WORDS = 3  # in the name of a flight


def flight_of_row(folder: Path, beginning: str, say: Say) -> FlightLog:
    """The log of a row: from its recording if that matches the row's digest, otherwise flown again and compared.

    `beginning` is the beginning of its key. `say` gets one line for each thing that the user should know. Raises
    `StoreError`, and ValueError when the flight cannot start.
    """
    stored = find(folder, beginning)
    key, digest = stored.row["key"], stored.row["digest"]
    try:
        (log,) = read_logs(recording_path(folder, key)).values()
        if log.digest == digest:
            return log
        say(f"{key}: the recording does not match the stored row: flown again")
    except FileNotFoundError:
        pass
    except (OSError, ValueError) as error:
        say(f"{key}: the recording cannot be read ({error}); flown again")
    recalled = recall(RowAddress(folder, key))
    if not digest:
        say(f"{key}: ended in {stored.row['outcome']} without a log: flown again, with no digest to compare with")
        return apart.fly(recalled.flight)
    again = fly_again(recalled)
    if again.deviation:
        say(f"warning: {key}: differs from the stored flight ({recalled.changes}): {again.deviation}")
    return again.log


def pair_of_row(folder: Path, beginning: str, say: Say) -> list[FlightLog]:
    """The same flight on every plant, the simplest first; it is flown on a plant that the run left out."""
    stored = find(folder, beginning)
    keys = on_each_plant(folder, stored.row["flight"])
    settings = recall(RowAddress(folder, stored.row["key"])).settings
    logs = []
    for plant in PLANTS:
        if plant in keys:
            logs.append(flight_of_row(folder, keys[plant], say))
            continue
        say(f"{plant}: not in {folder}: flown now")
        try:
            logs.append(apart.fly(flight_from_document({**settings, "plant": plant})))
        except (ValueError, SettingsError) as error:
            say(f"{plant}: left out, as the flight cannot start: {error}")
    return logs


def distinctly_named(logs: Sequence[FlightLog]) -> dict[str, FlightLog]:
    """The flights by distinct names, made of the settings in which they differ."""
    all_settings = [by_column(document(log.flight)) for log in logs]
    keys = list(dict.fromkeys(key for settings in all_settings for key in settings))
    differ = [key for key in keys if len({str(settings.get(key)) for settings in all_settings}) > 1]
    if "law.gains" in differ or "law.name" in differ:  # these two determine the single gains
        differ = [key for key in differ if not key.startswith("law.") or key in ("law.name", "law.gains")]
    names: dict[str, FlightLog] = {}
    for log, settings in zip(logs, all_settings, strict=True):
        words = [_word(key, settings) for key in differ[:_MOST_WORDS] if settings.get(key) is not None]
        name = " ".join(words) or log.flight.plant
        unique = next(n for i in range(1, len(logs) + 2) if (n := name if i == 1 else f"{name} {i}") not in names)
        names[unique] = log
    return names


def _word(key: str, settings: Mapping[str, object]) -> str:
    value = settings[key]
    text = f"{value:g}" if isinstance(value, float) else str(value)
    text = short(text) if key == "law.name" else text
    plain = key in ("plant", "aircraft", "law.name", "law.gains", "wind.turbulence", "estimator.kind")
    return text if plain else f"{key.rpartition('.')[2]}={text}"
