"""Flights as a Rerun recording: what a reader looks at, and what a program reads back."""

import math
import os
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray
from rerun.chunk import RrdReader
from scipy.spatial.transform import Rotation

from harness.flight import Flight
from harness.flight_log import COLUMNS, FlightLog
from harness.plant import Outcome

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
Colour = tuple[int, int, int]
Logs = Mapping[str, FlightLog]

_TIMELINE = "sim_time"
_COLOURS = ((125, 165, 215), (255, 150, 40), (100, 215, 110), (230, 110, 230), (240, 220, 80), (90, 225, 235))
_TARGET_COLOUR = (235, 75, 85)
_WIND_COLOUR = (220, 220, 220)
_GREY = (125, 125, 125)
_MOST_WITH_COMMANDS = 2  # flights; of more, the commands would hide what was flown
_MOST_WITH_LEGENDS = 3  # flights; of more, one legend for all plots: a flight has one colour everywhere
_ELEVATION = math.radians(55.0)  # of the eye above the scene
_HALF_VIEW = math.tan(math.radians(25.0))  # Rerun's eye opens 55 deg from top to bottom
_DEG = 180.0 / math.pi


class _Plot(NamedTuple):
    """A strip of curves over time: columns of the log in `unit`, one SI unit being `scale` of it."""

    title: str
    unit: str
    scale: float
    flown: str
    command: str | None = None
    bound: str = ""  # what +-`bound_of` a flight is called
    bound_of: Callable[[Flight], float] | None = None


class _Curve(NamedTuple):
    """A line in a plot."""

    legend: str
    colour: Colour
    width: float
    time: Array
    values: Array


_PLOTS = (
    _Plot("Range error", "m", 1.0, "range_error", None, "tolerance", lambda flight: flight.metrics.tolerance),
    _Plot(
        *("Heading rate", "deg/s", _DEG, "heading_rate", "heading_rate_command"),
        *("limit", lambda flight: flight.law.max_heading_rate),
    ),
    _Plot("Bank", "deg", _DEG, "bank", "bank_command"),
    _Plot("Sideslip", "deg", _DEG, "sideslip"),
    _Plot("Sliding variable", "rad", 1.0, "sliding_variable"),
)


def write_recording(path: Path, logs: Logs, title: str, notes: str = "") -> None:
    """Writes flights by name into one .rrd with its own layout; `notes` is Markdown. OSError when it cannot be written.

    The first flight is the reference, drawn wide and pale under the others; target, circle and wind are its own.
    """
    plots = {plot: curves for plot in _PLOTS if (curves := _curves(plot, logs))}
    recording = rr.RecordingStream("standoff-harness", send_properties=False)  # the hour of writing says nothing
    memory = recording.memory_recording()  # Rerun's own file sink waits for ever when the disk is full
    recording.set_log_time_enabled(False)
    recording.send_blueprint(_layout(logs, plots))
    recording.send_recording_name(title)
    _log(recording, "/notes", rr.TextDocument(f"## {title}\n\n{notes}", media_type=rr.MediaType.MARKDOWN))
    _log_surroundings(recording, next(iter(logs.values())))
    for i, (name, log) in enumerate(logs.items()):
        _log_flight(recording, name, log, *_style(i, len(logs)))
    for plot, curves in plots.items():
        for i, curve in enumerate(curves):  # Rerun draws in the order of the entities' names
            _log_curve(recording, f"/plots/{plot.flown}/{i:02}", curve)
    content = memory.drain_as_bytes()
    partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        partial.write_bytes(content)
        os.replace(partial, path)
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
        raise ValueError(f"{path} is no recording, or not a whole one: {error}") from error
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
    if flight is None and len(columns) != 1:
        raise ValueError(f"{path}: which flight? It holds {held}")
    name = flight if flight is not None else held
    if name not in columns:
        raise ValueError(f"{path}: no flight {name!r}, it holds {held}")
    table = np.concatenate([*rows.get(name, []), np.empty(0)]).reshape(-1, len(columns[name]))
    return pd.DataFrame(table, columns=columns[name])


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
    _log(recording, f"{entity}/track", rr.LineStrips3D([track], colors=colour, radii=_points(0.5 * width)))
    _log(recording, f"{entity}/aircraft", _airframe(log.flight.law.standoff / 4.0, colour))
    pose = rr.Transform3D.columns(translation=track, quaternion=_attitude(log))
    _send(recording, f"{entity}/aircraft", time, pose)
    if log.outcome is not Outcome.COMPLETED:
        mark = rr.Points3D(track[-1:], colors=colour, radii=_points(5.0), labels=[log.outcome.value])
        _log(recording, f"{entity}/end", mark)
        event = rr.TextLog.columns(text=[f"{name}: {log.outcome}, {log.reason}"], level=["WARN"])
        _send(recording, f"{entity}/end", np.append(0.0, time)[-1:], event)


def _log_curve(recording: rr.RecordingStream, entity: str, curve: _Curve) -> None:
    style = rr.SeriesLines(
        names=curve.legend,
        colors=curve.colour,
        widths=curve.width,
        aggregation_policy=rr.components.AggregationPolicy.MinMax,  # the default halves the peaks
    )
    _log(recording, entity, style)
    _send(recording, entity, curve.time, rr.Scalars.columns(scalars=curve.values))


def _log_surroundings(recording: rr.RecordingStream, log: FlightLog) -> None:
    """The target on the ground, and above it the circle and the wind's way in 20 s, at the flight's height."""
    _log(recording, "/", rr.ViewCoordinates.FRD)
    ground, centre = _ground(log), (0.0, 0.0, -log.flight.start.altitude)
    _log(recording, "/target/track", rr.LineStrips3D([ground], colors=_TARGET_COLOUR, radii=_points(1.0)))
    _send(recording, "/target/position", log["time"], rr.Transform3D.columns(translation=ground))
    point = rr.Points3D([(0.0, 0.0, 0.0)], colors=_TARGET_COLOUR, radii=_points(5.0), labels=["target"])
    _log(recording, "/target/position/point", point)
    lines = [_circle(log, 121) + centre, ((0.0, 0.0, 0.0), centre)]
    _log(recording, "/target/position/circle", rr.LineStrips3D(lines, colors=_TARGET_COLOUR, radii=_points(0.7)))
    if any(log.flight.wind.steady):
        wind = np.array((*log.flight.wind.steady, 0.0))
        arrow = rr.Arrows3D(vectors=[20.0 * wind], origins=[centre], colors=_WIND_COLOUR, radii=_points(2.5))
        _log(recording, "/target/position/wind", arrow)
        label = rr.Points3D([26.0 * wind + centre], colors=_WIND_COLOUR, radii=0.0, labels=[f"wind {np.hypot(*wind[:2]):.2g} m/s"])
        _log(recording, "/target/position/wind/label", label)


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


def _points(radius: float) -> float:
    return float(rr.Radius.ui_points(radius))


def _style(i: int, flights: int) -> tuple[Colour, float]:
    """Colour and line width of the i-th flight; alone, the reference need not be wide."""
    return _COLOURS[i % len(_COLOURS)], 3.5 if i == 0 and flights > 1 else 1.5


def _curves(plot: _Plot, logs: Logs) -> list[_Curve]:
    """What there is to draw, in the order of drawing. A column of NaN is what the plant has not."""
    curves = []
    for i, (name, log) in enumerate(logs.items()):
        colour, width = _style(i, len(logs))
        drab = (colour[0] + 2 * _GREY[0]) // 3, (colour[1] + 2 * _GREY[1]) // 3, (colour[2] + 2 * _GREY[2]) // 3
        if plot.command and len(logs) <= _MOST_WITH_COMMANDS:
            curves.append(_Curve(f"{name} command [{plot.unit}]", drab, 1.0, log["time"], plot.scale * log[plot.command]))
        curves.append(_Curve(f"{name} [{plot.unit}]", colour, width, log["time"], plot.scale * log[plot.flown]))
    curves = [curve for curve in curves if np.isfinite(curve.values).any()]
    if curves and plot.bound_of:
        time = np.array([0.0, _end(logs)])
        bounds = sorted({sign * plot.scale * plot.bound_of(log.flight) for log in logs.values() for sign in (-1.0, 1.0)})
        curves[:0] = [_Curve(f"{plot.bound} [{plot.unit}]", _GREY, 1.0, time, np.full(2, bound)) for bound in bounds]
    return curves


def _end(logs: Logs) -> float:
    return float(np.concatenate([log["time"] for log in logs.values()]).max(initial=1.0))


def _layout(logs: Logs, plots: Mapping[_Plot, list[_Curve]]) -> rrb.Blueprint:
    """Left the scene over the notes, right the plots over the whole flight, with room for the legends beside the curves."""
    legends = [len({c.legend for c in curves}) for curves in plots.values()]
    longest = max(len(curve.legend) for curves in plots.values() for curve in curves)
    share = min(0.5, (40.0 + 6.1 * longest) / 830.0)
    begin, end = rrb.TimeRangeBoundary.absolute(seconds=0.0), rrb.TimeRangeBoundary.absolute(seconds=_end(logs)/(1-share))
    axis = rrb.TimeAxis(link="Independent", view_range=rrb.TimeRange(begin, end))
    few = len(logs) <= _MOST_WITH_LEGENDS
    strips = [rrb.TimeSeriesView(origin=f"/plots/{plot.flown}", name=f"{plot.title} [{plot.unit}]", axis_x=axis, axis_y=_axis(plot, curves, logs), plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop, visible=few or i == 0)) for i, (plot, curves) in enumerate(plots.items())]
    left = [_scene(logs), rrb.TextDocumentView(origin="/notes", name="Notes")]
    if any(log.outcome is not Outcome.COMPLETED for log in logs.values()):
        left.append(rrb.TextLogView(origin="/runs", name="Events"))
    return rrb.Blueprint(
        rrb.Horizontal(rrb.Vertical(*left, row_shares=[6.0, 3.0, 1.5][:len(left)]), rrb.Vertical(*strips, row_shares=[max(4, n) if few or not i else 4 for i, n in enumerate(legends)]), column_shares=[2,3]),
        rrb.TimePanel(state="collapsed", timeline=_TIMELINE, playback_speed=10.0, play_state="paused"),
        rrb.BlueprintPanel(state="collapsed"), rrb.SelectionPanel(state="collapsed"), auto_views=False, auto_layout=False)


def _axis(plot, curves, logs) -> rrb.ScalarAxis | None:
    if plot.flown == "heading_rate":
        limit = 1.3 * max(curve.values.max() for curve in curves if curve.legend.startswith(plot.bound))
        return rrb.ScalarAxis(range=(-limit, limit))
    if plot.flown == "range_error":
        near = 0.5 * max(log.flight.law.standoff for log in logs.values())
        r = np.concatenate([np.r_[np.clip(log["range_error"], -near, near), log["range_error"][len(log)//2:]] for log in logs.values()])
        lo, hi = r.min(initial=-.1*near), r.max(initial=.1*near)
        return rrb.ScalarAxis(range=(lo-.08*(hi-lo), hi+.08*(hi-lo)))
    return None


def _scene(logs: Logs) -> rrb.Spatial3DView:
    """Seen from the south, from above the ground, just far enough to see everything."""
    reference = next(iter(logs.values()))
    up = (0.0, 0.0, -reference.flight.start.altitude)
    ground = np.vstack([(*reference.flight.target.position, 0.0), _ground(reference)[::20]])
    rim = (ground[:, np.newaxis] + _circle(reference, 25) + up).reshape(-1, 3)
    points = np.vstack([ground, rim, *(_track(log) for log in logs.values())])
    c, s = math.cos(_ELEVATION), math.sin(_ELEVATION)
    axes = np.array([(0.0, 1.0, 0.0), (s, 0.0, -c), (-c, 0.0, -s)])  # of the picture: right, up, towards the eye
    x, y, z = axes @ points.T
    # The eye at (X, Y, Z) sees a point where |x - X| and |y - Y| are at most (Z - z) HALF_VIEW
    right, left, top, bottom = (float((side + _HALF_VIEW * z).max()) for side in (x, -x, y, -y))
    eye = np.array([0.5*(right - left), 0.5*(top - bottom), 0.5*max(right+left, top+bottom)/_HALF_VIEW])
    look = eye * (1, 1, 0) + (0,0,z.mean())
    controls = rrb.EyeControls3D(position=eye @ axes, look_target=look @ axes, eye_up=(0.0, 0.0, -1.0))
    return rrb.Spatial3DView(contents=["/target/**", *(f"{rr.new_entity_path(['runs', n])}/{x}" for n in logs for x in ("track", "aircraft", "end"))], name="Scene", eye_controls=controls, line_grid=rrb.LineGrid3D(spacing=100.0))
