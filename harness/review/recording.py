"""Writes flights into a recording: everything is logged to a Rerun stream, then written to a file."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import rerun as rr

from harness.files import as_text, replacing
from harness.log import FlightLog
from harness.review.charts import charts, log_chart
from harness.review.differences import difference_plots
from harness.review.lanes import BRIEF, COLOURS, Change, events, lanes, lanes_by_flight, without_cut_words
from harness.review.layout import Content, layout, word_length
from harness.review.notes import flight_json, metric_notes, result_notes, settings_notes
from harness.review.plots import Plot, Series, aircraft_plots, end, overview_plots
from harness.review.recorder import Recorder, clean_up
from harness.review.scene import log_airframe, log_motion, log_surroundings, log_target, log_tracks, log_trail
from harness.review.seal import TEXT, sealed
from harness.review.styled import StyledFlight, styled
from harness.review.target_plots import target_plots

Logs = Mapping[str, FlightLog]


def write_recording(path: Path, logs: Logs, title: str, notes: str = "", command: str = "") -> None:
    """Writes flights by name into one .rrd file with its own layout; the file is complete or absent.

    The first flight is the reference; of two it is drawn wide and pale. `notes` is Markdown, shown above the
    results; `command` is shown as the way to repeat the recording. Raises OSError when the file cannot be written,
    ValueError for more flights than `styled.MOST`.
    """
    try:
        content = sealed(_encoded(logs, title, notes, command))
    finally:
        clean_up()
    with replacing(path) as partial:
        partial.write_bytes(content)


def content_of(flights: Sequence[StyledFlight], lanes: Sequence[str]) -> Content:
    """All plots of these flights, to be laid out beside the lanes of these entities."""
    return Content(
        flights,
        overview_plots(flights),
        difference_plots(flights),
        aircraft_plots(flights),
        target_plots(flights),
        charts(flights),
        lanes,
        end(flights),
    )


def log_series(to: Recorder, plot: Plot) -> None:
    """Logs the lines of a plot."""
    for i, series in enumerate(plot.series):
        log_style(to, plot.entity(i), series)
        log_values(to, plot.entity(i), series)


def log_style(to: Recorder, entity: str, series: Series) -> None:
    """Logs names, colours and widths. Zoomed out, Rerun's default halves peaks; `MinMax` keeps both."""
    both_peaks = rr.components.AggregationPolicy.MinMax
    looks = rr.Measurements if series.variances is not None else rr.SeriesLines
    names, colours, widths = series[:3]
    to.once(entity, looks.from_fields(names=names, colors=colours, widths=widths, aggregation_policy=both_peaks))


def log_values(to: Recorder, entity: str, series: Series) -> None:
    """Logs the values; of constant lines only the first and the last."""
    time, values, variances = series.time, series.values, series.variances
    if len(values) > 2 and variances is None and (values == values[0]).all():
        time, values = time[[0, -1]], values[[0, -1]]
    lines = [values.shape[1]] * len(values)
    if variances is None:
        columns = rr.Scalars.columns(scalars=values.ravel())
    else:
        columns = rr.Measurements.columns(values=values.ravel(), variances=variances.ravel())
    to.columns(entity, time, columns.partition(lines))


def log_rows(to: Recorder, name: str, rows: FlightLog) -> None:
    """Logs the rows of the log unchanged, as vectors: they take a third of the space of an entity per column."""
    entity = f"{to.flight(name)}/log"
    to.once(entity, rr.SeriesLines(names=rows.columns))
    vectors = rr.Scalars.columns(scalars=rows.whole.ravel()).partition([len(rows.columns)] * len(rows))
    to.columns(entity, rows["time"], vectors)


def log_lane(to: Recorder, entity: str, changes: Sequence[Change]) -> None:
    """Logs a lane of states, each in its colour."""
    states = [*COLOURS, *(f"{BRIEF}{state}" for state in COLOURS)]
    to.once(entity, rr.StateConfiguration(values=states, labels=states, colors=2 * [*COLOURS.values()]))
    times = np.array([change.time for change in changes])
    to.columns(entity, times, rr.StateChange.columns(state=[change.state for change in changes]))


def log_story(to: Recorder, flights: Sequence[StyledFlight], title: str, notes: str, command: str) -> None:
    """Logs what is known once the flights are over: lanes, events, tracks, charts, results and settings."""
    several = len(flights) > 1
    by_lane = lanes_by_flight({flight.name: flight.log for flight in flights})
    content = content_of(flights, list(by_lane))
    for lane, changes in by_lane.items():
        log_lane(to, lane, without_cut_words(changes, content.until, partial(word_length, content)))
    for chart in charts(flights):
        log_chart(to, chart)
    for i, flight in enumerate(flights):
        entity = to.flight(flight.name)
        to.once(f"{entity}/flight", rr.TextDocument(flight_json(flight.log, i)))
        log_tracks(to, flight, flight.log)
        own_lanes = lanes(flight.log)
        happened = events(flight.log, own_lanes, shared=i == 0)
        texts = rr.TextLog.columns(
            text=[f"{flight.name}: {event.text}" if several else event.text for event in happened],
            level=[event.level for event in happened],
            color=[flight.colour] * len(happened),
        )
        to.columns(rr.new_entity_path(["events", flight.name]), np.round([event.time for event in happened], 1), texts)
    markdown = rr.MediaType.MARKDOWN
    to.once("/notes/metrics", rr.TextDocument(metric_notes(flights), media_type=markdown))
    to.once("/notes/result", rr.TextDocument(result_notes(flights, title, notes, command), media_type=markdown))
    to.once("/notes/settings", rr.TextDocument(settings_notes(flights), media_type=markdown))


def _encoded(logs: Logs, title: str, notes: str, command: str) -> bytes:
    """The content of the file, made in memory: Rerun's own file sink never returns when the disk is full."""
    to = Recorder()
    memory = to.stream.memory_recording()
    log_flights(to, logs, title, notes, command)
    data = memory.drain_as_bytes()
    to.stream.disconnect()
    return data


def log_flights(to: Recorder, logs: Logs, title: str, notes: str = "", command: str = "") -> None:
    """Logs flights by name with their layout: see `write_recording`."""
    flights = styled({as_text(name): log for name, log in logs.items()})
    content = content_of(flights, list(lanes_by_flight({flight.name: flight.log for flight in flights})))
    to.stream.set_log_time_enabled(False)
    to.once("/notes/checksum", rr.TextDocument(TEXT))
    to.layout(layout(content))
    to.stream.send_recording_name(as_text(title))
    log_surroundings(to, flights[0].log)
    log_target(to, max((flight.log for flight in flights), key=len))
    for flight in flights:
        log_rows(to, flight.name, flight.log)
        log_airframe(to, flight, flights)
        log_motion(to, flight, flight.log)
        log_trail(to, flight, flight.log)
    for plot in (*content.overview, *content.differences, *content.aircraft, *content.target):
        log_series(to, plot)
    log_story(to, flights, title, notes, command)
