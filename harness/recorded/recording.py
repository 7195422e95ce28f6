"""A Rerun recording of a recorded flight: the track, values over time, the turn relation, and what was said."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from harness.markup import markdown as as_markdown
from harness.recorded import panels as drawn
from harness.recorded.assessment import Assessment
from harness.recorded.part_finding import CANNOT
from harness.recorded.recorded_flight import Array, RecordedFlight
from harness.recorded.said import HEADINGS, row, wind_line
from harness.review.charts import Chart, ChartLine, axis
from harness.review.plain import Moving, write_plain
from harness.review.plots import Plot, Series, span
from harness.review.styled import GREY, LIGHT, Colour
from harness.tables import markdown

_BLUE: Colour = (125, 165, 215)
_ORANGE: Colour = (255, 150, 40)
_GREEN: Colour = (100, 215, 110)
_LOOKS = {drawn.COMMANDED: (_BLUE, 1.0), drawn.FLOWN: (LIGHT, 1.5), drawn.OTHER: (_ORANGE, 1.0)}
_SIZE = 100.0  # side of a chart, units
_CROSS = 0.012  # half the size of a mark, over the chart's width


def write_recording_of(path: Path, whole: RecordedFlight, found: Assessment, command: str) -> None:
    """Writes the recording, complete or not at all. Raises OSError."""
    plots = [_plot(i, panel) for i, panel in enumerate(drawn.panels(whole, found))]
    charts, moving = [], []
    if places := drawn.track(whole):
        chart = _map(places, found)
        charts.append(chart)
        moving.append(Moving(chart.name, places[0], np.column_stack([places[2], places[1]])))
    if shown := drawn.scatter(found):
        charts.append(_relation(shown))
    events = {event.time: event.text for event in whole.events}
    if whole.failure:
        events[whole.failure.time] = f"failure: {whole.failure.text}"
    write_plain(path, whole.name, plots, charts, moving, dict(sorted(events.items())), _notes(whole, found, command))


def _plot(i: int, panel: drawn.FlightPanel) -> Plot:
    series = []
    for line in panel.lines:
        colour, width = _LOOKS[line.kind]
        time, values = _stepped(line.time, line.values) if line.held else (line.time, line.values)
        series.append(Series((line.name,), (colour,), (width,), time, values[:, None]))
    title = f"{panel.title} [{panel.unit}]" if panel.unit else panel.title
    return Plot(f"{i:02}", title, series, span(series))


def _stepped(time: Array, values: Array) -> tuple[Array, Array]:
    """The samples with each value held until just before the next."""
    before = np.maximum(time[1:] - 1e-3, time[:-1])
    return np.append(np.column_stack([time[:-1], before]), time[-1]), np.append(
        np.column_stack([values[:-1], values[:-1]]), values[-1]
    )


def _map(places: tuple[Array, Array, Array], found: Assessment) -> Chart:
    time, north, east = places
    points = np.column_stack([east, north])
    centre, half = 0.5 * (points.min(axis=0) + points.max(axis=0)), 0.54 * max(float(np.ptp(points, axis=0).max()), 1.0)
    x, y = (axis(float(c - half), float(c + half), _SIZE, "m") for c in centre)
    begin, end = drawn.judged(found) or (np.inf, -np.inf)
    inside = (time >= begin) & (time <= end)
    lines = [ChartLine([points], GREY, 1.0)]
    if np.count_nonzero(inside) > 1:
        lines.append(ChartLine([points[inside]], LIGHT, 1.5))
    return Chart("map", "From above, north up; bright: judged", x, y, lines)


def _relation(shown: drawn.Scatter) -> Chart:
    reach = 1.15 * max(float(np.abs(shown.asked).max()), float(np.abs(shown.flown).max()))
    x, y = axis(-reach, reach, 1.6 * _SIZE, "°/s"), axis(-reach, reach, _SIZE, "°/s")
    lines = [
        *(ChartLine([_through(slope, reach)], _GREEN, 1.0) for slope in shown.allowed if np.isfinite(slope)),
        *(ChartLine([_through(slope, reach)], _BLUE, 1.0) for slope in (shown.low, shown.high)),
        ChartLine([_through(shown.slope, reach)], _BLUE, 2.5),
        ChartLine(list(_marks(shown, _CROSS * 2.0 * reach)), LIGHT, 1.5),
    ]
    title = f"Turn rate on g tan(bank)/V: {shown.slope:.3g}, {shown.word}; green: allowed; blue: 95 % interval"
    return Chart("relation", title, x, y, lines)


def _through(slope: float, reach: float) -> Array:
    """A line through the origin, within the frame."""
    x = reach / max(1.0, abs(slope))
    return np.array([(-x, -slope * x), (x, slope * x)])


def _marks(shown: drawn.Scatter, size: float) -> Iterator[Array]:
    for x, y in zip(shown.asked, shown.flown, strict=True):
        yield np.array([(x - size, y), (x + size, y)])
        yield np.array([(x, y - size), (x, y + size)])


def _notes(whole: RecordedFlight, found: Assessment, command: str) -> str:
    """The verdict and the refusals, in Markdown."""
    judged = [row(finding) for finding in found.findings if finding.word != CANNOT]
    refused = [finding for finding in found.findings if finding.word == CANNOT]
    span = drawn.judged(found)
    parts = [f"Judged from {span[0]:.1f} to {span[1]:.1f} s." if span else "Nothing of it is judged."]
    if judged:
        parts.append("\n".join(markdown(HEADINGS, ([as_markdown(cell) for cell in cells] for cells in judged))))
    parts += [as_markdown(line) for line in (*wind_line(found), *found.notes)]
    if refused:
        cells = ([finding.part.title, as_markdown(finding.reason)] for finding in refused)
        parts.append("\n".join(markdown([CANNOT, "because"], cells)))
    parts += [f"- {as_markdown(line)}" for line in (*whole.problems, *whole.refusals)]
    return "\n\n".join([*parts, f"Made by `{command}`"])
