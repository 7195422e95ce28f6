"""The cost of recordings: `python -m benchmarks.recording_speed [TIMES [SECONDS]]`.

Writing a flight of 900 s, or as long as asked, at 20 Hz, with its estimator, in gusts, everything logged and drawn:
seconds, megabytes, channels; and from the start of the viewer's process until it has drawn a pair of such flights.
"""

import sys
import tempfile
import time
from pathlib import Path

from rerun.chunk import RrdReader

from benchmarks.flight_speed import spread
from harness.log import COLUMNS, FlightLog
from harness.loop import simulate
from harness.review.recording import write_recording
from harness.review.viewer import headless
from harness.settings import flight_from_document


def flown(plant: str, duration: float) -> FlightLog:
    """A flight that fills every column."""
    return simulate(
        flight_from_document(
            {
                "plant": plant,
                "duration_s": duration,
                "law": {"name": "nftsm", "gains": "paper_1", "max_heading_rate_deg_s": 10.0},
                "wind": {"steady_mps": [2.0, 0.0], "turbulence": "light"},
                "target": {"speed_mps": 1.0},
                "estimator": {"kind": "ekf"},
            }
        )
    )


def channels(path: Path) -> int:
    """Numbers with a time of their own: the log's columns, and the lines of the plots."""
    chunks = RrdReader(path).stream().filter(content=["/runs/**", "/plots/**"]).to_chunks()
    widths = {}
    for chunk in chunks:
        batch = chunk.to_record_batch()
        for name in ("Scalars:scalars", "Measurements:values"):
            if not chunk.is_static and name in batch.schema.names:
                widths[chunk.entity_path] = len(batch.column(name)[0])
    return sum(widths.values())


def written(path: Path, logs: dict[str, FlightLog]) -> float:
    """Seconds on the clock to write them."""
    begin = time.perf_counter()
    write_recording(path, logs, "Benchmark")
    return time.perf_counter() - begin


def opened(path: Path, shot: Path) -> float:
    """Seconds on the clock until the viewer has drawn it."""
    begin = time.perf_counter()
    with headless(path) as viewer:
        viewer.save_screenshot(str(shot))
        return time.perf_counter() - begin


def main(times: int = 5, duration: float = 900.0) -> None:
    """Print seconds and sizes."""
    kinematic, sixdof = (flown(plant, duration) for plant in ("kinematic", "sixdof"))
    with tempfile.TemporaryDirectory() as folder:
        one, pair = Path(folder) / "one.rrd", Path(folder) / "pair.rrd"
        written(one, {"sixdof": sixdof})
        seconds = [written(one, {"sixdof": sixdof}) for _ in range(times)]
        size = one.stat().st_size / 1e6
        print(f"{duration:g} s at 20 Hz, {len(COLUMNS)} columns, {channels(one)} channels with those drawn: ", end="")
        print(f"written in {spread(seconds)} s, {size:.1f} MB")
        written(pair, {"kinematic": kinematic, "sixdof": sixdof})
        shows = [opened(pair, Path(folder) / "shot.png") for _ in range(times)]
        print(f"a pair of them, {pair.stat().st_size / 1e6:.1f} MB: drawn {spread(shows)} s after the viewer's start")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
