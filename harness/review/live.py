"""A flight shown while it is flown: streamed to an open viewer, at a pace."""

import time
from collections.abc import Callable

import numpy as np
import rerun as rr

from harness.log import FlightLog
from harness.review.lanes import Change, lanes
from harness.review.layout import Content, layout
from harness.review.plots import Plot
from harness.review.recorder import Recorder
from harness.review.recording import content_of, log_lane, log_story, log_style, log_values
from harness.review.scene import log_airframe, log_motion, log_surroundings, log_target, log_trail
from harness.review.styled import StyledFlight, styled
from harness.review.viewer import PORT, ViewerError, address, listening

_EVERY = 0.1  # s, on the clock: between two parcels
_LANES_EVERY = 1.0  # s
_PATIENCE = 2.0  # s: longer than this no parcel takes, unless the viewer is gone


class Live:
    """Watches a flight (`harness.loop.Watch`) and streams it; `finish` tells what is known only in the end."""

    def __init__(self, name: str, title: str, pace: float, port: int = PORT) -> None:
        """`pace` is times real time; infinite: as fast as it flies. Raises `ViewerError` when there is no viewer."""
        if not listening(port):
            raise ViewerError(f"no viewer listens on port {port}: open one with `harness view` in another terminal")
        self.gone = False  # the viewer was closed; the flight goes on
        self._name, self._title, self._pace, self._port = name, title, pace, port
        self._to = Recorder()
        self._to.stream.set_sinks(rr.GrpcSink(address(port)))
        self._to.stream.set_log_time_enabled(False)
        self._begin = self._last = self._last_lanes = time.monotonic()
        self._sent, self._trail = 0, 0  # rows
        self._lanes: dict[str, dict[float, str]] = {}  # what was sent

    def __call__(self, at: float, so_far: Callable[[], FlightLog]) -> None:
        """After each row: waits for the clock, and now and then sends what is new."""
        ahead = self._begin + at / self._pace - time.monotonic()
        if ahead > 0.0:
            time.sleep(ahead)
        now = time.monotonic()
        if now - self._last >= _EVERY and not self.gone:
            self._last = now
            self._send(so_far())

    def finish(self, log: FlightLog, command: str) -> None:
        """The rest of the flight, and the story of the whole."""
        if self.gone:
            return
        self._send(log)
        one = styled({self._name: log})
        self._close_lanes(log)
        log_story(self._to, one, self._title, "", command)
        self._flush()
        if not self.gone:
            self._to.stream.disconnect()

    def _send(self, log: FlightLog) -> None:
        """The rows since the last parcel."""
        (one,) = styled({self._name: log})
        new = FlightLog(log.flight, log.outcome, log.reason, log.table[self._sent :])
        if not len(new):
            return
        content = content_of([one._replace(log=new)], lanes=2 + (log.flight.plant == "sixdof"))
        if not self._sent:
            self._open(one, content)
        for plot in (*content.overview, *content.aircraft, *content.target):
            self._send_plot(plot)
        log_target(self._to, new)
        log_motion(self._to, one, new)
        since = FlightLog(log.flight, log.outcome, log.reason, log.table[self._trail :])
        self._trail += log_trail(self._to, one, since)
        self._sent = len(log)
        if self._last - self._last_lanes >= _LANES_EVERY:
            self._last_lanes = self._last
            self._send_lanes(log)
        self._flush()

    def _open(self, one: StyledFlight, content: Content) -> None:
        """The layout for the whole flight, though it has just begun."""
        self._to.layout(layout(content._replace(until=one.log.flight.duration, growing=True)))
        self._to.stream.send_recording_name(self._title)
        log_surroundings(self._to, one.log)
        log_airframe(self._to, one, [one])
        for plot in (*content.overview, *content.aircraft, *content.target):
            for i, series in enumerate(plot.series):
                log_style(self._to, _entity(plot, i), series)

    def _send_plot(self, plot: Plot) -> None:
        for i, series in enumerate(plot.series):
            log_values(self._to, _entity(plot, i), series)

    def _send_lanes(self, log: FlightLog) -> None:
        """The changes that are new, but for the last window, which is not full yet."""
        for name, changes in lanes(log).items():
            sent = self._lanes.setdefault(name, {})
            new = [c for c in changes if c.time not in sent and c.time < log["time"][-1] - 1.0]
            sent.update((change.time, change.state) for change in new)
            log_lane(self._to, name, new)

    def _close_lanes(self, log: FlightLog) -> None:
        """The lanes as the whole flight has them, also where a parcel said otherwise."""
        for name, changes in lanes(log).items():
            times = sorted({change.time for change in changes} | set(self._lanes.get(name, {})))
            since = np.searchsorted([change.time for change in changes], times, side="right") - 1
            final = [Change(at, changes[max(0, i)].state) for at, i in zip(times, since.tolist(), strict=True)]
            log_lane(self._to, name, final)

    def _flush(self) -> None:
        try:
            if listening(self._port):
                self._to.stream.flush(timeout_sec=_PATIENCE)
                return
        except Exception:  # Rerun has no name for it
            pass
        self.gone = True


def _entity(plot: Plot, i: int) -> str:
    return f"/plots/{plot.name}/{i:02}"
