"""The Rerun stream of a recording: one timeline, complete columns, times in whole nanoseconds."""

from collections.abc import Iterable

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
import rerun_bindings
from numpy.typing import NDArray

Array = NDArray[np.float64]

APPLICATION = "standoff-harness"


class Recorder:
    """Logs to one Rerun recording stream."""

    TIMELINE = "sim_time"

    def __init__(self) -> None:
        self.stream = rr.RecordingStream(
            APPLICATION, send_properties=False
        )  # without the time of writing: equal flights give equal recordings

    @staticmethod
    def flight(name: str) -> str:
        """The path of the entity that holds a flight."""
        return rr.new_entity_path(["runs", name])

    def once(self, entity: str, what: rr.AsComponents) -> None:
        """Logs something that holds at all times."""
        self.stream.log(entity, what, static=True, strict=True)

    def columns(self, entity: str, time: Array, columns: Iterable[rr.ComponentColumn]) -> None:
        """Logs columns, one row per time in s. Times are rounded to nanoseconds, which Rerun would truncate."""
        stamps = np.rint(time * 1e9).astype("timedelta64[ns]")
        self.stream.send_columns(entity, [rr.TimeColumn(self.TIMELINE, duration=stamps)], columns, strict=True)

    def layout(self, layout: rrb.Blueprint) -> None:
        """Sends the layout. `stream.send_blueprint(layout)` of Rerun 0.41 would leave two threads and 2 MB behind."""
        blueprint = rr.RecordingStream._from_native(rerun_bindings.new_blueprint(APPLICATION, False, False))
        blueprint.set_time("blueprint", sequence=0)
        layout._log_to_stream(blueprint)
        memory = blueprint.memory_recording().storage
        rerun_bindings.send_blueprint(memory, True, True, recording=self.stream.to_native())
        blueprint.disconnect()


def clean_up() -> None:
    """Ends the threads that Rerun keeps for streams that are no longer used."""
    rerun_bindings.flush_and_cleanup_orphaned_recordings()
