"""The store: one SQLite journal in the directory of a run, with one writer and any number of readers."""

import json
import os
import shlex
import socket
import sqlite3
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from errno import EACCES, EAGAIN
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Self

from harness.error import HarnessError
from harness.files import as_text, content_hash, make_folder, read
from harness.key import Version
from harness.plants.plant import Outcome
from harness.provenance import Provenance, now
from harness.runs.row import FlightResult, FlightRow
from harness.toml_text import shortened

JOURNAL, LOCK, FLIGHTS = "journal.sqlite", "lock", "flights"
COMMIT_EVERY = 0.5  # s: the longest time that a row waits to be committed
_APPLICATION = 0x53544F46  # "STOF", SQLite's application id of the journal
_FORMAT = 3  # of the journal, in SQLite's user_version
_RANDOM = "lower(hex(randomblob(16)))"
_WAIT = 60.0  # s, for another process to let go of the journal

_TABLES = f"""
CREATE TABLE runs (id INTEGER PRIMARY KEY, {", ".join(Provenance._fields)}, ended);
CREATE TABLE files (hash TEXT PRIMARY KEY, content BLOB NOT NULL);
CREATE TABLE versions (id TEXT PRIMARY KEY, decides TEXT NOT NULL);
CREATE TABLE flights (
    key TEXT PRIMARY KEY, run INTEGER NOT NULL, position INTEGER NOT NULL, version TEXT NOT NULL,
    outcome TEXT NOT NULL, reason TEXT NOT NULL, digest TEXT NOT NULL, settings TEXT NOT NULL, metrics TEXT NOT NULL,
    feasibility_margin_deg_s REAL, seconds REAL, final TEXT NOT NULL
);
CREATE INDEX flights_by_version ON flights (version);
CREATE INDEX flights_done ON flights (key, version, outcome);
CREATE TABLE positions (
    matrix TEXT NOT NULL, position INTEGER NOT NULL, key TEXT NOT NULL, PRIMARY KEY (matrix, position)
) WITHOUT ROWID;
CREATE TABLE state (id TEXT NOT NULL);
INSERT INTO state VALUES ({_RANDOM});
PRAGMA application_id = {_APPLICATION};
"""
_UPGRADES = {  # by format, what makes the next one of it
    1: f"DROP TABLE changes; CREATE TABLE state (id TEXT NOT NULL); INSERT INTO state VALUES ({_RANDOM});",
    2: "ALTER TABLE runs ADD COLUMN processor;",
}


class StoreError(HarnessError):
    """The directory of a run cannot be used; the message says why in one line."""


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
            self._lock = _locked(folder / LOCK)
        except OSError as error:
            raise StoreError(f"{folder}: cannot be written: {error.strerror or error}") from None
        try:
            with _store_errors(folder):
                self._journal = sqlite3.connect(folder / JOURNAL, timeout=_WAIT, isolation_level=None)
                _upgrade(self._journal, _format(self._journal, folder, thorough=True))
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
        with _store_errors(self.folder):
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
            with _store_errors(self.folder):
                if self._grown:
                    self._journal.execute(f"UPDATE state SET id = {_RANDOM}")
                self._journal.execute("COMMIT")
            self._begun, self._grown = None, False

    def tick(self) -> None:
        """Commits all changes if the first of them is older than `COMMIT_EVERY`."""
        if self._begun is not None and time.monotonic() - self._begun >= COMMIT_EVERY:
            self.commit()

    def _change(self, statement: str, values: Iterable[object]) -> None:
        with _store_errors(self.folder):
            if self._begun is None:
                self._journal.execute("BEGIN IMMEDIATE")
                self._begun = time.monotonic()
            texts = (as_text(value) if isinstance(value, str) else value for value in values)
            self._journal.execute(statement, tuple(texts))
        self.tick()

    def _all(self, statement: str, values: Iterable[object] = ()) -> list[Any]:
        with _store_errors(self.folder):
            return self._journal.execute(statement, tuple(values)).fetchall()


@contextmanager
def reading(folder: Path, *, thorough: bool = False) -> Iterator[sqlite3.Connection]:
    """The journal, open for reading, also while a run writes to it; one of an earlier format as an upgraded copy.

    With `thorough` all of it is checked for damage, also what is not read. Raises `StoreError`; also where what is done
    with it fails, since that is to take its rows apart.
    """
    path = folder / JOURNAL
    if not path.is_file():
        raise StoreError(f"{folder}: holds no results of `harness run` (there is no {JOURNAL})")
    with _store_errors(folder):
        # Opened for writing where that is allowed: a run that was killed may have left half a commit to roll back.
        mode = "rw" if os.access(path, os.W_OK) and os.access(folder, os.W_OK) else "ro"
        journal = sqlite3.connect(f"{path.absolute().as_uri()}?mode={mode}", uri=True, timeout=_WAIT)
        with closing(journal), closing(sqlite3.connect("")) as copy:
            journal.execute("PRAGMA query_only = ON")
            journal.execute("PRAGMA trusted_schema = OFF")  # it may be somebody else's
            version = _format(journal, folder, thorough=thorough)
            if version != _FORMAT:
                journal.backup(copy)
                _upgrade(copy, version)
            with taking_apart(folder):
                yield journal if version == _FORMAT else copy


@contextmanager
def taking_apart(folder: Path) -> Iterator[None]:
    """For what takes rows of the journal apart: raises `StoreError` where that fails, since a row may hold anything."""
    try:
        yield
    except HarnessError:
        raise
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError) as error:
        what = f"{type(error).__name__}: {shortened(str(error))}"
        why = f"{folder / JOURNAL}: is damaged: a row cannot be read ({what}); move it away"
        raise StoreError(why) from error


def state(journal: sqlite3.Connection) -> str:
    """A random text that is new whenever flights were added: equal exactly for one journal with the same flights."""
    ((text,),) = journal.execute("SELECT id FROM state")
    return str(text)


def examples(journal: sqlite3.Connection) -> list[tuple[str, dict[str, Any], dict[str, Any]]]:
    """Of each version in the store its number, what it is a hash of, and the settings of one of its flights."""
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
    """The condition that a row is not to be flown again. What the machine may be to blame for is always flown again."""
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


@contextmanager
def _store_errors(folder: Path) -> Iterator[None]:
    """Turns an error of SQLite into a `StoreError` that says what to do."""
    try:
        yield
    except sqlite3.DatabaseError as error:
        name = getattr(error, "sqlite_errorname", "") or ""
        path = folder / JOURNAL
        if name.startswith("SQLITE_FULL"):
            why = f"{folder}: the disk is full: all but the latest flights are kept; make room, then run it again"
        elif name.startswith(("SQLITE_READONLY", "SQLITE_CANTOPEN", "SQLITE_PERM")):
            why = f"{path}: cannot be written: {error}"
        elif name.startswith("SQLITE_IOERR"):
            why = f"{path}: {error}: finished flights are kept; repair the disk, then run the same command again"
        elif name.startswith("SQLITE_BUSY"):
            why = f"{path}: another process has locked it for {_WAIT:g} s"
        else:
            why = f"{path}: is damaged, or not a journal of the harness ({error}): nothing was changed; move it away"
        raise StoreError(why) from None


def _format(journal: sqlite3.Connection, folder: Path, *, thorough: bool) -> int:
    """The format of the journal; 0 while it has no tables: a run may have been killed before it made them.

    Raises `StoreError` for a file that is no journal, or of a later format or, when `thorough`, is damaged.
    """
    ((application,),) = journal.execute("PRAGMA application_id")
    ((version,),) = journal.execute("PRAGMA user_version")
    path = folder / JOURNAL
    if not journal.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]:
        return 0
    if application != _APPLICATION:
        raise StoreError(f"{path}: is not a journal of the harness: nothing was changed; move it away")
    if not 1 <= version <= _FORMAT:
        raise StoreError(
            f"{path}: has format {version}, this harness reads formats 1 to {_FORMAT}: use the harness that wrote it, "
            "or another directory"
        )
    if thorough and (damage := journal.execute("PRAGMA quick_check(1)").fetchone()[0]) != "ok":
        raise StoreError(f"{path}: is damaged ({' '.join(damage.split())}): nothing was changed; move it away")
    return int(version)


def _upgrade(journal: sqlite3.Connection, version: int) -> None:
    """Makes a journal of today's format of one of this format."""
    if version == _FORMAT:
        return
    script = "".join(_UPGRADES[earlier] for earlier in range(version, _FORMAT)) if version else _TABLES
    journal.executescript(f"BEGIN; {script} PRAGMA user_version = {_FORMAT}; COMMIT;")


def _locked(path: Path) -> int:
    """Locks the file and returns it open. The system releases the lock when this process ends, however it ends."""
    import fcntl

    lock = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        fcntl.lockf(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        by = os.read(lock, 200).decode(errors="replace").strip()
        os.close(lock)
        if error.errno not in (EACCES, EAGAIN):
            why = f"its file system cannot lock a file ({error.strerror}): use a folder on another one"
            raise StoreError(f"{path.parent}: {why}") from None
        raise StoreError(f"{path.parent}: another run writes to it ({by}): wait for it, or use another --out") from None
    os.ftruncate(lock, 0)
    os.write(lock, f"process {os.getpid()} on {socket.gethostname()} since {now()}\n".encode())
    return lock
