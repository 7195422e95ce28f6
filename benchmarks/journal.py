"""What one process can keep: `python -m benchmarks.journal [FLIGHTS]`, and what follows for runs on many machines.

FLIGHTS empty flights, 1 000 000 if not said otherwise, go through all that the client of a cluster does beside Dask:
key, message, row, journal. From that, and from what a flight takes, follows what limits a run of 1e6 and of 1e8.
"""

import pickle
import sys
import tempfile
import time
import zlib
from collections.abc import Iterator
from pathlib import Path

from benchmarks.measured import keep
from benchmarks.runs import matrix
from harness.key import files, identity
from harness.loop import simulate
from harness.provenance import provenance
from harness.runs.far import FarFlight
from harness.runs.journal import JOURNAL
from harness.runs.parcels import Parcels
from harness.runs.row import result_of, row
from harness.runs.store import Store
from harness.runs.wall_time import typical_wall_time
from harness.runs.workers import WorkerResult
from harness.tables import markdown

PAGE = Path("docs/guide/cluster.md")
_CHUNK = 100  # flights in a message
_HEADINGS = (
    "flights of 100 s", "plant", "core-hours of the workers", "hours of the client", "workers it can feed", "journal",
    "messages",
)  # fmt: skip


def kept(folder: Path, count: int) -> tuple[float, float, float]:
    """Processor seconds of a flight in the client, bytes of it in the journal, and bytes of its messages."""
    of = matrix(folder, "kinematic", 1.0, count)
    parcels, orders, answers, sent = Parcels(), [], [], 0
    begin = time.process_time()
    with Store(folder / "out") as store:
        store.begin(provenance(of.file.path, of.file.text, "", ""))
        result = None
        for combination in of.combinations():
            flight = of.flight(combination)
            result = result or result_of(simulate(flight), 0.01)
            one = identity(flight)
            store.place(of.identifier, combination.position, one.key)
            packed = parcels.packed(flight)
            orders.append(FarFlight(one.key, combination.position, packed, one.version.number, "none", False))
            own = result._replace(metrics=dict(result.metrics), final=dict(result.final))
            answers.append((WorkerResult(own, one.version.number), b""))
            if len(orders) == _CHUNK:
                sent += len(zlib.compress(pickle.dumps(orders), 1)) + len(answer := pickle.dumps(answers))
                pickle.loads(answer)
                orders, answers = [], []
            store.add_version(one.version, files(flight))
            store.add(row(flight, one, result), result, one.version.number, combination.position)
    used = time.process_time() - begin
    return used / count, (folder / "out" / JOURNAL).stat().st_size / count, sent / count


def flight_time(folder: Path, plant: str) -> float:
    """The wall time that a flight of 100 s is estimated to take, s."""
    of = matrix(folder, plant, 100.0, 1)
    return typical_wall_time(of.flight(next(of.combinations())))


def block(folder: Path, count: int) -> Iterator[str]:
    """What was measured with so many flights, and what follows for more, in Markdown."""
    seconds, stored, sent = kept(folder, count)
    yield (
        f"On paper, from one measured point: {count} empty flights through keys, messages and journal took "
        f"{1e3 * seconds:.2f} ms of the client each,"
    )
    yield f"{stored:.0f} bytes of the journal and {sent:.0f} bytes of messages, without Dask's own work."
    yield ""
    rows = [
        (
            f"1e{len(str(flights)) - 1}", plant, f"{flights * took / 3600:.0f}", f"{flights * seconds / 3600:.2g}",
            f"{took / seconds:.0f}", f"{flights * stored / 1e9:.3g} GB", f"{flights * sent / 1e9:.2g} GB",
        )
        for plant, took in ((plant, flight_time(folder, plant)) for plant in ("kinematic", "sixdof"))
        for flights in (10**6, 10**8)
    ]  # fmt: skip
    yield from markdown(_HEADINGS, rows, "rlr")


def main(count: int = 1_000_000, *, page: Path | None = None) -> None:
    """Print what was measured, and write it into the page."""
    with tempfile.TemporaryDirectory() as temporary:
        text = "\n".join(block(Path(temporary), count)) + "\n"
    print(text, end="")
    if page:
        keep(page, "benchmarks.journal", text)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]), page=PAGE)
