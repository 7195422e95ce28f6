"""Flights as a Rerun recording: what a reader looks at, and what a program reads back."""

import math
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
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

_TIMELINE = "sim_time"
_COLOURS = ((125, 165, 215), (255, 150, 40), (100, 215, 110), (230, 110, 230), (240, 220, 80), (90, 225, 235))
_TARGET_COLOUR = (235, 75, 85)
_GREY = (125, 125, 125)
_MOST_WITH_COMMANDS = 3  # flights; of more, the commands would hide what was flown
_ELEVATION = math.radians(55.0)  # of the eye above the scene
_HALF_VIEW = math.tan(math.radians(24.0))  # Rerun's eye opens 55 deg; a margin, and a pane narrower than high


class _Plot(NamedTuple):
    """A strip of curves over time: the column flown, the one commanded if any, and one SI unit in `unit`."""

    name: str
    unit: str
    scale: float
    flown: str
    command: str | None = None


_DEG = 180.0 / math.pi
_RANGE_ERROR = _Plot("Range error", "m", 1.0, "range_error")
_HEADING_RATE = _Plot("Heading rate", "deg/s", _DEG, "heading_rate", "heading_rate_command")
_PLOTS = (
    _RANGE_ERROR,
    _HEADING_RATE,
    _Plot("Bank", "deg", _DEG, "bank", "bank_command"),
    _Plot("Sideslip", "deg", _DEG, "sideslip"),
    _Plot("Sliding variable", "rad", 1.0, "sliding_variable"),
)


def write_recording(path: Path, logs: Logs, title: str, notes: str = "") -> None:
    """Writes flights by name into one .rrd with its own layout; `notes` is Markdown. OSError when it cannot be written.

    The first flight is the reference, drawn wide and pale under the others; target, circle and wind are its own.
    """
    recording = rr.RecordingStream("standoff-harness", send_properties=False)  # the hour of writing says nothing
    memory = recording.memory_recording()  # Rerun's own file sink waits for ever when the disk is full
    recording.set_log_time_enabled(False)
    recording.send_blueprint(_layout(logs))
    recording.send_recording_name(title)
    _log(recording, "/notes", rr.TextDocument(f"## {title}\n\n{notes}", media_type=rr.MediaType.MARKDOWN))
    _log_surroundings(recording, next(iter(logs.values())))
    _log_bounds(recording, logs)
    for i, (name, log) in enumerate(logs.items()):
        _log_flight(recording, name, log, _COLOURS[i % len(_COLOURS)], i == 0, len(logs) <= _MOST_WITH_COMMANDS)
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

    path.open("rb").close()  # for the OSError: Rerun has one message for all that is wrong with a file
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
    names = sorted(columns)
    if flight is None and len(names) == 1:
        flight = names[0]
    if flight not in columns:
        raise ValueError(f"{path} holds {f'no flight {flight!r}' if flight else 'several flights'}: {', '.join(names)}")
    table = np.concatenate([*rows.get(flight, []), np.empty(0)]).reshape(-1, len(columns[flight]))
    return pd.DataFrame(table, columns=columns[flight])


def _log(recording: rr.RecordingStream, entity: str, what: rr.AsComponents) -> None:
    """Once, for all times."""
    recording.log(entity, what, static=True, strict=True)


def _send(recording: rr.RecordingStream, entity: str, time: Array, columns: Iterable[rr.ComponentColumn]) -> None:
    """Whole columns. Time stamps are whole nanoseconds: Rerun truncates floats, and stamps would differ by one."""
    stamps = np.rint(time * 1e9).astype("timedelta64[ns]")
    recording.send_columns(entity, [rr.TimeColumn(_TIMELINE, duration=stamps)], columns, strict=True)


def _send_rows(recording: rr.RecordingStream, entity: str, time: Array, rows: Array) -> None:
    """Many columns as one: a vector per time stamp takes a third of the room that a column each would."""
    _send(recording, entity, time, rr.Scalars.columns(scalars=rows.ravel()).partition([rows.shape[1]] * len(rows)))


def _entity(flight: str, *parts: str) -> str:
    return rr.new_entity_path(["runs", flight, *parts])


def _log_flight(
    recording: rr.RecordingStream, name: str, log: FlightLog, colour: Colour, reference: bool, commands: bool
) -> None:
    _log(recording, _entity(name, "log"), rr.SeriesLines(names=COLUMNS))
    _send_rows(recording, _entity(name, "log"), log["time"], log.table)
    for plot in _drawn([log]):
        flown, drab = f"{name} [{plot.unit}]", tuple((part + 2 * grey) // 3 for part, grey in zip(colour, _GREY, strict=True))
        width = 4.0 if reference else 1.5
        if plot.command and commands:
            rows = np.column_stack([log[plot.command], log[plot.flown]])
            style = rr.SeriesLines(names=[f"{name} command [{plot.unit}]", flown], colors=[drab, colour], widths=[1.0, width], aggregation_policy=[rr.components.AggregationPolicy.MinMax]*2)
        else:
            rows = log[plot.flown][:, np.newaxis]
            style = rr.SeriesLines(names=flown, colors=colour, widths=width, aggregation_policy=rr.components.AggregationPolicy.MinMax)
        _log(recording, _entity(name, plot.flown), style)
        _send_rows(recording, _entity(name, plot.flown), log["time"], rows * plot.scale)
    track = _track(log)
    _log(recording, _entity(name, "track"), rr.LineStrips3D([track], colors=colour, radii=rr.Radius.ui_points(2.2 if reference else 0.9)))
    _log(recording, _entity(name, "aircraft"), _airframe(log.flight.law.standoff / 4.0, colour))
    _send(recording, _entity(name, "aircraft"), log["time"], rr.Transform3D.columns(translation=track, quaternion=_attitude(log)))
    if log.outcome is not Outcome.COMPLETED:
        text = f"{name}: {log.outcome}, {log.reason}"
        _log(recording, _entity(name, "end"), rr.Points3D(track[-1:], colors=colour, radii=rr.Radius.ui_points(6), labels=[text], show_labels=True))
        _send(recording, _entity(name, "end"), log["time"][-1:], rr.TextLog.columns(text=[text], level=["WARN"]))


def _track(log: FlightLog) -> Array:
    return np.column_stack([log["north"], log["east"], -log["altitude"]])


def _attitude(log: FlightLog) -> Array:
    """Body (FRD) to world as quaternions x, y, z, w. Where a plant has a heading only, its aircraft flies level along it."""
    yaw = np.where(np.isnan(log["yaw"]), log["heading"], log["yaw"])
    angles = np.column_stack([yaw, np.nan_to_num(log["pitch"]), np.nan_to_num(log["bank"])])
    return Rotation.from_euler("ZYX", angles).as_quat()


def _drawn(logs: Iterable[FlightLog]) -> list[_Plot]:
    """The plots that have something to show: NaN is what a plant has not."""
    return [plot for plot in _PLOTS if any(np.isfinite(log[plot.flown]).any() for log in logs)]


def _airframe(span: float, colour: Colour) -> rr.Mesh3D:
    """Fuselage, wing and tails as flat triangles: forward, right, down."""
    v = span*np.array([[.5,0,0],[-.5,.06,0],[-.5,-.06,0], [.2,0,0],[-.1,.5,0],[-.1,-.5,0],[-.3,0,0],[-.5,.2,0],[-.5,-.2,0],[-.25,0,0],[-.5,0,0],[-.5,0,-.2]])
    t=[[0,1,2],[3,4,5],[6,7,8],[9,10,11]]
    return rr.Mesh3D(vertex_positions=v,triangle_indices=t,albedo_factor=colour)


def _log_bounds(recording, logs) -> None:
    end = _end(logs)
    limit = max(log.flight.law.max_heading_rate for log in logs.values())
    tol = max(log.flight.metrics.tolerance for log in logs.values())
    for plot, name, value in ((_RANGE_ERROR, "tolerance", tol), (_HEADING_RATE, "limit", limit)):
        e = f"/bounds/{plot.flown}"
        _log(recording, e, rr.SeriesLines(names=[f"{name} [{plot.unit}]"]*2, colors=[_GREY]*2, widths=[1.0]*2, aggregation_policy=[rr.components.AggregationPolicy.MinMax]*2))
        _send_rows(recording, e, np.array([0.0, end]), np.array([[value,-value]]*2)*plot.scale)


def _end(logs): return max(float(log["time"][-1]) for log in logs.values())


def _log_surroundings(recording, log) -> None:
    _log(recording, "/", rr.ViewCoordinates.FRD)
    R, height = log.flight.law.standoff, log.flight.start.altitude
    ground = np.column_stack([log["target_north"], log["target_east"], np.zeros(len(log))])
    angle = np.linspace(0, 2*np.pi, 181)
    circle = np.column_stack([R*np.cos(angle), R*np.sin(angle), np.full(181,-height)])
    _log(recording, "/target/track", rr.LineStrips3D([ground], colors=_TARGET_COLOUR, radii=rr.Radius.ui_points(1.0)))
    _send(recording, "/target/position", log["time"], rr.Transform3D.columns(translation=ground))
    _log(recording, "/target/position/point", rr.Points3D([[0,0,0]], colors=_TARGET_COLOUR, radii=rr.Radius.ui_points(5.0),labels=["target"],show_labels=True))
    _log(recording, "/target/position/circle", rr.LineStrips3D([circle,[[0,0,0],[0,0,-height]]], colors=_TARGET_COLOUR, radii=rr.Radius.ui_points(.7)))
    W=np.hypot(*log.flight.wind.steady)
    if W:
        n,e=log.flight.wind.steady
        _log(recording, "/target/position/wind", rr.Arrows3D(vectors=[[20*n,20*e,0]],origins=[[0,0,-height]],labels=[f"wind {W:.3g} m/s"],colors=(200,200,200),radii=rr.Radius.ui_points(2.)))


def _layout(logs) -> rrb.Blueprint:
    end = _end(logs)
    first = next(iter(logs.values()))
    R = first.flight.law.standoff
    tgt = np.column_stack([first["target_north"], first["target_east"], np.zeros(len(first))])
    up=[0,0,first.flight.start.altitude]
    pts = np.vstack([_track(l) for l in logs.values()] + [tgt] + [tgt -up + [a,b,0] for a in (-R,R) for b in (-R,R)])
    c = (pts.min(0)+pts.max(0))/2
    el=_ELEVATION; f=_HALF_VIEW
    d=pts-c
    toward=-d[:,0]*math.cos(el)-d[:,2]*math.sin(el)
    upw=d[:,0]*math.sin(el)-d[:,2]*math.cos(el)
    dist=(toward+np.maximum(abs(d[:,1]),abs(upw))/f).max()
    eye=c+dist*np.array([-math.cos(el),0,-math.sin(el)])
    scene = rrb.Spatial3DView(origin="/", contents=["/target/**",*(f"{_entity(n)}/{x}" for n in logs for x in ("track","aircraft","end"))], name="Scene", eye_controls=rrb.EyeControls3D(position=eye, look_target=c, eye_up=(0,0,-1)), line_grid=rrb.LineGrid3D(spacing=100.0))
    chars=max(map(len,logs))+16
    g=min(.5,(40+6.1*chars)/830)
    x = rrb.TimeAxis(link="Independent", view_range=rrb.TimeRange(rrb.TimeRangeBoundary.absolute(seconds=0.0), rrb.TimeRangeBoundary.absolute(seconds=end/(1-g))))
    lim=max(log.flight.law.max_heading_rate for log in logs.values())*_DEG
    def rng(p):
        if p is _HEADING_RATE: return rrb.ScalarAxis(range=(-1.3*lim,1.3*lim))
        if p is _RANGE_ERROR: return rrb.ScalarAxis(range=(-.2*R,.5*R))
        return None
    plots=[rrb.TimeSeriesView(origin="/", contents=[f"/bounds/{p.flown}",*(_entity(n,p.flown) for n in logs)], name=f"{p.name} [{p.unit}]", axis_x=x, axis_y=rng(p), plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop)) for p in _drawn(logs.values())]
    left=[scene, rrb.TextDocumentView(origin="/notes", name="Notes")]
    if any(l.outcome is not Outcome.COMPLETED for l in logs.values()):
        left.append(rrb.TextLogView(origin="/runs",name="Events"))
    return rrb.Blueprint(rrb.Horizontal(rrb.Vertical(*left, row_shares=[5,2,1][:len(left)]), rrb.Vertical(*plots), column_shares=[2,3]), rrb.TimePanel(state="collapsed", timeline=_TIMELINE, playback_speed=10.0, play_state="paused"), rrb.BlueprintPanel(state="collapsed"), rrb.SelectionPanel(state="collapsed"), auto_views=False, auto_layout=False)
