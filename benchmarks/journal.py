"""What one process can keep: `python -m benchmarks.journal [FLIGHTS]`, and what follows for runs on many machines.

FLIGHTS empty flights, 1 000 000 if not said otherwise, go through all that the client of a cluster does beside Dask:
key, message, row, journal. From that, and from what a flight takes, follows what limits a run of 1e6 and of 1e8.
"""

import pickle
import sys
import tempfile
import time
import zlib
from pathlib import Path

from benchmarks.runs import matrix
from harness.key import files, identity
from harness.loop import simulate
from harness.provenance import provenance
from harness.runs.far import FarFlight
from harness.runs.parcels import Parcels
from harness.runs.row import result_of, row
from harness.runs.store import JOURNAL, Store
from harness.runs.wall_time import typical_wall_time
from harness.runs.workers import WorkerResult

_CHUNK = 100  # flights in a message


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


def main(count: int = 1_000_000) -> None:
    """Print the numbers."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        seconds, stored, sent = kept(folder, count)
        print(f"measured with {count} empty flights: {1e3 * seconds:.2f} ms of the client a flight,")
        print(f"{stored:.0f} bytes of it in the journal, {sent:.0f} bytes of its messages")
        print()
        print("| flights of 100 s | plant | core-hours of the workers | hours of the client | workers it can feed |"
              " journal | messages |")  # fmt: skip
        print("|--:|---|--:|--:|--:|--:|--:|")
        for plant in ("kinematic", "sixdof"):
            of = matrix(folder, plant, 100.0, 1)
            one = typical_wall_time(of.flight(next(iter(of.combinations()))))
            for flights in (10**6, 10**8):
                print(
                    f"| 1e{len(str(flights)) - 1} | {plant} | {flights * one / 3600:.3g} |"
                    f" {flights * seconds / 3600:.2g} | {one / seconds:.0f} | {flights * stored / 1e9:.3g} GB |"
                    f" {flights * sent / 1e9:.2g} GB |"
                )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
