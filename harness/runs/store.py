"""The store: one SQLite journal in the directory of a run, with one writer and any number of readers."""

import json
import os
import shlex
import sqlite3
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Self

from harness.files import as_text, content_hash, make_folder, read
from harness.key import Version
from harness.plants.plant import Outcome
from harness.provenance import Provenance, now
from harness.runs.journal import JOURNAL, WAIT, StoreError, format_of, has_grown, locked, reading, store_errors, upgrade
from harness.runs.row import FlightResult, FlightRow
from harness.toml_text import shortened

LOCK, FLIGHTS = "lock", "flights"
COMMIT_EVERY = 0.5  # s: the longest time that a row waits to be committed


class Stored(NamedTuple):
    """A row as the store keeps it."""

    row: FlightRow  # as `fly --json` prints it
    final: Mapping[str, float]  # the last row of the log: see `harness.runs.row.final`
    seconds: float | None  # wall time of the simulation, s
    version: Mapping[str, Any]  # everything besides the settings that decided the flight: see `harness.key`
    run: Mapping[str, Any]  # the provenance of its run, and when that ended


class Store:
    """The journal, open for writing by this process alone. A context manager: leaving it commits all changes."""

    def __init__(self, folder: Path) -> None:
        """Opens the journal; creates it and its directory if necessary. Raises `StoreError`."""
        self.folder = folder
        if folder.exists() and not folder.is_dir():
            raise StoreError(f"{folder}: is a file, not a folder")
        try:
            make_folder(folder)
            self._lock = locked(folder / LOCK)
        except OSError as error:
            raise StoreError(f"{folder}: cannot be written: {error.strerror or error}") from None
        try:
            with store_errors(folder):
                self._journal = sqlite3.connect(folder / JOURNAL, timeout=WAIT, isolation_level=None)
                upgrade(self._journal, format_of(self._journal, folder, thorough=True))
        except BaseException:
            os.close(self._lock)
            raise
        self._begun: float | None = None  # the time of the first uncommitted change
        self._grown = False  # whether flights are among the uncommitted changes
        self._versions: set[str] = {i for (i,) in self._all("SELECT id FROM versions")}
        self._run = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        try:
            if kind is None or not issubclass(kind, StoreError):
                self.commit()
        finally:
            self._journal.close()
            os.close(self._lock)

    def begin(self, provenance: Provenance) -> None:
        """Begins a run: all rows added from now on belong to it."""
        names, values = ", ".join(Provenance._fields), ", ".join("?" * len(provenance))
        self._change(f"INSERT INTO runs ({names}) VALUES ({values})", provenance)
        ((self._run,),) = self._all("SELECT max(id) FROM runs")
        self.commit()

    def latest_run(self) -> Mapping[str, Any] | None:
        """The provenance of the latest run; None without any flight."""
        with store_errors(self.folder):
            flown = self._journal.execute("SELECT 1 FROM flights LIMIT 1").fetchone()
            return _latest_run(self._journal) if flown else None

    def end(self) -> None:
        """Ends the run, whether all its flights are done or not."""
        self._change("UPDATE runs SET ended = ? WHERE id = ?", (now(), self._run))
        self.commit()

    def add_version(self, version: Version, files: Mapping[str, Path]) -> None:
        """Keeps a version and the content of its files. Raises `StoreError` if one of them has changed."""
        if version.number in self._versions:
            return
        hashes = version.decides["content"]
        for name, path in files.items():
            try:
                content = read(path)
            except OSError as error:
                raise StoreError(f"{path}: {error.strerror or error}, during the run") from None
            if content_hash(content) != hashes[name]:
                raise StoreError(f"{path}: has changed during the run: run the same command again")
            self._change("INSERT OR IGNORE INTO files VALUES (?, ?)", (hashes[name], content))
        self._change("INSERT INTO versions VALUES (?, ?)", (version.number, json.dumps(version.decides)))
        self._versions.add(version.number)

    def add(self, row: FlightRow, result: FlightResult, version: str, position: int) -> None:
        """Keeps a row; it is committed within `COMMIT_EVERY`. `version` is the number of its `Version`."""
        self._grown = True
        self._change(
            "INSERT OR REPLACE INTO flights VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
            (
                row["key"], self._run, position, version, row["outcome"], row["reason"], row["digest"],
                json.dumps(row["flight"]), json.dumps(row["metrics"]), row["feasibility_margin_deg_s"],
                result.seconds, json.dumps(result.final),
            ),
        )  # fmt: skip

    def place(self, matrix: str, position: int, key: str) -> None:
        """Records that the flight at this position of a matrix has this key."""
        self._change("INSERT OR REPLACE INTO positions VALUES (?, ?, ?)", (matrix, position, key))

    def done(self, *, retry_failed: bool) -> dict[str, Outcome]:
        """The outcome of each row that is not to be flown again, by its key."""
        rows = self._all(f"SELECT key, outcome FROM flights WHERE {_done(retry_failed)}")
        return {key: Outcome(outcome) for key, outcome in rows}

    def found(self, key: str, *, retry_failed: bool) -> tuple[Outcome, dict[str, Any]] | None:
        """Outcome and metrics of the row with this key; None without one that is not to be flown again."""
        rows = self._all(f"SELECT outcome, metrics FROM flights WHERE key = ? AND {_done(retry_failed)}", (key,))
        return next(((Outcome(outcome), _numbers(metrics)) for outcome, metrics in rows), None)

    def commit(self) -> None:
        """Commits all changes."""
        if self._begun is not None:
            with store_errors(self.folder):
                if self._grown:
                    has_grown(self._journal)
                self._journal.execute("COMMIT")
            self._begun, self._grown = None, False

    def tick(self) -> None:
        """Commits all changes if the first of them is older than `COMMIT_EVERY`."""
        if self._begun is not None and time.monotonic() - self._begun >= COMMIT_EVERY:
            self.commit()

    def _change(self, statement: str, values: Iterable[object]) -> None:
        with store_errors(self.folder):
            if self._begun is None:
                self._journal.execute("BEGIN IMMEDIATE")
                self._begun = time.monotonic()
            texts = (as_text(value) if isinstance(value, str) else value for value in values)
            self._journal.execute(statement, tuple(texts))
        self.tick()

    def _all(self, statement: str, values: Iterable[object] = ()) -> list[Any]:
        with store_errors(self.folder):
            return self._journal.execute(statement, tuple(values)).fetchall()


def examples(journal: sqlite3.Connection) -> list[tuple[str, dict[str, Any], dict[str, Any]]]:
    """For each version in the store: its number, what it is a hash of, and the settings of one of its flights."""
    rows = journal.execute(
        "SELECT v.id, v.decides, (SELECT settings FROM flights f WHERE f.version = v.id LIMIT 1) AS example "
        "FROM versions v WHERE example IS NOT NULL"
    )
    return [(version, json.loads(decides), json.loads(settings)) for version, decides, settings in rows]


def positions(
    journal: sqlite3.Connection, matrix: str, versions: Sequence[str], *, retry_failed: bool
) -> dict[int, str]:
    """The key of each flight of a matrix that is done in one of these versions, by its position."""
    return dict(
        journal.execute(
            "SELECT p.position, p.key FROM positions p JOIN flights f USING (key) "
            f"WHERE p.matrix = ? AND f.version IN ({', '.join('?' * len(versions))}) AND {_done(retry_failed)}",
            (matrix, *versions),
        )
    )


def _done(retry_failed: bool) -> str:
    """The condition that a row is not flown again. Outcomes that the machine may have caused are always flown again."""
    again = [outcome for outcome in Outcome if outcome.of_machine or (retry_failed and outcome.failed)]
    return f"outcome NOT IN ({', '.join(repr(outcome.value) for outcome in again)})"


def find(folder: Path, beginning: str) -> Stored:
    """The only row whose key begins with `beginning`. Raises `StoreError` if there is none, or several."""
    with reading(folder) as journal:
        journal.row_factory = sqlite3.Row
        rows = journal.execute(
            "SELECT f.*, v.decides FROM flights f JOIN versions v ON v.id = f.version "
            "WHERE substr(f.key, 1, ?) = ? ORDER BY f.key LIMIT 6",
            (len(beginning), beginning),
        ).fetchall()
        if not rows or not beginning:
            raise StoreError(
                f"{folder}: no flight has a key that begins with {beginning!r}; `harness show {folder}` lists the keys"
            )
        if len(rows) > 1:
            keys = ", ".join(row["key"] for row in rows[:5]) + (", ..." if len(rows) > 5 else "")
            raise StoreError(f"{folder}: the key {beginning!r} is ambiguous: {keys}")
        kept = dict(rows[0])
        run = dict(journal.execute("SELECT * FROM runs WHERE id = ?", (kept["run"],)).fetchone())
        row = {
            "key": kept["key"],
            "outcome": Outcome(kept["outcome"]).value,
            "reason": kept["reason"],
            "digest": kept["digest"],
            "flight": _table(kept["settings"]),
            "metrics": _numbers(kept["metrics"]),
            "feasibility_margin_deg_s": kept["feasibility_margin_deg_s"],
        }
        version = _table(kept["decides"])
        if not isinstance(version["content"], dict):
            raise TypeError("the version of a flight has no files")
        return Stored(row, _numbers(kept["final"]), kept["seconds"], version, run)


def _table(text: str) -> dict[str, Any]:
    """A table that is kept as JSON."""
    table = json.loads(text)
    if not isinstance(table, dict):
        raise TypeError(f"{shortened(text)} is no table")
    return table


def _numbers(text: str) -> dict[str, Any]:
    """Numbers by name that are kept as JSON; some may be yes, no or none."""
    table = _table(text)
    if wrong := [name for name, value in table.items() if not isinstance(value, float | int | None)]:
        raise TypeError(f"{wrong[0]} is no number")
    return table


def last_run(folder: Path) -> Mapping[str, Any]:
    """The provenance of the latest run here, when that ended, and the `words` of its command. Raises `StoreError`."""
    with reading(folder) as journal:
        latest = _latest_run(journal)
        if latest is None:
            raise StoreError(f"{folder}: no run has begun here")
        if not isinstance(latest["settings"], str):
            raise TypeError("the settings of the latest run are no text")
        return {**latest, "words": shlex.split(str(latest["command"]))}


def overrides_of(words: Sequence[str]) -> Iterator[str]:
    """The KEY=VALUE of each `--set` in the words of a command."""
    for word, following in pairwise([*words, ""]):
        if word.startswith("--set="):
            yield word.removeprefix("--set=").strip()
        elif word == "--set":
            yield following.strip()


def _latest_run(journal: sqlite3.Connection) -> dict[str, Any] | None:
    cursor = journal.cursor()
    cursor.row_factory = sqlite3.Row
    latest = cursor.execute("SELECT * FROM runs ORDER BY id DESC LIMIT 1").fetchone()
    return latest and dict(latest)


def on_each_plant(folder: Path, settings: Mapping[str, Any]) -> dict[str, str]:
    """By plant, the key of the latest row whose settings equal these but for the plant."""
    with reading(folder) as journal:
        return dict(
            journal.execute(
                "SELECT json_extract(settings, '$.plant'), key FROM flights "
                "WHERE json_remove(settings, '$.plant') = json_remove(?, '$.plant') ORDER BY rowid",
                (json.dumps(settings),),
            ).fetchall()
        )


def content(folder: Path, digest: str) -> bytes:
    """The content of a file that a flight read, by its hash. Raises `StoreError`."""
    with reading(folder) as journal:
        row = journal.execute("SELECT content FROM files WHERE hash = ?", (digest,)).fetchone()
    if row is None:
        raise StoreError(f"{folder}: the store lacks a file that the flight read")
    return bytes(row[0])
