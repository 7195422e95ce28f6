"""The layout of a recording: its tabs and views, with room for a legend beside the curves of each plot."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal, NamedTuple

import rerun as rr
import rerun.blueprint as rrb

from harness.review import value_axis
from harness.review.charts import Chart, chart_view
from harness.review.lanes import LANES_OF_SEVERAL
from harness.review.plots import DECADES, Plot
from harness.review.recorder import Recorder
from harness.review.scene import chase_view, scene_view
from harness.review.styled import WORDS, Colour, StyledFlight, is_crowd
from harness.review.value_axis import Size

_WIDTH, _HEIGHT = 1600.0, 905.0  # points: all tabs in a window 1600 wide and 1000 high
_RIGHT = 950.0  # points: width of the column of plots in the overview
_LANE, _LANES = 40.5, 62.0  # points: height of a lane, and of the frame around all lanes
_LANE_OF_MANY = 320.0  # points: width of the lanes of many flights
_LANE_LETTER, _BESIDE_WORD = 6.2, 12.0  # points: width of a letter in a lane, and of the room beside its word
_MOST_LANES_WITH_SIDESLIP = 4  # more leave no room for that plot in the overview
_EVENTS = 190.0  # points: height of the events
_METRIC, _METRICS = 26.0, 75.0  # points: height of a row of the metrics, and of the rest of them
_LETTER, _BESIDE_LETTERS = 6.1, 55.0  # points: width of a letter in a legend, and of the rest of it
_DECADES = 190.0  # points: height in which each power of ten has its label
_ENTRY, _AROUND_LEGEND = 23.5, 70.0  # points: height of a line of a legend, and of the rest of its row
_AXIS = 35.0  # points: the usual width of the numbers beside a plot
_LABEL = 30.0  # points: half of a label below a plot
_NEAR = ("range_error", "sliding_variable")  # around the cursor their axes follow the values in view
_CURSOR = 30.0  # s to either side of the cursor
_STEPS = (1.0, 10.0, 60.0, 600.0, 3600.0)  # s between the labels below plots
_IN_FRONT_OF: Colour = (72, 72, 72)  # the other flights, where one is in front
PlayState = Literal["following", "paused"]
Tab = rrb.Container | rrb.View


class Content(NamedTuple):
    """Everything that is laid out."""

    flights: Sequence[StyledFlight]
    overview: Sequence[Plot]
    differences: Sequence[Plot]
    aircraft: Sequence[Plot]
    target: Sequence[Plot]
    charts: Sequence[Chart]
    lanes: Sequence[str]  # entities
    until: float  # s: the end of the time axis of plots over a whole flight
    growing: bool = False  # a flight is shown while it is flown: the range of its values is not known yet

    @property
    def crowd(self) -> bool:
        return is_crowd(self.flights)

    def plots(self, *names: str) -> list[Plot]:
        """Those of the overview with these names, in this order, as far as there are any."""
        by_name = {plot.name: plot for plot in (*self.overview, *self.aircraft)}
        return [by_name[name] for name in names if name in by_name]


def layout(content: Content) -> rrb.Blueprint:
    """The tabs, with the cursor at the start and the panels of the viewer collapsed."""
    tabs = [
        _overview(content),
        *([_circle(content)] if content.charts else []),
        _around_the_cursor(content),
        *([_stack_of(content.differences, content, "Differences")] if content.differences else []),
        _aircraft(content),
        _target(content),
        _notes(content),
    ]
    play: PlayState = "following" if content.growing else "paused"
    return rrb.Blueprint(
        rrb.Tabs(*tabs, active_tab=0),
        rrb.TimePanel(state="collapsed", timeline=Recorder.TIMELINE, playback_speed=10.0, play_state=play),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
    )


def word_length(content: Content, word: str) -> float:
    """The time that a lane of the overview must show a state for to have room for its word, s."""
    width = _LANE_OF_MANY - 2.0 * _LABEL if content.crowd else _RIGHT * (1.0 - _gutter(content.overview, _RIGHT))
    return (_BESIDE_WORD + _LANE_LETTER * len(word)) * content.until / width


def _overview(content: Content) -> Tab:
    """Scene, metrics and events on the left; on the right the whole flight, or a cell for each of many flights."""
    flights = content.flights
    right = "; to the right |error| in powers of ten of 1 m, and heading rate [deg/s]" if content.crowd else ""
    metrics = rrb.TextDocumentView(origin="/notes/metrics", name=f"Metrics{right}")
    rows = len(flights) + 1 if content.crowd else 11
    metrics_height = _METRICS + _METRIC * rows
    if content.crowd:
        by_kind = {kind: [lane for lane in content.lanes if lane.startswith(f"/{kind}/")] for kind in LANES_OF_SEVERAL}
        below: Tab = rrb.Horizontal(*(_lanes(entities, content, kind) for kind, entities in by_kind.items()))
        height = _LANES + _LANE * len(flights)
    else:
        below, height = _event_view(), _EVENTS
    scene_height = max(250.0, _HEIGHT - metrics_height - height)
    aspect = (_WIDTH - _RIGHT) / (scene_height - 30.0)
    left = rrb.Vertical(scene_view(flights, aspect), metrics, below, row_shares=(scene_height, metrics_height, height))
    plots = _cells(content) if content.crowd else _whole(content)
    return rrb.Horizontal(left, plots, column_shares=(_WIDTH - _RIGHT, _RIGHT), name="Overview")


def _whole(content: Content) -> Tab:
    """The plots of one flight, or of two over each other, above their lanes, with one time axis."""
    flights = content.flights
    few = len(content.lanes) <= _MOST_LANES_WITH_SIDESLIP
    plots = content.plots("range_error", DECADES, "heading_rate", "bank", *(["sideslip"] if few else []))
    if len(flights) > 1:
        first = f"{plots[0].title}; wide and pale: {flights[0].name}, the reference"
        plots[0] = plots[0]._replace(title=first)
    legends = [plot for plot in plots if len(flights) == 1 or plot.name in ("range_error", DECADES)]
    gutter = _gutter(legends, _RIGHT)
    lanes_height = _LANES + _LANE * len(content.lanes)
    needed = [_AROUND_LEGEND + _ENTRY * _entries(plot) if plot in legends else 0.0 for plot in plots]
    needed = [_DECADES if plot.name == DECADES else height for plot, height in zip(plots, needed, strict=True)]
    heights = _heights(needed, _HEIGHT - lanes_height)
    sizes = [Size(_RIGHT, height) for height in heights]
    widest = max(map(value_axis.width, plots, sizes), default=0.0)
    views = [
        _strip(plot, content, gutter, size, widest, legend=plot in legends)
        for plot, size in zip(plots, sizes, strict=True)
    ]
    lanes = _lanes(content.lanes, content, "modes", gutter, _RIGHT, widest)
    return rrb.Vertical(*views, lanes, row_shares=[*heights, lanes_height])


def _cells(content: Content) -> Tab:
    """A cell for each flight: its error in front of the others', in grey, and its heading rate alone."""
    columns = 2 if len(content.flights) <= 4 else 3
    width, height = _RIGHT / columns, _HEIGHT / math.ceil(len(content.flights) / columns)
    error, rate = content.plots(DECADES)[0], content.plots("heading_rate")[0]
    tall, low = Size(width, 0.6 * height), Size(width, 0.4 * height)
    widest = max(value_axis.width(error, tall), value_axis.width(rate, low))
    cells = []
    for flight in content.flights:
        views = [
            _strip(error, content, 0.0, tall, widest, legend=False, front=flight, title=flight.name),
            _strip(rate, content, 0.0, low, widest, legend=False, alone=flight, title="its heading rate [deg/s]"),
        ]
        cells.append(rrb.Vertical(*views, row_shares=(3.0, 2.0)))
    return rrb.Grid(*cells, grid_columns=columns)


def _circle(content: Content) -> Tab:
    first, *others = map(chart_view, content.charts)
    return rrb.Horizontal(first, rrb.Vertical(*others), name="Circle")


def _around_the_cursor(content: Content) -> Tab:
    flights = content.flights
    left = rrb.Vertical(chase_view(flights[-1], flights), scene_view(flights, 1.8), row_shares=(3.0, 2.0))
    if content.crowd:
        plots = content.plots("heading_rate") * len(flights)
    else:
        plots = [plot for plot in content.overview if plot.name != DECADES]
    size = Size(0.6 * _WIDTH, _HEIGHT / max(1, len(plots)))
    besides = [
        value_axis.settled_width(plot, size) if plot.name in _NEAR else value_axis.width(plot, size) for plot in plots
    ]
    widest = max(besides, default=0.0)
    right = []
    of_flight = flights if content.crowd else [None] * len(plots)
    for plot, beside, flight in zip(plots, besides, of_flight, strict=True):
        title = f"{flight.name}: heading rate [deg/s]" if flight else _coloured(plot, flights)
        axis = _around(widest - beside, size.width - widest)
        right.append(_view(plot, size, axis, title=title, legend=False, near=plot.name in _NEAR, alone=flight))
    return rrb.Horizontal(left, rrb.Vertical(*right), column_shares=(2.0, 3.0), name="Around the cursor, ±30 s")


def _aircraft(content: Content) -> Tab:
    """Two columns of plots with one time axis; of many flights a row for each, with what is alike beside each other."""
    if not content.crowd:
        return _stack_of(content.aircraft, content, "Aircraft")
    plots = content.plots("bank", "sideslip", "airspeed", "altitude")
    size = Size(_WIDTH / len(plots), _HEIGHT / len(content.flights))
    views = [
        _strip(plot, content, 0.0, size, legend=False, alone=flight, title=f"{flight.name}: {_of(plot, flight)}")
        for flight in content.flights
        for plot in plots
    ]
    return rrb.Grid(*views, grid_columns=len(plots), name="Aircraft")


def _target(content: Content) -> Tab:
    seen, *plots = sorted(content.target, key=lambda plot: plot.name != "range_error_seen")
    if seen.name != "range_error_seen":
        left: Tab = scene_view(content.flights, 0.6, "Target and circle")
        plots = [seen, *plots]
    else:
        below = _strip(seen, content, _gutter([seen], 530.0), Size(530.0, _HEIGHT / 3.0))
        left = rrb.Vertical(scene_view(content.flights, 0.95, "Target and circle"), below, row_shares=(2.0, 1.0))
    right = _grid(plots, content, 2, 1060.0)
    return rrb.Horizontal(left, right, column_shares=(1.0, 2.0), name="Target")


def _notes(content: Content) -> Tab:
    result = rrb.TextDocumentView(origin="/notes/result", name="Result")
    settings: Tab = rrb.TextDocumentView(origin="/notes/settings", name="Settings, provenance")
    if content.crowd:  # whose overview has no room for events
        settings = rrb.Vertical(settings, _event_view())
    return rrb.Horizontal(result, settings, column_shares=(6.0, 5.0) if content.crowd else (3.0, 2.0), name="Notes")


def _event_view() -> rrb.View:
    columns = rrb.TextLogColumns(timeline_columns=[Recorder.TIMELINE], text_log_columns=["Body"])
    return rrb.TextLogView(origin="/events", name="Events", columns=columns)


def _lanes(
    entities: Sequence[str],
    content: Content,
    name: str,
    gutter: float = 0.0,
    width: float = _LANE_OF_MANY,
    widest: float = 0.0,
) -> rrb.View:
    return rrb.StateTimelineView(
        origin="/",
        contents=list(entities),
        name=name.capitalize(),
        time_view=_whole_flight(content, gutter, width, 0.0, widest),
    )


def _stack_of(plots: Sequence[Plot], content: Content, name: str) -> Tab:
    """All plots over the whole flight, in two columns, each with one time axis."""
    legend = len(content.flights) == 1
    return _grid(plots, content, 2, _WIDTH, name, legend=legend)


def _grid(
    plots: Sequence[Plot], content: Content, columns: int, width: float, name: str | None = None, *, legend: bool = True
) -> rrb.Container:
    """A grid of plots whose time axes line up, with legends unless these only repeat colours."""
    gutter = _gutter(plots, width / columns) if legend else 0.0
    size = Size(width / columns, _HEIGHT / max(1, math.ceil(len(plots) / columns)))
    widest = max((value_axis.width(plot, size) for plot in plots), default=0.0)
    views = [_strip(plot, content, gutter, size, widest, legend=legend) for plot in plots]
    return rrb.Grid(*views, grid_columns=columns, name=name)


def _strip(
    plot: Plot,
    content: Content,
    gutter: float,
    size: Size,
    widest: float = 0.0,
    *,
    legend: bool = True,
    title: str = "",
    alone: StyledFlight | None = None,
    front: StyledFlight | None = None,
) -> rrb.View:
    """A plot over the whole flight; see `_view`. `widest` are the numbers beside the plots above and below."""
    near = content.growing and plot.name != "heading_rate"  # its range is known: the limit
    beside = widest if near else value_axis.width(plot, size)
    axis = _whole_flight(content, gutter, size.width, beside, max(widest, beside))
    return _view(plot, size, axis, legend=legend, title=title or plot.title, near=near, alone=alone, front=front)


def _view(
    plot: Plot,
    size: Size,
    axis: rrb.TimeAxis,
    *,
    title: str,
    legend: bool = True,
    near: bool = False,
    alone: StyledFlight | None = None,
    front: StyledFlight | None = None,
) -> rrb.View:
    """One plot. With `near`, its axis follows the values at the times in view.

    Of the flights, `alone` leaves out the others, and `front` shows them in grey.
    """
    entities = {plot.entity(i): series for i, series in enumerate(plot.series)}
    contents = [e for e, series in entities.items() if alone is None or series.flight in ("", alone.name)]
    grey: Mapping[Any, rr.SeriesLines] = {
        entity: rr.SeriesLines.from_fields(colors=[_IN_FRONT_OF] * len(series.names), widths=[1.0] * len(series.names))
        for entity, series in entities.items()
        if front is not None and series.flight not in ("", front.name)
    }
    low, high = value_axis.scale(plot, size)
    if not near and contents and len(value_axis.numbers(low, high, size)) < value_axis.ENOUGH:
        decimals = max(0, -math.floor(math.log10(0.2 * (high - low))))
        title = f"{title}, {low:.{decimals}f} to {high:.{decimals}f}"
    return rrb.TimeSeriesView(
        origin="/",
        contents=contents,
        overrides=grey,
        name=title,
        axis_x=axis,
        axis_y=None if near else rrb.ScalarAxis(range=(low, high)),
        plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop, visible=legend),
    )


def _whole_flight(content: Content, gutter: float, width: float, beside: float, widest: float) -> rrb.TimeAxis:
    """The time axis of the whole flight; a share `gutter` of the width is left for the legend.

    `beside` is the width of the numbers beside this plot, `widest` that of the plots it is in line with, points: it
    begins so much earlier as its curves begin further to the left. It ends just before a label, which would be cut.
    """
    needed = content.until / (1.0 - max(gutter, _LABEL / (width - widest)))
    step = max((step for step in _STEPS if 5.0 * step <= needed), default=_STEPS[0])
    last = step * (math.ceil(needed / step + 0.02) - 0.02)
    begin = (beside - widest) / (width - widest) * last
    both_ends = (rrb.TimeRangeBoundary.absolute(seconds=s) for s in (begin, last))
    return rrb.TimeAxis(link="Independent", view_range=rrb.TimeRange(*both_ends))


def _around(missing: float, width: float) -> rrb.TimeAxis:
    """The time axis around the cursor: it begins so much earlier as numbers beside the plot are `missing`, points.

    It ends with room for half of the last label.
    """
    point = 2.0 * _CURSOR / (width - _LABEL)
    both_ends = (-_CURSOR - point * missing, _CURSOR + point * _LABEL)
    ends = (rrb.TimeRangeBoundary.cursor_relative(seconds=s) for s in both_ends)
    return rrb.TimeAxis(link="Independent", view_range=rrb.TimeRange(*ends))


def _of(plot: Plot, flight: StyledFlight) -> str:
    """The title of the plot of one flight, which may have no such value."""
    return plot.title if any(series.flight == flight.name for series in plot.series) else f"no {plot.name}"


def _heights(needed: Sequence[float], room: float) -> list[float]:
    """Heights of the rows: a row whose legend needs more than an equal share gets it, the others share the rest."""
    tall = [height if height > room / len(needed) else 0.0 for height in needed]
    even = (room - sum(tall)) / max(1, tall.count(0.0))
    return [height or even for height in tall]


def _entries(plot: Plot) -> int:
    """The number of lines in the legend; equal names share a line."""
    return len({name for series in plot.series for name in series.names})


def _gutter(plots: Sequence[Plot], width: float) -> float:
    longest = max((len(name) for plot in plots for series in plot.series for name in series.names), default=0)
    return min(0.5, (_BESIDE_LETTERS + _LETTER * longest) / (width - _AXIS))


def _coloured(plot: Plot, flights: Sequence[StyledFlight]) -> str:
    """The title with the colours in words, for plots whose curves leave no room for a legend."""
    if len(flights) == 1:
        shades = ("dim", "pale", WORDS[flights[0].colour])
        names = plot.series[-1].names
        words = [f"{name} {shade}" for name, shade in zip(names, shades[-len(names) :], strict=True)]
    else:
        words = [f"{flight.name} {WORDS[flight.colour]}" for flight in flights]
    return f"{plot.title}: {', '.join(words)}"
