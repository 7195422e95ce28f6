"""A Rerun stream as the harness writes it: one timeline, whole columns, whole nanoseconds."""

from collections.abc import Iterable

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
import rerun_bindings
from numpy.typing import NDArray

Array = NDArray[np.float64]

APPLICATION = "standoff-harness"


class Recorder:
    """Sends to one Rerun recording stream."""

    TIMELINE = "sim_time"

    def __init__(self) -> None:
        self.stream = rr.RecordingStream(APPLICATION, send_properties=False)  # the hour of writing says nothing

    @staticmethod
    def flight(name: str) -> str:
        """The entity under which a flight is."""
        return rr.new_entity_path(["runs", name])

    def once(self, entity: str, what: rr.AsComponents) -> None:
        """For all times."""
        self.stream.log(entity, what, static=True, strict=True)

    def columns(self, entity: str, time: Array, columns: Iterable[rr.ComponentColumn]) -> None:
        """Whole columns, a row per time in s. Stamps are whole nanoseconds: floats it truncates, one off at times."""
        stamps = np.rint(time * 1e9).astype("timedelta64[ns]")
        self.stream.send_columns(entity, [rr.TimeColumn(self.TIMELINE, duration=stamps)], columns, strict=True)

    def layout(self, layout: rrb.Blueprint) -> None:
        """`stream.send_blueprint(layout)`, which in Rerun 0.41 leaves two threads and 2 MB behind, done by hand."""
        blueprint = rr.RecordingStream._from_native(rerun_bindings.new_blueprint(APPLICATION, False, False))
        blueprint.set_time("blueprint", sequence=0)
        layout._log_to_stream(blueprint)
        memory = blueprint.memory_recording().storage
        rerun_bindings.send_blueprint(memory, True, True, recording=self.stream.to_native())
        blueprint.disconnect()


def clean_up() -> None:
    """Ends the threads that Rerun keeps for every stream that was dropped."""
    rerun_bindings.flush_and_cleanup_orphaned_recordings()
