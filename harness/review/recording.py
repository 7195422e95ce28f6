"""Flights as a Rerun recording: what a reader looks at, and what a program reads back."""

import math
import os
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
import rerun_bindings
from numpy.typing import NDArray
from rerun.chunk import RrdReader
from scipy.spatial.transform import Rotation

from harness.flight_log import COLUMNS, FlightLog
from harness.plant import Outcome

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
Colour = tuple[int, int, int]
Logs = Mapping[str, FlightLog]

_APPLICATION = "standoff-harness"
_TIMELINE = "sim_time"
_COLOURS = ((125, 165, 215), (255, 150, 40), (100, 215, 110), (230, 110, 230), (240, 220, 80), (90, 225, 235))
_TARGET_COLOUR = (235, 75, 85)
_WIND_COLOUR = (220, 220, 220)
_GREY = (125, 125, 125)
_WIDE, _THIN = 3.5, 1.5  # lines, in points on the screen
_MOST_WITH_COMMANDS = 2  # flights; of more, the commands would hide what was flown
_MOST_WITH_LEGENDS = 3  # flights; of more, one legend for all plots: a flight has one colour everywhere
_ELEVATION = math.radians(55.0)  # of the eye above the scene
_HALF_VIEW = (0.49, 0.46)  # width, height per distance: inside what Rerun's eye sees, tan(55 deg / 2) up and down
_DEG = 180.0 / math.pi


class _Plot(NamedTuple):
    """What is flown over time, and what is commanded, in `unit`; one SI unit is `scale` of it."""

    flown: str
    unit: str
    scale: float
    command: str = ""


_RANGE_ERROR = _Plot("range_error", "m", 1.0)
_HEADING_RATE = _Plot("heading_rate", "deg/s", _DEG, "heading_rate_command")
_PLOTS = (
    _RANGE_ERROR,
    _HEADING_RATE,
    _Plot("bank", "deg", _DEG, "bank_command"),
    _Plot("sideslip", "deg", _DEG),
    _Plot("sliding_variable", "rad", 1.0),
)


class _Curve(NamedTuple):
    """A line in a plot, in the plot's unit."""

    legend: str
    colour: Colour
    width: float
    time: Array
    values: Array


def write_recording(path: Path, logs: Logs, title: str, notes: str = "") -> None:
    """Writes flights by name into one .rrd with its own layout; `notes` is Markdown. OSError when it cannot be written.

    The first flight is the reference, drawn wide and pale under the others; target, circle and wind are its own.
    """
    try:
        content = _encode(logs, title, notes)
    finally:
        rerun_bindings.flush_and_cleanup_orphaned_recordings()  # or the threads of every recording stay
    partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        partial.write_bytes(content)
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def read_recording(path: Path, flight: str | None = None) -> "pd.DataFrame":
    """The log of a recorded flight, bit for bit: SI, rad, NED. `flight` names it where the file holds several.

    OSError when the file cannot be read, ValueError when there is no such flight in it.
    """
    import pandas as pd

    path.open("rb").close()  # for the OSError: Rerun raises RuntimeError for all that is wrong with a file
    try:
        chunks = RrdReader(path).stream().filter(content="/runs/**").to_chunks()
    except RuntimeError as error:
        raise ValueError(f"{path} is no whole recording: {error}") from error
    columns: dict[str, list[str]] = {}
    rows: dict[str, list[Array]] = {}
    for chunk in chunks:
        if found := re.fullmatch(r"/runs/(.+)/log", chunk.entity_path):
            name, batch = re.sub(r"\\(.)", r"\1", found[1]), chunk.to_record_batch()
            if chunk.is_static:
                columns[name] = batch.column("SeriesLines:names").flatten().to_pylist()
            else:
                rows.setdefault(name, []).append(batch.column("Scalars:scalars").flatten().to_numpy())
    held = ", ".join(sorted(columns)) or "none"
    name = flight or held
    if name not in columns:
        raise ValueError(f"{path}: {f'no flight {flight!r}' if flight else 'which flight?'} It holds {held}")
    table = np.concatenate([np.empty(0), *rows.get(name, [])]).reshape(-1, len(columns[name]))
    return pd.DataFrame(table, columns=columns[name])


def _encode(logs: Logs, title: str, notes: str) -> bytes:
    """The file's content. Made in memory: Rerun's own file sink waits for ever when the disk is full."""
    plots = {plot: curves for plot in _PLOTS if (curves := _curves(plot, logs))}
    recording = rr.RecordingStream(_APPLICATION, send_properties=False)  # the hour of writing says nothing
    memory = recording.memory_recording()
    recording.set_log_time_enabled(False)
    _send_layout(recording, _layout(logs, plots))
    recording.send_recording_name(title)
    _log(recording, "/notes", rr.TextDocument(f"### {title}\n\n{notes}", media_type=rr.MediaType.MARKDOWN))
    _log_surroundings(recording, next(iter(logs.values())))
    for i, (name, log) in enumerate(logs.items()):
        _log_flight(recording, name, log, *_style(i, logs))
    for plot, curves in plots.items():
        for i, curve in enumerate(curves):  # Rerun draws in the order of the entities' names
            _log_curve(recording, f"/plots/{plot.flown}/{i:02}", curve)
    content = memory.drain_as_bytes()
    recording.disconnect()
    return content


def _send_layout(recording: rr.RecordingStream, layout: rrb.Blueprint) -> None:
    """`recording.send_blueprint(layout)`, which in Rerun 0.41 leaves two threads and 2 MB behind, done by hand."""
    stream = rr.RecordingStream._from_native(rerun_bindings.new_blueprint(_APPLICATION, False, False))
    stream.set_time("blueprint", sequence=0)
    layout._log_to_stream(stream)
    rerun_bindings.send_blueprint(stream.memory_recording().storage, True, True, recording=recording.to_native())
    stream.disconnect()


def _log(recording: rr.RecordingStream, entity: str, what: rr.AsComponents) -> None:
    """Once, for all times."""
    recording.log(entity, what, static=True, strict=True)


def _send(recording: rr.RecordingStream, entity: str, time: Array, columns: Iterable[rr.ComponentColumn]) -> None:
    """Whole columns. Time stamps are whole nanoseconds: Rerun truncates floats, and stamps would differ by one."""
    stamps = np.rint(time * 1e9).astype("timedelta64[ns]")
    recording.send_columns(entity, [rr.TimeColumn(_TIMELINE, duration=stamps)], columns, strict=True)


def _log_flight(recording: rr.RecordingStream, name: str, log: FlightLog, colour: Colour, width: float) -> None:
    """The log as it is, for `read_recording`, and the aircraft on its track."""
    entity, time, track = rr.new_entity_path(["runs", name]), log["time"], _track(log)
    _log(recording, f"{entity}/log", rr.SeriesLines(names=COLUMNS))
    rows = rr.Scalars.columns(scalars=log.table.ravel()).partition([len(COLUMNS)] * len(log))
    _send(recording, f"{entity}/log", time, rows)  # as vectors: a third of the room that an entity per column takes
    below = (0.0, 0.0, 0.5 * (width - _THIN))  # m: a thin track that lies on a wide one stays visible
    _log(recording, f"{entity}/track", _lines([track + below], colour, 0.5 * width))
    _log(recording, f"{entity}/aircraft", _airframe(log.flight.law.standoff / 4.0, colour))
    pose = rr.Transform3D.columns(translation=track, quaternion=_attitude(log))
    _send(recording, f"{entity}/aircraft", time, pose)
    if log.outcome is not Outcome.COMPLETED:
        _log(recording, f"{entity}/end", _label(track[-1:], colour, 5.0, log.outcome.value))
        event = rr.TextLog.columns(text=[f"{name}: {log.outcome}, {log.reason}"], level=["WARN"])
        _send(recording, f"{entity}/end", np.append(0.0, time)[-1:], event)


def _log_curve(recording: rr.RecordingStream, entity: str, curve: _Curve) -> None:
    both_peaks = rr.components.AggregationPolicy.MinMax  # zoomed out, the default halves them
    style = rr.SeriesLines(names=curve.legend, colors=curve.colour, widths=curve.width, aggregation_policy=both_peaks)
    _log(recording, entity, style)
    _send(recording, entity, curve.time, rr.Scalars.columns(scalars=curve.values))


def _log_surroundings(recording: rr.RecordingStream, log: FlightLog) -> None:
    """The target on the ground; above it, at the flight's height, the circle and the wind's way in 20 s."""
    _log(recording, "/", rr.ViewCoordinates.FRD)
    ground, wind = _ground(log), np.array((*log.flight.wind.steady, 0.0))
    foot, centre = np.zeros(3), np.array((0.0, 0.0, -log.flight.start.altitude))
    _log(recording, "/target/track", _lines([ground], _TARGET_COLOUR, 1.0))
    _send(recording, "/target/position", log["time"], rr.Transform3D.columns(translation=ground))
    _log(recording, "/target/position/point", _label([foot], _TARGET_COLOUR, 5.0, "target"))
    circle = _circle(log, 121) + centre + (0.0, 0.0, 2.0)  # m, below the tracks: one that lies on it stays visible
    _log(recording, "/target/position/circle", _lines([circle, np.array((foot, centre))], _TARGET_COLOUR, 0.7))
    if wind.any():
        arrow = rr.Arrows3D(vectors=[20.0 * wind], origins=[centre], colors=_WIND_COLOUR, radii=-2.5)
        _log(recording, "/target/position/wind", arrow)
        below = centre + max(0.0, 30.0 * np.sign(-wind[0])) * wind  # a label hangs under its point: off the arrow
        text = f"wind {np.hypot(*wind[:2]):.2g} m/s"
        _log(recording, "/target/position/wind/label", _label([below], _WIND_COLOUR, 0.1, text))


def _lines(strips: list[Array], colour: Colour, points: float) -> rr.LineStrips3D:
    return rr.LineStrips3D(strips, colors=colour, radii=-points)  # below zero: points on the screen, not metres


def _label(position: Array | list[Array], colour: Colour, points: float, text: str) -> rr.Points3D:
    return rr.Points3D(position, colors=colour, radii=-points, labels=[text], show_labels=True)


def _airframe(span: float, colour: Colour) -> rr.Mesh3D:
    """Four flat triangles: fuselage, wing, tailplane, fin. Body axes, m."""
    fuselage = ((0.5, 0.0, 0.0), (-0.5, 0.06, 0.0), (-0.5, -0.06, 0.0))
    wing = ((0.2, 0.0, 0.0), (-0.1, 0.5, 0.0), (-0.1, -0.5, 0.0))
    tailplane = ((-0.3, 0.0, 0.0), (-0.5, 0.2, 0.0), (-0.5, -0.2, 0.0))
    fin = ((-0.25, 0.0, 0.0), (-0.5, 0.0, 0.0), (-0.5, 0.0, -0.2))
    corners = span * np.array([*fuselage, *wing, *tailplane, *fin])
    return rr.Mesh3D(vertex_positions=corners, triangle_indices=np.arange(12).reshape(4, 3), albedo_factor=colour)


def _attitude(log: FlightLog) -> Array:
    """Body (FRD) to world as quaternions x, y, z, w. What a plant has not is level, and its nose along its heading."""
    yaw = np.where(np.isnan(log["yaw"]), log["heading"], log["yaw"])
    angles = np.column_stack([yaw, np.nan_to_num(log["pitch"]), np.nan_to_num(log["bank"])])
    return Rotation.from_euler("ZYX", angles).as_quat()


def _track(log: FlightLog) -> Array:
    return np.column_stack([log["north"], log["east"], -log["altitude"]])


def _ground(log: FlightLog) -> Array:
    return np.column_stack([log["target_north"], log["target_east"], np.zeros(len(log))])


def _circle(log: FlightLog, corners: int) -> Array:
    angle = np.linspace(0.0, 2.0 * math.pi, corners)
    return log.flight.law.standoff * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(corners)])


def _style(i: int, logs: Logs) -> tuple[Colour, float]:
    """Colour and line width of the i-th flight; alone, the reference need not be wide."""
    return _COLOURS[i % len(_COLOURS)], _WIDE if i == 0 and len(logs) > 1 else _THIN


def _curves(plot: _Plot, logs: Logs) -> list[_Curve]:
    """What there is to draw, from below to above. A column of NaN is what a plant has not."""
    curves = []
    for i, (name, log) in enumerate(logs.items()):
        colour, width = _style(i, logs)
        if plot.command and len(logs) <= _MOST_WITH_COMMANDS:
            r, g, b = ((part + 2 * grey) // 3 for part, grey in zip(colour, _GREY, strict=True))
            command = plot.scale * log[plot.command]
            curves.append(_Curve(f"{name} command [{plot.unit}]", (r, g, b), 1.0, log["time"], command))
        curves.append(_Curve(f"{name} [{plot.unit}]", colour, width, log["time"], plot.scale * log[plot.flown]))
    curves = [curve for curve in curves if np.isfinite(curve.values).any()]
    return [*_bounds(plot, logs), *curves] if curves else []


def _bounds(plot: _Plot, logs: Logs) -> list[_Curve]:
    if plot is _RANGE_ERROR:
        name, bounds = "tolerance", {log.flight.metrics.tolerance for log in logs.values()}
    elif plot is _HEADING_RATE:
        name, bounds = "limit", {_DEG * log.flight.law.max_heading_rate for log in logs.values()}
    else:
        return []
    ends = np.array((0.0, _end(logs)))
    both = [sign * bound for bound in sorted(bounds) for sign in (-1.0, 1.0)]
    return [_Curve(f"{name} ±{abs(b):.3g} [{plot.unit}]", _GREY, 1.0, ends, np.full(2, b)) for b in both]


def _end(logs: Logs) -> float:
    return float(np.concatenate([log["time"] for log in logs.values()]).max(initial=1.0))


def _layout(logs: Logs, plots: Mapping[_Plot, list[_Curve]]) -> rrb.Blueprint:
    """Left the scene over the notes, right the plots of the whole flight with room for legends beside the curves."""
    left: list[rrb.View] = [_scene(logs), rrb.TextDocumentView(origin="/notes", name="Notes")]
    if any(log.outcome is not Outcome.COMPLETED for log in logs.values()):
        left.append(rrb.TextLogView(name="Events"))
    longest = max((len(curve.legend) for curves in plots.values() for curve in curves), default=0)
    gutter = min(0.5, (40.0 + 6.1 * longest) / 790.0)  # as measured, in a window 1500 wide
    begin, end = (rrb.TimeRangeBoundary.absolute(seconds=s) for s in (0.0, _end(logs) / (1.0 - gutter)))
    time = rrb.TimeAxis(link="Independent", view_range=rrb.TimeRange(begin, end))
    strips: list[rrb.View] = []
    heights: list[float] = []
    for plot, curves in plots.items():
        visible = not strips or len(logs) <= _MOST_WITH_LEGENDS
        heights.append(max(4, len({curve.legend for curve in curves})) if visible else 4)
        strips.append(
            rrb.TimeSeriesView(
                origin=f"/plots/{plot.flown}",
                name=f"{plot.flown.replace('_', ' ').capitalize()} [{plot.unit}]",
                axis_x=time,
                axis_y=_axis(plot, curves, logs),
                plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop, visible=visible),
            )
        )
    scene_and_notes = rrb.Vertical(*left, row_shares=(6.0, 3.0, 1.5)[: len(left)])
    return rrb.Blueprint(
        rrb.Horizontal(scene_and_notes, rrb.Vertical(*strips, row_shares=heights), column_shares=(2.0, 3.0)),
        rrb.TimePanel(state="collapsed", timeline=_TIMELINE, playback_speed=10.0, play_state="paused"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
    )


def _axis(plot: _Plot, curves: list[_Curve], logs: Logs) -> rrb.ScalarAxis:
    """Room for the limit; all of a curve, but of the range error before half-time what is near."""
    if plot is _HEADING_RATE:
        high = 1.3 * _DEG * max(log.flight.law.max_heading_rate for log in logs.values())
        return rrb.ScalarAxis(range=(-high, high))
    seen = [curve.values for curve in curves]
    if plot is _RANGE_ERROR:
        near = max(0.5 * log.flight.law.standoff for log in logs.values())
        seen = [np.append(values.clip(-near, near), values[len(values) // 2 :]) for values in seen]
    everything = np.concatenate([(-0.1, 0.1), *seen])
    low, high = np.nanmin(everything), np.nanmax(everything)
    step = 10.0 ** math.floor(math.log10(max(-low, high)))
    if high - low > 7.0 * step:  # too many for Rerun to label each: the next power of ten gets a label
        low, high = (low, max(high, 10.0 * step)) if high > -low else (min(low, -10.0 * step), high)
    margin = 0.08 * (high - low)
    return rrb.ScalarAxis(range=(low - margin, high + margin))


def _scene(logs: Logs) -> rrb.Spatial3DView:
    """Seen from the south and from above, just far enough to see everything."""
    reference = next(iter(logs.values()))
    ground = _ground(reference)[::-20] if len(reference) else np.zeros((1, 3))
    centres = ground - (0.0, 0.0, reference.flight.start.altitude)
    rims = (centres[:, np.newaxis] + _circle(reference, 25)).reshape(-1, 3)
    c, s = math.cos(_ELEVATION), math.sin(_ELEVATION)
    axes = np.array(((0.0, 1.0, 0.0), (s, 0.0, -c), (-c, 0.0, -s)))  # of the picture: right, up, towards the eye
    x, y, z = axes @ np.vstack([ground, rims, *map(_track, logs.values())]).T
    # From (X, Y, Z) a point is seen where |x - X| <= w (Z - z) and |y - Y| <= h (Z - z): each side asks for X +- w Z
    w, h = _HALF_VIEW
    right, left, top, bottom = (x + w * z).max(), (w * z - x).max(), (y + h * z).max(), (h * z - y).max()
    eye = 0.5 * np.array((right - left, top - bottom, max((right + left) / w, (top + bottom) / h)))
    look = np.array((eye[0], eye[1], z.mean()))
    return rrb.Spatial3DView(
        name="Scene: north up, grid 100 m",
        eye_controls=rrb.EyeControls3D(position=eye @ axes, look_target=look @ axes, eye_up=(0.0, 0.0, -1.0)),
        line_grid=rrb.LineGrid3D(spacing=100.0),
    )
