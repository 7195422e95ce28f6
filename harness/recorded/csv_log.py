"""Reads CSV files by a map, in pieces, so that a large file takes no large memory."""

import csv
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from pandas.errors import EmptyDataError, ParserError

from harness.recorded.column_map import ColumnMap, FileMap, read_map, shipped
from harness.recorded.draft import Draft
from harness.recorded.recorded_flight import Array, LogError, LoggedEvent, RecordedFlight
from harness.recorded.thinning import every, said

_ROWS = 50_000  # rows read at once
_LONGEST_HEADER = 1_000_000  # largest number of characters of a header


def read_csv(paths: Sequence[Path], map_name: str | None) -> RecordedFlight:
    """One flight of one or several CSV files. Without a map, the shipped one that fits. Raises `LogError`, OSError."""
    headers = {path: _header(path) for path in paths}
    chosen = read_map(map_name) if map_name else _fitting(headers)
    parts = {path: part for path in paths if (part := chosen.file(path.name))}
    if not parts:
        patterns = ", ".join(part.pattern for part in chosen.files)
        raise LogError(f"{paths[0]}: the map {chosen.name} has no entry for this file name, only for {patterns}")
    name = paths[0].name if len(paths) == 1 else paths[0].parent.name or str(paths[0].parent)
    clocks = dict.fromkeys(part.clock.counts for part in parts.values() if part.clock.counts)
    draft = Draft(name, [str(path) for path in parts], "; ".join(clocks) or "the files' own clock")
    draft.of_receipt = any(part.clock.of_receipt for part in parts.values())
    unused = [path.name for path in paths if path not in parts]
    if unused:
        draft.problems.append(f"the map {chosen.name} has no entry for {', '.join(unused)}: not read")
    for path, part in parts.items():
        _read_file(draft, path, part, headers[path], chosen)
    return draft.finished()


def _header(path: Path) -> list[str]:
    with path.open("rb") as file:
        line = file.readline(_LONGEST_HEADER)
    if not line:
        raise LogError(f"{path}: is empty")
    if b"\0" in line or len(line) >= _LONGEST_HEADER:
        raise LogError(f"{path}: is no ULog, no DataFlash and no CSV")
    try:
        text = line.decode("utf-8-sig").strip()
    except UnicodeDecodeError:
        raise LogError(f"{path}:1: not text in UTF-8") from None
    try:
        cells = [cell.strip() for cell in next(csv.reader([text], delimiter=_separator(text)), [])]
    except csv.Error as error:
        raise LogError(f"{path}:1: {error}") from None
    repeated = sorted({cell for cell in cells if cells.count(cell) > 1 and cell})
    if repeated:
        raise LogError(f"{path}:1: two columns are called {repeated[0]!r}")
    return cells


def _separator(text: str) -> str:
    return max(",;\t", key=text.count)


def _fitting(headers: dict[Path, list[str]]) -> ColumnMap:
    """The shipped map that fits, which is the one whose columns are all there in most files."""
    maps = [read_map(name) for name in shipped()]

    def fits(one: ColumnMap) -> int:
        parts = ((one.file(path.name), header) for path, header in headers.items())
        return sum(set(part.columns) <= set(header) for part, header in parts if part)

    best = max(maps, key=fits)
    if not fits(best):
        path, header = next(iter(headers.items()))
        raise LogError(
            f"{path}: none of the shipped maps, {', '.join(shipped())}, fits its columns {', '.join(header)[:200]}; "
            "write one and name it with --map"
        )
    return best


def _read_file(draft: Draft, path: Path, part: FileMap, header: Sequence[str], chosen: ColumnMap) -> None:
    missing = [column for column in part.columns if column not in header]
    if missing:
        raise LogError(
            f"{path}:1: has no column {missing[0]!r}, which the map {chosen.name} requires; "
            f"its columns are {', '.join(header)[:300]}"
        )
    lines = _lines(path) - 1
    step = every(lines)
    table, rows_read = _table(path, part.columns, header, step)
    if step > 1:
        draft.problems.append(said(path.name, lines, step))
    if ragged := max(0, lines - rows_read):
        draft.problems.append(f"{path.name}: {ragged} rows have more cells than the header, and are left out")
    time = table[part.clock.column] * part.clock.unit + part.clock.offset
    rows = draft.in_order(time, path.name)
    for one in part.given:
        source = f"{path.name}: {one.column}"
        draft.add(one.channel, time[rows], one.factor * table[one.column][rows], one.basis, source, one.note)
    if part.failure:
        failed = np.flatnonzero(np.nan_to_num(table[part.failure][rows]))
        if len(failed) and (draft.failure is None or time[rows][failed[0]] < draft.failure.time):
            draft.failure = LoggedEvent(float(time[rows][failed[0]]), path.stem.rpartition("failure_status-")[2])


def _table(path: Path, columns: Sequence[str], header: Sequence[str], step: int) -> tuple[dict[str, Array], int]:
    """These columns as numbers, of one row in `step`, NaN for what is none; and how many rows there are."""
    pieces: dict[str, list[Array]] = {column: [] for column in columns}
    rows = 0
    try:
        for piece in _pieces(path, columns, header):
            kept = piece[-rows % step :: step]
            rows += len(piece)
            for column in columns:
                numbers = pd.to_numeric(kept[column], errors="coerce").to_numpy(dtype=float)
                pieces[column].append(np.where(np.isfinite(numbers), numbers, np.nan))
    except (ParserError, EmptyDataError, UnicodeDecodeError, ValueError, OverflowError) as error:
        raise LogError(f"{path}: cannot be read as CSV: {' '.join(str(error).split())}") from None
    if not rows:
        raise LogError(f"{path}: has a header and no rows")
    return {column: np.concatenate(pieces.pop(column)) for column in columns}, rows


def _pieces(path: Path, columns: Sequence[str], header: Sequence[str]) -> Iterator[pd.DataFrame]:
    with path.open("rb") as file:
        first = file.readline().decode("utf-8-sig")
    with pd.read_csv(
        path,
        sep=_separator(first),
        skiprows=1,
        names=list(header),
        usecols=list(columns),
        chunksize=_ROWS,
        on_bad_lines="skip",
        encoding="utf-8",
        encoding_errors="replace",
        index_col=False,
        low_memory=False,
    ) as reader:
        yield from reader


def _lines(path: Path) -> int:
    """The lines of a file that are not empty."""
    with path.open("rb") as file:
        return sum(bool(line.strip()) for line in file)
