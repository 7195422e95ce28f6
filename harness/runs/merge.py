"""Several runs of one experiment as one: what several machines flew, each a shard of it."""

import os
import shutil
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

from harness.files import make_folder
from harness.plants.plant import Outcome
from harness.runs.journal import JOURNAL, StoreError, reading
from harness.runs.store import FLIGHTS, last_run

_FAILED = ", ".join(repr(outcome.value) for outcome in Outcome if outcome.failed)
_MOST_KEYS = 3  # largest number of keys listed one by one


class Merged(NamedTuple):
    """The result of a merge. Counts are of flights."""

    flights: int
    twice: int  # flown by several of them, with the same digest
    apart: tuple[str, ...]  # keys of those flown by several, with different digests: the first run's is kept


def merge(folders: Sequence[Path], to: Path) -> Merged:
    """Makes one run of these, whole or not at all; each row and recording is kept as it is.

    For a flight in several folders the first row is kept, a failed one only if all have failed. Raises
    `StoreError` for folders without a run, runs of different experiments, and a folder `to` that is not empty.
    """
    if to.exists() and (not to.is_dir() or any(to.iterdir())):
        raise StoreError(f"{to}: exists already: merge into a new folder")
    _check_one_experiment(folders)
    partial = to.with_name(f".{to.name}.{os.getpid()}.partial")
    try:
        make_folder(partial)
        merged = _journal(folders, partial / JOURNAL)
        for path in _recordings(folders, partial):
            (partial / FLIGHTS).mkdir(exist_ok=True)
            if not (partial / FLIGHTS / path.name).exists():
                shutil.copy2(path, partial / FLIGHTS)
        partial.replace(to)
    finally:
        shutil.rmtree(partial, ignore_errors=True)
    return merged


def _check_one_experiment(folders: Sequence[Path]) -> None:
    first, *others = [last_run(folder) for folder in folders]
    for folder, other in zip(folders[1:], others, strict=True):
        if other["settings"] != first["settings"]:
            raise StoreError(
                f"{folder}: is a run of another settings file than {folders[0]}: to compare them, harness compare "
                f"{folders[0]} {folder}"
            )


def _journal(folders: Sequence[Path], path: Path) -> Merged:
    """Writes the journal of all."""
    twice, apart = 0, list[str]()
    with closing(sqlite3.connect(path, isolation_level=None)) as journal:
        with reading(folders[0]) as first:
            first.backup(journal)
        journal.execute("BEGIN")
        for folder in folders[1:]:
            with reading(folder) as other:
                same, different = _add(journal, other)
            twice, apart = twice + same, [*apart, *different]
        journal.execute("UPDATE state SET id = lower(hex(randomblob(16)))")
        journal.execute("COMMIT")
        ((flights,),) = journal.execute("SELECT count(*) FROM flights")
    return Merged(flights, twice, tuple(apart))


def _add(journal: sqlite3.Connection, other: sqlite3.Connection) -> tuple[int, list[str]]:
    """Adds the rows of another journal: how many were there with the same digest, and the keys with another one."""
    ((runs,),) = journal.execute("SELECT coalesce(max(id), 0) FROM runs")
    for table in ("files", "versions", "positions"):
        _copy(journal, other, "INSERT OR IGNORE", table, f"SELECT * FROM {table}")
    columns = ", ".join(name for _, name, *_ in other.execute("PRAGMA table_info(runs)") if name != "id")
    _copy(journal, other, "INSERT", f"runs (id, {columns})", f"SELECT id + {runs}, {columns} FROM runs")
    names = [name for _, name, *_ in other.execute("PRAGMA table_info(flights)")]
    chosen = ", ".join(f"run + {runs}" if name == "run" else name for name in names)
    known = dict(journal.execute(f"SELECT key, digest FROM flights WHERE outcome NOT IN ({_FAILED})"))
    same, apart = 0, []
    for failed, *row in other.execute(f"SELECT outcome IN ({_FAILED}), {chosen} FROM flights ORDER BY key"):
        key, digest = row[names.index("key")], row[names.index("digest")]
        if key not in known:
            verb = "INSERT OR IGNORE" if failed else "INSERT OR REPLACE"  # a failed one replaces none
            journal.execute(f"{verb} INTO flights VALUES ({', '.join('?' * len(names))})", row)
        elif not failed:
            same += digest == known[key]
            apart += [key] if digest != known[key] else []
    return same, apart


def _copy(journal: sqlite3.Connection, other: sqlite3.Connection, verb: str, table: str, rows: str) -> None:
    found = other.execute(rows)
    journal.executemany(f"{verb} INTO {table} VALUES ({', '.join('?' * len(found.description))})", found)


def _recordings(folders: Sequence[Path], merged: Path) -> Iterator[Path]:
    """The recordings of the rows that are kept, by their digests, where several runs flew a flight."""
    kept = _digests(merged)
    for folder in folders:
        own = _digests(folder)
        for path in sorted((folder / FLIGHTS).glob("*.rrd")):
            if path.stem in own and own[path.stem] == kept[path.stem]:
                yield path


def _digests(folder: Path) -> dict[str, str]:
    with reading(folder) as journal:
        return dict(journal.execute("SELECT key, digest FROM flights"))


def told(merged: Merged) -> Iterator[str]:
    """Remarks on a merge, in sentences."""
    if merged.twice:
        yield f"{merged.twice} flown by several runs, bit-identical: kept once"
    if merged.apart:
        keys = ", ".join(key[:8] for key in merged.apart[:_MOST_KEYS]) + ("…" if len(merged.apart) > _MOST_KEYS else "")
        yield (
            f"warning: {len(merged.apart)} flown by several runs with different bits ({keys}): the first run's are "
            "kept; `harness doctor` on each machine says by how much its bits differ"
        )
