"""The journal of a run: a file of SQLite, its format, who may write to it, and what is wrong with it."""

import os
import socket
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from errno import EACCES, EAGAIN
from pathlib import Path

from harness.error import HarnessError
from harness.provenance import Provenance, now
from harness.toml_text import shortened

JOURNAL = "journal.sqlite"
_APPLICATION = 0x53544F46  # "STOF", SQLite's application id of the journal
_FORMAT = 3  # of the journal, in SQLite's user_version
_RANDOM = "lower(hex(randomblob(16)))"
WAIT = 60.0  # s, for another process to let go of the journal

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


@contextmanager
def reading(folder: Path, *, thorough: bool = False) -> Iterator[sqlite3.Connection]:
    """The journal, open for reading, also while a run writes to it; one of an earlier format as an upgraded copy.

    With `thorough` all of it is checked for damage, also what is not read. Raises `StoreError`; also where what is done
    with it fails, since that is to take its rows apart.
    """
    path = folder / JOURNAL
    if not path.is_file():
        raise StoreError(f"{folder}: holds no results of `harness run` (there is no {JOURNAL})")
    with store_errors(folder):
        # Opened for writing where that is allowed: a run that was killed may have left half a commit to roll back.
        mode = "rw" if os.access(path, os.W_OK) and os.access(folder, os.W_OK) else "ro"
        journal = sqlite3.connect(f"{path.absolute().as_uri()}?mode={mode}", uri=True, timeout=WAIT)
        with closing(journal), closing(sqlite3.connect("")) as copy:
            journal.execute("PRAGMA query_only = ON")
            journal.execute("PRAGMA trusted_schema = OFF")  # the file may come from another user
            version = format_of(journal, folder, thorough=thorough)
            if version != _FORMAT:
                journal.backup(copy)
                upgrade(copy, version)
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


def has_grown(journal: sqlite3.Connection) -> None:
    """Notes that flights were added: see `state`."""
    journal.execute(f"UPDATE state SET id = {_RANDOM}")


def state(journal: sqlite3.Connection) -> str:
    """A random text that is new whenever flights were added: equal exactly for one journal with the same flights."""
    ((text,),) = journal.execute("SELECT id FROM state")
    return str(text)


@contextmanager
def store_errors(folder: Path) -> Iterator[None]:
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
            why = f"{path}: another process has locked it for {WAIT:g} s"
        else:
            why = f"{path}: is damaged, or not a journal of the harness ({error}): nothing was changed; move it away"
        raise StoreError(why) from None


def format_of(journal: sqlite3.Connection, folder: Path, *, thorough: bool) -> int:
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


def upgrade(journal: sqlite3.Connection, version: int) -> None:
    """Makes a journal of today's format of one of this format."""
    if version == _FORMAT:
        return
    script = "".join(_UPGRADES[earlier] for earlier in range(version, _FORMAT)) if version else _TABLES
    journal.executescript(f"BEGIN; {script} PRAGMA user_version = {_FORMAT}; COMMIT;")


def locked(path: Path) -> int:
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
