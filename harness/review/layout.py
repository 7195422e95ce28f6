"""The layout of a recording: its tabs and views, with room for a legend beside the curves of each plot."""

from collections.abc import Sequence
from typing import Literal, NamedTuple

import rerun.blueprint as rrb

from harness.review.plots import Plot
from harness.review.recorder import Recorder
from harness.review.scene import chase_view, scene_view
from harness.review.styled import WORDS, StyledFlight

_RIGHT = 950.0  # points: width of the column of plots in a window 1600 wide
_HEIGHT = 870.0  # points: height of all tabs in a window 1000 high
_LANE, _LANES = 38.0, 52.0  # points: height of a lane, and of the frame around all lanes
_EVENTS = 190.0  # points: height of the events
_LETTER, _BESIDE_LETTERS = 6.1, 55.0  # points: width of a letter in a legend, and of the rest of it
_ENTRY, _AROUND_LEGEND = 23.5, 70.0  # points: height of a line of a legend, and of the rest of its row
_AXIS = 35.0  # points: width of the numbers beside a plot
_MOST_WITH_CHASE = 3  # flights
PlayState = Literal["following", "paused"]
Tab = rrb.Container | rrb.View


class Content(NamedTuple):
    """Everything that is laid out."""

    flights: Sequence[StyledFlight]
    overview: Sequence[Plot]
    differences: Sequence[Plot]
    aircraft: Sequence[Plot]
    target: Sequence[Plot]
    lanes: int
    until: float  # s: the end of the time axis of plots over a whole flight
    growing: bool = False  # a flight is shown while it is flown: the range of its values is not known yet


def layout(content: Content) -> rrb.Blueprint:
    """Five tabs, with the cursor at the start and the panels of the viewer collapsed."""
    tabs = [
        _overview(content),
        _around_the_cursor(content),
        _grid(content.aircraft, content, 2 if len(content.flights) == 1 else 3, 1540.0, "Aircraft"),
        _target(content),
        rrb.Horizontal(
            rrb.TextDocumentView(origin="/notes/result", name="Result"),
            rrb.TextDocumentView(origin="/notes/settings", name="Settings, provenance"),
            column_shares=(3.0, 2.0),
            name="Notes",
        ),
    ]
    play: PlayState = "following" if content.growing else "paused"
    return rrb.Blueprint(
        rrb.Tabs(*tabs, active_tab=0),
        rrb.TimePanel(state="collapsed", timeline=Recorder.TIMELINE, playback_speed=10.0, play_state=play),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
    )


def _overview(content: Content) -> Tab:
    """Scene, chase view, events on the left, plots on the right; the lanes of many flights replace the chase view."""
    flights, plots = content.flights, {plot.name: plot for plot in content.overview}
    many = len(flights) > _MOST_WITH_CHASE
    legends = [plot for plot in content.overview if len(flights) == 1 or plot.name == "range_error"]
    gutter = _gutter(legends, _RIGHT)
    lanes = rrb.StateTimelineView(
        origin="/lanes", name="Modes", time_view=_whole_flight(content, 0.02 if many else gutter)
    )
    lanes_height = _LANES + _LANE * content.lanes

    rows: list[Tab] = [_strip(plot, content, gutter) for plot in legends]
    below: list[Tab] = []
    if len(flights) > 1:
        reference = f"; wide and pale: {flights[0].name}, the reference"
        rows = [_strip(plot._replace(title=plot.title + reference), content, gutter) for plot in legends]
        rows += [_strip(plots[name], content, gutter, legend=False) for name in ("heading_rate",) if name in plots]
        rows += _beside([plots[name] for name in ("bank", "sideslip") if name in plots], content)
        below = _beside(content.differences, content)
    room = _HEIGHT - (0.0 if many else lanes_height)
    shares = _heights([_AROUND_LEGEND + _ENTRY * _entries(plot) for plot in legends], len(rows) + len(below), room)
    if not many:
        shares.insert(len(rows), lanes_height)
        rows.append(lanes)
    right = rrb.Vertical(*rows, *below, row_shares=shares)

    middle = lanes if many else chase_view(flights[-1], flights)
    middle_height = lanes_height if many else 250.0
    left_shares = (_HEIGHT - middle_height - _EVENTS, middle_height, _EVENTS)
    left = rrb.Vertical(scene_view(flights, 1.45), middle, _event_view(), row_shares=left_shares)
    return rrb.Horizontal(left, right, column_shares=(2.0, 3.0), name="Overview")


def _around_the_cursor(content: Content) -> Tab:
    flights = content.flights
    left = rrb.Vertical(chase_view(flights[-1], flights), scene_view(flights, 1.8), row_shares=(3.0, 2.0))
    axis = rrb.TimeAxis(link="LinkToGlobal")  # Rerun shows 30 s to either side, whatever range is set
    right = [
        _view(
            plot,
            axis,
            title=_coloured(plot, flights),
            legend=False,
            near=plot.name in ("range_error", "sliding_variable"),
        )
        for plot in content.overview
    ]
    return rrb.Horizontal(left, rrb.Vertical(*right), column_shares=(2.0, 3.0), name="Around the cursor, ±30 s")


def _event_view() -> rrb.View:
    columns = rrb.TextLogColumns(timeline_columns=[Recorder.TIMELINE], text_log_columns=["Body"])
    return rrb.TextLogView(origin="/events", name="Events", columns=columns)


def _target(content: Content) -> Tab:
    seen, *plots = sorted(content.target, key=lambda plot: plot.name != "range_error_seen")
    if seen.name != "range_error_seen":
        left: Tab = scene_view(content.flights, 0.6, "Target and circle")
        plots = [seen, *plots]
    else:
        below = _strip(seen, content, _gutter([seen], 530.0))
        left = rrb.Vertical(scene_view(content.flights, 0.95, "Target and circle"), below, row_shares=(2.0, 1.0))
    right = _grid(plots, content, 2, 1060.0)
    return rrb.Horizontal(left, right, column_shares=(1.0, 2.0), name="Target")


def _grid(
    plots: Sequence[Plot], content: Content, columns: int, width: float, name: str | None = None
) -> rrb.Container:
    """A grid of plots with `columns` columns, with legends unless they would only repeat the colours of the flights."""
    legend = len(content.flights) == 1 or plots is not content.aircraft
    gutter = _gutter(plots, width / columns) if legend else 0.02
    views = [_strip(plot, content, gutter, legend=legend) for plot in plots]
    return rrb.Grid(*views, grid_columns=columns, name=name)


def _beside(plots: Sequence[Plot], content: Content) -> list[Tab]:
    views = [_strip(plot, content, 0.02, legend=False) for plot in plots]
    return [rrb.Horizontal(*views[i : i + 2]) for i in range(0, len(views), 2)]


def _strip(plot: Plot, content: Content, gutter: float, *, legend: bool = True) -> rrb.View:
    near = content.growing and plot.name != "heading_rate"  # its range is known: the limit
    return _view(plot, _whole_flight(content, gutter), legend=legend, title=plot.title, near=near)


def _view(plot: Plot, axis: rrb.TimeAxis, *, title: str, legend: bool = True, near: bool = False) -> rrb.View:
    """One plot. With `near`, its axis follows the values at the times in view."""
    return rrb.TimeSeriesView(
        origin=f"/plots/{plot.name}",
        name=title,
        axis_x=axis,
        axis_y=None if near else rrb.ScalarAxis(range=plot.span),
        plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop, visible=legend),
    )


def _whole_flight(content: Content, gutter: float) -> rrb.TimeAxis:
    """The time axis of the whole flight; a share `gutter` of the width is left for the legend."""
    begin, last = (rrb.TimeRangeBoundary.absolute(seconds=s) for s in (0.0, content.until / (1.0 - gutter)))
    return rrb.TimeAxis(link="Independent", view_range=rrb.TimeRange(begin, last))


def _heights(legends: Sequence[float], rows: int, room: float) -> list[float]:
    """Heights of the rows: a row whose legend needs more than an equal share gets it, the others share the rest."""
    tall = [height if height > room / rows else 0.0 for height in [*legends, *[0.0] * (rows - len(legends))]]
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
