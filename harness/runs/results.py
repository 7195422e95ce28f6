"""The results of a run as one table: a row per flight, a column per setting and metric."""

import json
import shlex
import sqlite3
import tomllib
from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.files import as_text, replacing
from harness.log.metric import METRICS, YES_OR_NO
from harness.plants.ladder import PLANTS
from harness.plants.plant import Outcome
from harness.runs.journal import JOURNAL, StoreError, reading, state
from harness.runs.store import last_run, overrides_of
from harness.settings.columns import DRAWN, by_column, is_setting
from harness.settings.law_source import FILES

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

PARQUET = "flights.parquet"
_AT_ONCE = 1000  # rows read at once
_TEXTS = ("key", "outcome", "reason", "digest")
_NUMBERS = ("feasibility_margin_deg_s", "seconds")
_NEEDED: Mapping[str, Collection[str]] = {  # what each flight has, and which there are, if that is known
    "plant": PLANTS, "outcome": [outcome.value for outcome in Outcome], "law.name": (), "aircraft": (),
}  # fmt: skip
_STATE = b"journal_state"  # in the Parquet file's metadata: the `state` of the journal that was exported


def load_results(folder: Path | str) -> "pd.DataFrame":
    """The flights of a run's directory, one row each, in the order of the matrix; also while it is written.

    Columns: key, outcome, reason, digest, feasibility_margin_deg_s, seconds (wall time of the flight), run and version
    (what decided it beside its settings: see `versions`); every setting by its dotted key below [flight] in file
    units (lists are tuples, a list of tables is JSON text); every metric by its name, NaN for none (of one that is true
    or false: nullable `boolean`). In the Parquet file the metadata of a column says what it is: `kind` is setting,
    metric or result, and a metric has its `unit` and `meaning`.

    Raises `StoreError` when the directory holds no flight yet, or cannot be read.

    >>> results = harness.load_results("out/wind")
    >>> results.query("plant == 'sixdof'").groupby("law.name")["range_error_rms_m"].median()
    """
    folder = Path(folder)
    with reading(folder, thorough=True) as journal:
        table = _exported(folder / PARQUET, state(journal))
        if table is None:
            table = _table(journal)
        runs = journal.execute("SELECT settings, command FROM runs").fetchall()
    if not len(table):
        command = last_run(folder)["command"]
        raise StoreError(
            f"{folder}: has no flight yet: its run ended before the first, or is at it; to go on: {command}"
        )
    results = as_results(_declared(table).to_pandas())
    for name, known in _NEEDED.items():
        values = results[name].unique() if name in results else ["none"]
        if unknown := [value for value in values if not (isinstance(value, str) and value in (known or [value]))]:
            why = f"{unknown[0]}, which this harness does not know" if known else f"{unknown[0]}, must be text"
            raise StoreError(f"{folder / JOURNAL}: cannot be used: the {name} of a flight is {why}")
    results.attrs[DRAWN] = any(_is_drawn(str(settings), str(command)) for settings, command in runs)
    return results


def _is_drawn(settings: str, command: str) -> bool:
    """Whether settings, or a command with its `--set`, name a value that is drawn from the seed."""
    texts = [settings]
    with suppress(ValueError):  # a damaged command names none
        texts += [f"value = {text.partition('=')[2]}" for text in overrides_of(shlex.split(command))]
    for text in texts:
        with suppress(tomllib.TOMLDecodeError):  # a bare word is no draw
            if _holds_draw(tomllib.loads(text)):
                return True
    return False


def _holds_draw(value: object) -> bool:
    if isinstance(value, dict):
        return set(value) in ({"uniform"}, {"normal"}) or any(map(_holds_draw, value.values()))
    return isinstance(value, list) and any(map(_holds_draw, value))


def export(folder: Path, to: Path | None = None) -> None:
    """Writes the table to flights.parquet or `to`, unless it is there already; the file is complete or unchanged."""
    import pyarrow.parquet as pq

    path = to or folder / PARQUET
    with reading(folder, thorough=to is not None) as journal:
        now = state(journal)
        if _is_current(path, now):
            return
        table = _declared(_table(journal)).replace_schema_metadata({_STATE: now})
    with replacing(path) as partial, partial.open("wb") as file:
        pq.write_table(table, file, row_group_size=10 * _AT_ONCE)  # one group of all takes more memory


def _is_current(path: Path, now: str) -> bool:
    """Whether the table was exported from this journal with the flights that it has now."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        if not path.is_file():
            return False
        with path.open("rb") as file:  # Arrow takes a colon in a name for a scheme
            return (pq.read_schema(file).metadata or {}).get(_STATE) == now.encode()
    except (OSError, pa.ArrowException):
        return False  # missing or damaged: the journal holds everything


def _exported(path: Path, now: str) -> "pa.Table | None":
    """The exported table; None if it is not current."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        if not _is_current(path, now):
            return None
        with path.open("rb") as file:
            return pq.read_table(file)
    except (OSError, pa.ArrowException):
        return None


def _table(journal: sqlite3.Connection) -> "pa.Table":
    import pyarrow as pa

    parts = [pa.table(columns) for columns in _columns(journal)]
    if not parts:
        kinds = dict.fromkeys((*_TEXTS, "version"), pa.string()) | dict.fromkeys((*_NUMBERS, "run"), pa.float64())
        return pa.table({name: pa.array([], kind) for name, kind in kinds.items()})
    return pa.concat_tables(parts, promote_options="permissive")


def _declared(table: "pa.Table") -> "pa.Table":
    """The table with a column for every metric of today; each column has its declared type and metadata."""
    import pyarrow as pa

    kinds = {name: pa.bool_() if metric.unit == YES_OR_NO else pa.float64() for name, metric in METRICS.items()}
    for name, kind in (kinds | dict.fromkeys(_NUMBERS, pa.float64())).items():
        if name in table.column_names:
            table = table.set_column(table.column_names.index(name), name, table[name].cast(kind))
        else:  # the rows are older than this metric
            table = table.append_column(name, pa.nulls(len(table), kind))
    return table.cast(pa.schema([field.with_metadata(_about(field.name)) for field in table.schema]))


def _about(column: str) -> dict[str, str]:
    """The metadata of a column, from the declarations: a new result never counts as a setting."""
    if column in METRICS:
        return {"kind": "metric", "unit": METRICS[column].unit, "meaning": METRICS[column].meaning}
    return {"kind": "setting" if is_setting(column) else "result"}


def _columns(journal: sqlite3.Connection) -> Iterator[dict[str, list[Any]]]:
    """All rows in blocks of `_AT_ONCE`, each block by columns."""
    cursor = journal.execute(
        "SELECT key, outcome, reason, digest, feasibility_margin_deg_s, seconds, run, version, settings, metrics "
        "FROM flights ORDER BY position, key"
    )
    while rows := cursor.fetchmany(_AT_ONCE):
        flat_rows = [_flat(row) for row in rows]
        names = dict.fromkeys(name for row in flat_rows for name in row)
        yield {name: [_cell(row.get(name)) for row in flat_rows] for name in names}


def _cell(value: Any) -> Any:
    return as_text(value) if isinstance(value, str) else value


def _flat(row: tuple[Any, ...]) -> dict[str, Any]:
    *values, run, version, settings, metrics = row
    columns = dict(zip((*_TEXTS, *_NUMBERS), values, strict=True))
    columns.update(run=run, version=version[:8])
    columns.update(by_column(json.loads(settings)))
    columns.update(json.loads(metrics))
    return columns


def as_results(table: "pd.DataFrame") -> "pd.DataFrame":
    """A table as pandas reads it from flights.parquet, with the types of `load_results`."""
    import numpy as np
    import pandas as pd

    typed = {}
    for name, column in table.items():
        if column.dtype == object and column.map(lambda value: isinstance(value, np.ndarray)).any():
            tuples = [tuple(value.tolist()) if isinstance(value, np.ndarray) else None for value in column]
            typed[name] = pd.Series(tuples, index=table.index, dtype=object)
        elif name in METRICS and METRICS[str(name)].unit == YES_OR_NO:
            typed[name] = column.astype("boolean")
    return table.assign(**{str(name): column for name, column in typed.items()})


def versions(folder: Path) -> dict[str, dict[str, int]]:
    """The versions that decided the flights of this directory: name -> version -> number of flights.

    That is law files, inner loop, airframes, target tracks, physics, metrics and libraries.
    """
    counts: dict[str, dict[str, int]] = {}
    with reading(folder) as journal:
        groups = journal.execute(
            "SELECT v.decides, json_extract(f.settings, '$.aircraft'), json_extract(f.settings, '$.target.track'), "
            "json_extract(f.settings, '$.law.name'), count(*) "
            "FROM flights f JOIN versions v ON v.id = f.version GROUP BY 1, 2, 3, 4 ORDER BY min(f.rowid)"
        )
        for decides, airframe, track, law, count in groups:
            version = json.loads(decides)
            for what, which in (*version.pop("content").items(), *version.items()):
                if which is None:
                    continue
                if what.startswith("aircraft/"):
                    what = f"{what} of {airframe}"
                elif what.startswith(FILES):
                    what = f"{what} of {law}"
                elif what == "target/track":
                    what = f"the track {track}"
                of = counts.setdefault(what, {})
                of[str(which)] = of.get(str(which), 0) + count
    return counts
