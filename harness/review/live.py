"""Streams a flight to an open viewer while it is flown, at a given pace."""

import time
from collections.abc import Callable

import numpy as np
import rerun as rr

from harness.log import FlightLog
from harness.review.lanes import LANES, Change, lane_entity, lanes
from harness.review.layout import Content, layout
from harness.review.plots import Plot
from harness.review.recorder import Recorder
from harness.review.recording import content_of, log_lane, log_story, log_style, log_values
from harness.review.scene import log_airframe, log_motion, log_surroundings, log_target, log_trail
from harness.review.styled import StyledFlight, styled
from harness.review.viewer import PORT, ViewerError, address, listening

_EVERY = 0.1  # s of real time between two parcels
_LANES_EVERY = 1.0  # s
_PATIENCE = 2.0  # s: a parcel that takes longer means that the viewer is gone


class Live:
    """A `harness.loop.Watch` that streams the flight; `finish` adds what is known only at its end."""

    def __init__(self, name: str, title: str, pace: float, port: int = PORT) -> None:
        """`pace` is relative to real time; infinite means no waiting. Raises `ViewerError` when there is no viewer."""
        if not listening(port):
            raise ViewerError(f"no viewer listens on port {port}: open one with `harness view` in another terminal")
        self.gone = False  # the viewer was closed; the flight goes on
        self._name, self._title, self._pace, self._port = name, title, pace, port
        self._to = Recorder()
        self._to.stream.set_sinks(rr.GrpcSink(address(port)))
        self._to.stream.set_log_time_enabled(False)
        self._begin = self._last = self._last_lanes = time.monotonic()
        self._sent, self._trail = 0, 0  # rows
        self._lanes: dict[str, dict[float, str]] = {}  # the changes sent so far: by lane, by time

    def __call__(self, at: float, so_far: Callable[[], FlightLog]) -> None:
        """After each row of the log: keeps the pace, and sends the new rows every `_EVERY` seconds."""
        ahead = self._begin + at / self._pace - time.monotonic()
        if ahead > 0.0:
            time.sleep(ahead)
        now = time.monotonic()
        if now - self._last >= _EVERY and not self.gone:
            self._last = now
            self._send(so_far())

    def finish(self, log: FlightLog, command: str) -> None:
        """Sends the rest of the flight, its lanes, events and notes; `command` is shown as the way to repeat it."""
        if self.gone:
            return
        self._send(log)
        flights = styled({self._name: log})
        self._close_lanes(log)
        log_story(self._to, flights, self._title, "", command)
        self._flush()
        if not self.gone:
            self._to.stream.disconnect()

    def _send(self, log: FlightLog) -> None:
        """Sends the rows since the last parcel."""
        (flight,) = styled({self._name: log})
        new = FlightLog(log.flight, log.outcome, log.reason, log.table[self._sent :])
        if not len(new):
            return
        content = content_of([flight._replace(log=new)], [lane_entity(lane) for lane in LANES])
        if not self._sent:
            self._open(flight, content)
        for plot in (*content.overview, *content.aircraft, *content.target):
            self._send_plot(plot)
        log_target(self._to, new)
        log_motion(self._to, flight, new)
        since = FlightLog(log.flight, log.outcome, log.reason, log.table[self._trail :])
        self._trail += log_trail(self._to, flight, since)
        self._sent = len(log)
        if self._last - self._last_lanes >= _LANES_EVERY:
            self._last_lanes = self._last
            self._send_lanes(log)
        self._flush()

    def _open(self, flight: StyledFlight, content: Content) -> None:
        """Sends the layout of the whole flight and everything that does not change."""
        self._to.layout(layout(content._replace(until=flight.log.flight.duration, growing=True)))
        self._to.stream.send_recording_name(self._title)
        log_surroundings(self._to, flight.log)
        log_airframe(self._to, flight, [flight])
        for plot in (*content.overview, *content.aircraft, *content.target):
            for i, series in enumerate(plot.series):
                log_style(self._to, plot.entity(i), series)

    def _send_plot(self, plot: Plot) -> None:
        for i, series in enumerate(plot.series):
            log_values(self._to, plot.entity(i), series)

    def _send_lanes(self, log: FlightLog) -> None:
        """Sends the new changes, without those of the last window, which is not complete yet."""
        for name, changes in lanes(log).items():
            sent = self._lanes.setdefault(name, {})
            new = [c for c in changes if c.time not in sent and c.time < log["time"][-1] - 1.0]
            sent.update((change.time, change.state) for change in new)
            log_lane(self._to, lane_entity(name), new)

    def _close_lanes(self, log: FlightLog) -> None:
        """Sends the lanes of the whole flight, which may correct what a parcel sent earlier."""
        for name, changes in lanes(log).items():
            times = sorted({change.time for change in changes} | set(self._lanes.get(name, {})))
            since = np.searchsorted([change.time for change in changes], times, side="right") - 1
            final = [Change(at, changes[max(0, i)].state) for at, i in zip(times, since.tolist(), strict=True)]
            log_lane(self._to, lane_entity(name), final)

    def _flush(self) -> None:
        try:
            if listening(self._port):
                self._to.stream.flush(timeout_sec=_PATIENCE)
                return
        except Exception:  # Rerun raises no error of its own
            pass
        self.gone = True
