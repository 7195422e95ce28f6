"""Charts whose horizontal axis is not time: the map, error against azimuth, the command's spectrum.

Rerun plots over time only, so these are drawn in two dimensions, axes included: 160 x 100 units, y downwards.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from harness.chatter import spectrum
from harness.log.signals import Signals
from harness.review.recorder import Recorder
from harness.review.styled import GREY, TARGET, WIND, Colour, StyledFlight, is_crowd, mixed

Array = NDArray[np.float64]

FOLDER = "charts"
_WIDTH, _HEIGHT = 160.0, 100.0
_FRAME: Colour = (75, 75, 75)
_BLACK: Colour = (0, 0, 0)
_SLICES = 72  # of the circle: of many flights only the mean of each is drawn
_LEAST_AMPLITUDE = 1e-3  # deg/s
_LABEL = 0.3  # powers of ten: height of a label in the spectrum
_MOVES = 0.1  # s between two places on the map
_MOST_TICKS = 7
_STEPS = (1.0, 2.0, 5.0)


class ChartLine(NamedTuple):
    """Strips of one colour, each of shape (points, 2), in the units of the chart."""

    strips: Sequence[Array]
    colour: Colour
    width: float  # points on the screen


class ChartAxis(NamedTuple):
    """An axis from `low` to `high`, with labelled ticks; `scale` is the number of picture units per unit."""

    low: float
    high: float
    ticks: Sequence[tuple[float, str]]
    scale: float


class Chart(NamedTuple):
    """A chart."""

    name: str
    title: str
    x: ChartAxis
    y: ChartAxis
    lines: Sequence[ChartLine]
    labels: Sequence[tuple[float, float, str, Colour]] = ()
    moving: Sequence[StyledFlight] = ()  # flights whose place is shown at each time

    def placed(self, x: Array, y: Array) -> Array:
        """Where these values are in the picture."""
        return np.column_stack([self.x.scale * (x - self.x.low), self.y.scale * (self.y.high - y)])


def charts(flights: Sequence[StyledFlight]) -> list[Chart]:
    """The charts of these flights, in the order of the tab."""
    flown = [flight for flight in flights if len(flight.log)]
    return [_map(flown), _around(flown), _spectrum(flown)] if flown else []


def log_chart(to: Recorder, chart: Chart) -> None:
    """Logs the frame with its ticks, the lines and the labels, and the places of the flights over time."""
    entity = f"/{FOLDER}/{chart.name}"
    right, top = chart.x.scale * (chart.x.high - chart.x.low), chart.y.scale * (chart.y.high - chart.y.low)
    frame = [np.array([(0.0, 0.0), (right, 0.0), (right, top), (0.0, top), (0.0, 0.0)])]
    across = [chart.x.scale * (value - chart.x.low) for value, _ in chart.x.ticks]
    down = [chart.y.scale * (chart.y.high - value) for value, _ in chart.y.ticks]
    frame += [np.array([(x, 0.0), (x, top)]) for x in across] + [np.array([(0.0, y), (right, y)]) for y in down]
    to.once(f"{entity}/frame", rr.LineStrips2D(frame, colors=mixed(_FRAME, _BLACK, 0.4), radii=-0.4, draw_order=-1.0))
    points = [(x, top + 1.0) for x in across] + [(-11.0, y - 3.5) for y in down]
    texts = [text for _, text in (*chart.x.ticks, *chart.y.ticks)]
    points += [tuple(chart.placed(np.array([x]), np.array([y]))[0]) for x, y, *_ in chart.labels]
    texts += [text for _, _, text, _ in chart.labels]
    colours = [*[GREY] * (len(across) + len(down)), *(colour for *_, colour in chart.labels)]
    to.once(f"{entity}/labels", rr.Points2D(points, labels=texts, colors=colours, radii=-0.1, show_labels=True))
    for i, line in enumerate(chart.lines):
        strips = [chart.placed(*strip.T) for strip in line.strips]
        to.once(f"{entity}/lines/{i:02}", _strips(strips, line, i))
    for i, flight in enumerate(chart.moving):
        log = flight.log
        rows = np.arange(0, len(log), max(1, round(_MOVES / log.flight.guidance_period)))
        places = chart.placed(log["east"][rows], log["north"][rows])
        to.once(f"{entity}/moving/{i:02}", rr.Points2D.from_fields(colors=flight.colour, radii=-5.0))
        to.columns(f"{entity}/moving/{i:02}", log["time"][rows], rr.Points2D.columns(positions=places))


def _strips(strips: Sequence[Array], line: ChartLine, order: int) -> rr.LineStrips2D:
    return rr.LineStrips2D(strips, colors=line.colour, radii=-0.5 * line.width, draw_order=float(order))


def chart_view(chart: Chart) -> rrb.Spatial2DView:
    """The view of a chart, with room for its labels."""
    right, top = chart.x.scale * (chart.x.high - chart.x.low), chart.y.scale * (chart.y.high - chart.y.low)
    return rrb.Spatial2DView(
        origin=f"/{FOLDER}/{chart.name}",
        name=chart.title,
        visual_bounds=rrb.VisualBounds2D(x_range=(-20.0, right + 10.0), y_range=(-4.0, top + 10.0)),
    )


def _map(flights: Sequence[StyledFlight]) -> Chart:
    """The view from above, with equal scales: tracks, target, circle and wind."""
    lines, labels = [], []
    longest = max(flights, key=lambda flight: len(flight.log)).log
    east, north, standoff = longest["target_east"], longest["target_north"], longest.flight.law.standoff
    around = np.linspace(0.0, 2.0 * math.pi, 181)
    circle = np.column_stack([east[-1] + standoff * np.sin(around), north[-1] + standoff * np.cos(around)])
    lines.append(ChartLine([circle, np.column_stack([east, north])[::20]], TARGET, 1.0))
    labels.append((float(east[-1]), float(north[-1]), "target", TARGET))
    tracks = [np.column_stack([flight.log["east"], flight.log["north"]]) for flight in flights]
    lines += [ChartLine([track], flight.colour, flight.width) for track, flight in zip(tracks, flights, strict=True)]
    everything = np.vstack([strip for line in lines for strip in line.strips])
    centre = 0.5 * (everything.min(axis=0) + everything.max(axis=0))
    half = 0.54 * float(np.ptp(everything, axis=0).max())
    x, y = (axis(float(c - half), float(c + half), _HEIGHT, "m") for c in centre)
    for i, flight in enumerate(flights, 2):
        labels.append((float(east[-1]), float(north[-1]) - 0.1 * half * i, flight.name, flight.colour))
    wind = longest.flight.wind.steady
    if speed := math.hypot(*wind):
        corner, along = np.array((x.low + 0.12 * half, y.high - 0.25 * half)), np.array((wind[1], wind[0])) / speed
        tip, side = corner + 0.12 * half * along, 0.04 * half * np.array((-along[1], along[0]))
        back = tip - 0.08 * half * along
        lines.append(ChartLine([np.array((corner, tip)), np.array((back + side, tip, back - side))], WIND, 1.5))
        labels.append((float(corner[0]) + 0.2 * half, y.high - 0.02 * half, f"wind {speed:.2g} m/s", WIND))
    return Chart("map", "From above, north up", x, y, lines, labels, flights)


def _around(flights: Sequence[StyledFlight]) -> Chart:
    """The range error against the direction from the target to the aircraft, while circling is judged."""
    lines = []
    for flight in flights:
        signals = Signals(flight.log)
        azimuth = np.degrees(signals.around[signals.window.first :]) % 360.0
        error = signals.circling("range_error")
        lines.append(ChartLine(_by_azimuth(azimuth, error, mean=is_crowd(flights)), flight.colour, flight.width))
    values = np.concatenate([strip[:, 1] for line in lines for strip in line.strips] or [np.zeros(1)])
    reach = max(float(np.abs(values).max()), 1e-6) * 1.1
    compass = [(90.0 * i, name) for i, name in enumerate(("N", "E", "S", "W", "N"))]
    y = axis(-reach, reach, _HEIGHT, "m")
    zero = ChartLine([np.array(((0.0, 0.0), (360.0, 0.0)))], GREY, 1.0)
    of = ", mean of all laps" if is_crowd(flights) else ""
    return Chart(
        "azimuth",
        f"Range error round the circle while circling is judged{of} [m]",
        ChartAxis(0.0, 360.0, compass, _WIDTH / 360.0),
        y,
        [zero, *lines],
    )


def _by_azimuth(azimuth: Array, error: Array, *, mean: bool) -> list[Array]:
    """The strips of a flight, broken where it passes north; or the mean of each slice of the circle flown."""
    if mean:
        slices = np.floor(azimuth / 360.0 * _SLICES).astype(int)
        counts = np.bincount(slices, minlength=_SLICES)
        known = np.flatnonzero(counts)
        means = np.bincount(slices, error, minlength=_SLICES)[known] / counts[known]
        points, breaks = np.column_stack([(known + 0.5) * 360.0 / _SLICES, means]), np.diff(known) > 1
    else:
        points, breaks = np.column_stack([azimuth, error]), np.abs(np.diff(azimuth)) > 180.0
    return [strip for strip in np.split(points, np.flatnonzero(breaks) + 1) if len(strip) > 1]


def _spectrum(flights: Sequence[StyledFlight]) -> Chart:
    """The amplitude of the law's command at each frequency, both in powers of ten, while circling is judged."""
    lines: list[ChartLine] = []
    labels: list[tuple[float, float, str, Colour]] = []
    for flight in flights:
        signals = Signals(flight.log)
        frequency, amplitude = spectrum(signals.circling("heading_rate_command"), signals.period)
        if not len(frequency):
            continue
        points = np.log10(np.column_stack([frequency, np.maximum(np.degrees(amplitude), _LEAST_AMPLITUDE)]))
        lines.append(ChartLine([points], flight.colour, flight.width))
        if cycle := signals.limit_cycle:
            at = points[max(0, int(np.searchsorted(frequency, cycle.frequency, side="right")) - 1)]
            above = float(at[1]) + 0.5 + _LABEL * len(labels)
            labels.append((float(at[0]), above, f"limit cycle, {cycle.frequency:.2g} Hz", flight.colour))
    points = np.vstack([strip for line in lines for strip in line.strips] or [np.zeros((1, 2))])
    low, high = points[:, 0].min(), max(points[:, 0].max(), points[:, 0].min() + 1.0)
    top = max(float(np.ceil(max([points[:, 1].max() + 0.2, *(y for _, y, *_ in labels)]))), 0.0)
    x, y = (
        ChartAxis(lowest, highest, _decade_ticks(lowest, highest, unit), length / (highest - lowest))
        for lowest, highest, unit, length in (
            (float(low), float(high), "Hz", _WIDTH),
            (math.log10(_LEAST_AMPLITUDE), top, "°/s", _HEIGHT),
        )
    )
    return Chart("spectrum", "Spectrum of the law's command while circling is judged [deg/s]", x, y, lines, labels)


def axis(low: float, high: float, length: float, unit: str) -> ChartAxis:
    """An axis with round ticks."""
    least = (high - low) / _MOST_TICKS
    decade = 10.0 ** math.floor(math.log10(least))
    step = next(decade * s for s in (*_STEPS, 10.0) if decade * s >= least)
    values = np.arange(math.ceil(low / step), math.floor(high / step) + 1) * step
    return ChartAxis(low, high, [(float(value), f"{value:.4g} {unit}") for value in values], length / (high - low))


def _decade_ticks(low: float, high: float, unit: str) -> list[tuple[float, str]]:
    return [(float(n), f"{10.0**n:g} {unit}") for n in range(math.ceil(low), math.floor(high) + 1)]
