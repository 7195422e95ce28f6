"""Writes a recording of anything over time: plots, charts with a place that moves, events, and notes."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from harness.files import as_text, replacing
from harness.review.charts import FOLDER, Chart, chart_view, log_chart
from harness.review.plots import Plot
from harness.review.recorder import Recorder, clean_up
from harness.review.recording import log_series
from harness.review.seal import TEXT, sealed
from harness.review.styled import Colour

Array = NDArray[np.float64]
_LEGEND = 0.25  # of the time in view: room for the legends
_ORANGE: Colour = (255, 150, 40)


class Moving(NamedTuple):
    """A point that moves on a chart, at times in s, (times, 2) in the units of the chart."""

    chart: str
    time: Array
    places: Array


def write_plain(
    path: Path,
    title: str,
    plots: Sequence[Plot],
    charts: Sequence[Chart],
    moving: Sequence[Moving],
    events: Mapping[float, str],
    notes: str,
) -> None:
    """Writes the .rrd file, complete or not at all; `notes` is Markdown. Raises OSError."""
    try:
        content = sealed(_encoded(title, plots, charts, moving, events, notes))
    finally:
        clean_up()
    with replacing(path) as partial:
        partial.write_bytes(content)


def _encoded(
    title: str,
    plots: Sequence[Plot],
    charts: Sequence[Chart],
    moving: Sequence[Moving],
    events: Mapping[float, str],
    notes: str,
) -> bytes:
    to = Recorder()
    memory = to.stream.memory_recording()
    to.stream.set_log_time_enabled(False)
    to.once("/notes/checksum", rr.TextDocument(TEXT))
    to.layout(_layout(plots, charts, events))
    to.stream.send_recording_name(as_text(title))
    for plot in plots:
        log_series(to, plot)
    for chart in charts:
        log_chart(to, chart)
    for point in moving:
        chart = next(chart for chart in charts if chart.name == point.chart)
        entity = f"/{FOLDER}/{chart.name}/moving/00"
        to.once(entity, rr.Points2D.from_fields(colors=_ORANGE, radii=-5.0))
        to.columns(entity, point.time, rr.Points2D.columns(positions=chart.placed(*point.places.T)))
    if events:
        texts = rr.TextLog.columns(text=[as_text(text) for text in events.values()], level=["INFO"] * len(events))
        to.columns("/events", np.array(list(events)), texts)
    to.once("/notes/result", rr.TextDocument(as_text(notes), media_type=rr.MediaType.MARKDOWN))
    data = memory.drain_as_bytes()
    to.stream.disconnect()
    return data


def _layout(plots: Sequence[Plot], charts: Sequence[Chart], events: Mapping[float, str]) -> rrb.Blueprint:
    """Charts and what was said on the left, the plots on the right with one time axis."""
    views: list[rrb.View | rrb.Container] = [chart_view(chart) for chart in charts]
    views.append(rrb.TextDocumentView(origin="/notes/result", name="What the flight says"))
    if events:
        columns = rrb.TextLogColumns(timeline_columns=[Recorder.TIMELINE], text_log_columns=["Body"])
        views.append(rrb.TextLogView(origin="/events", name="Events", columns=columns))
    times = [series.time for plot in plots for series in plot.series]
    ends = (min(t[0] for t in times), max(t[-1] for t in times)) if times else (0.0, 1.0)
    ends = (ends[0], ends[1] + _LEGEND * (ends[1] - ends[0]))
    whole = rrb.TimeRange(*(rrb.TimeRangeBoundary.absolute(seconds=float(end)) for end in ends))
    strips = [
        rrb.TimeSeriesView(
            origin="/",
            contents=[plot.entity(i) for i in range(len(plot.series))],
            name=plot.title,
            axis_x=rrb.TimeAxis(link="Independent", view_range=whole),
            axis_y=rrb.ScalarAxis(range=plot.span),
            plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop),
        )
        for plot in plots
    ]
    shares = [*[3.0] * len(charts), 3.5, *([1.0] if events else [])]
    return rrb.Blueprint(
        rrb.Horizontal(rrb.Vertical(*views, row_shares=shares), rrb.Vertical(*strips), column_shares=(2.0, 3.0)),
        rrb.TimePanel(state="collapsed", timeline=Recorder.TIMELINE, playback_speed=10.0, play_state="paused"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
    )
