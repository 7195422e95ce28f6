"""Reading a recording back: the log of each flight to the last bit, and the flight that it was."""

import json
import os
import pickle
import re
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from rerun.chunk import RrdReader

from harness.files import is_text
from harness.flight import Flight
from harness.log import COLUMNS, FlightLog
from harness.plants.plant import Outcome
from harness.review.seal import is_sealed

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
_CHILD = "import pathlib, sys; from harness.review.reading import send; send(pathlib.Path(sys.argv[1]))"


class _Held(NamedTuple):
    """One flight in a recording."""

    columns: list[str]
    table: Array
    flight: str  # JSON


def read_recording(path: Path, flight: str | None = None) -> "pd.DataFrame":
    """The log of a recorded flight, bit for bit: SI, rad, NED. `flight` names it where the file holds several.

    OSError when the file cannot be read, ValueError when it is damaged or there is no such flight in it.
    """
    import pandas as pd

    held = _read(path)
    recorded = held[_chosen(path, list(held), flight)]
    return pd.DataFrame(recorded.table, columns=recorded.columns)


def read_logs(path: Path) -> dict[str, FlightLog]:
    """The flights of a recording as they were when it was written, in its order. Errors as `read_recording`."""
    from harness.settings import SettingsError

    logs, places = {}, {}
    for name, (columns, table, flight) in _read(path).items():
        own = columns[len(COLUMNS) :]  # the law's
        if columns[: len(COLUMNS)] != [*COLUMNS] or not all(name.startswith("law_") for name in own) or not flight:
            raise ValueError(f"{path}: {name} was recorded by another version, with other columns")
        known = json.loads(flight)
        try:
            settings = _flight(known["flight"])
        except SettingsError as error:
            raise ValueError(f"{path}: {name}: {error}") from error
        channels = {channel: table[:, len(COLUMNS) + i] for i, channel in enumerate(own)}
        logs[name] = FlightLog(settings, Outcome(known["outcome"]), known["reason"], table[:, : len(COLUMNS)], channels)
        places[name] = known["place"]
    return {name: logs[name] for name in sorted(logs, key=lambda name: places[name])}


def _flight(settings: Mapping[str, Any]) -> Flight:
    """The recorded flight. A user-defined law is kept as its settings: no code is run that a file names."""
    from harness.settings import flight_from_document
    from harness.settings.laws import NotRun, is_own

    match settings:
        case {"law": {"name": str(name), "standoff_m": float(), "max_heading_rate_deg_s": float() | "inf"} as law}:
            if is_own(name):
                return replace(flight_from_document({**settings, "law": {"name": "nftsm"}}), law=NotRun(law))
    return flight_from_document(settings)


def _chosen(path: Path, names: list[str], flight: str | None) -> str:
    held = ", ".join(sorted(names)) or "none"
    name = flight if flight is not None else held
    if name not in names:
        raise ValueError(f"{path}: {f'no flight {flight!r}' if flight else 'which flight?'} It holds {held}")
    return name


def _read(path: Path) -> dict[str, _Held]:
    # The seal first, for the OSError: Rerun raises RuntimeError for all that is wrong with a file.
    return _held(path) if is_sealed(path) else _held_by_child(path)


def _held_by_child(path: Path) -> dict[str, _Held]:
    """The recording, read in a separate process, since a damaged file may crash the reader."""
    done = subprocess.run(
        [sys.executable, "-P", "-c", _CHILD, str(path)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        capture_output=True,
        check=False,
    )
    if done.returncode:
        raise ValueError(f"{path}: is damaged: the process that read it ended with exit code {done.returncode}")
    held = pickle.loads(done.stdout)  # of our own child
    if isinstance(held, str):
        raise ValueError(held)
    known: dict[str, _Held] = held
    return known


def send(path: Path) -> None:
    """Writes the content of a recording, or the error, to standard output, for the calling process."""
    try:
        held: object = _held(path)
    except ValueError as error:
        held = str(error)
    sys.stdout.buffer.write(pickle.dumps(held))


def _held(path: Path) -> dict[str, _Held]:
    try:
        with path.open("rb") as file:
            name = str(path) if is_text(path) else f"/dev/fd/{file.fileno()}"  # Rerun knows no other names
            chunks = RrdReader(name).stream().filter(content="/runs/**").to_chunks()
    except RuntimeError as error:
        raise ValueError(f"{path}: is not a complete recording: {error}") from error
    columns: dict[str, list[str]] = {}
    rows: dict[str, list[Array]] = {}
    flights: dict[str, str] = {}
    for chunk in chunks:
        entity = re.fullmatch(r"/runs/((?:[^/\\]|\\.)+)/(log|flight)", chunk.entity_path)
        if not entity:
            continue
        name, batch = re.sub(r"\\(.)", r"\1", entity[1]), chunk.to_record_batch()
        if entity[2] == "flight":
            (flights[name],) = batch.column("TextDocument:text").flatten().to_pylist()
        elif chunk.is_static:
            columns[name] = batch.column("SeriesLines:names").flatten().to_pylist()
        else:
            rows.setdefault(name, []).append(batch.column("Scalars:scalars").flatten().to_numpy())
    return {
        name: _Held(names, _table(path, names, rows.get(name, [])), flights.get(name, ""))
        for name, names in columns.items()
    }


def _table(path: Path, columns: Sequence[str], parts: Sequence[Array]) -> Array:
    table = np.concatenate([np.empty(0), *parts]).reshape(-1, len(columns))
    if "time" in columns and (np.diff(table[:, columns.index("time")]) <= 0.0).any():
        raise ValueError(f"{path}: the times of its rows do not rise; was it appended to itself?")
    return table
