"""The scene in three dimensions: aircraft on their tracks, target, circle, wind. NED from the flight's origin, m."""

import math
from collections.abc import Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from harness.flight import Flight
from harness.log import FlightLog
from harness.review.airframe import airframe, size
from harness.review.recorder import Recorder
from harness.review.styled import ESTIMATE, TARGET, WIND, Colour, StyledFlight, mixed

Array = NDArray[np.float64]

TRAIL = 60.0  # s
_STRIP = 1.0  # s, of one piece of the trail
_MOVES = 0.1  # s, between two poses
_CORNERS = 0.25  # s, between two corners of a whole track
_NEAR = 4.0  # how many times its size an aircraft has in the chase view
_ELEVATION = math.radians(55.0)  # of the eye above the scene
_HALF_VIEW = 0.46  # height per distance: inside what Rerun's eye sees, tan(55 deg / 2) up and down
_BLACK = (0, 0, 0)


def log_surroundings(to: Recorder, log: FlightLog) -> None:
    """The target on the ground; above it, at the flight's height, the circle and the wind's way in 20 s."""
    to.once("/", rr.ViewCoordinates.FRD)
    to.once("/ground", _ground_grid(log))
    flight = log.flight
    wind = np.array((*flight.wind.steady, 0.0))
    foot, centre = np.zeros(3), np.array((0.0, 0.0, -flight.start.altitude))
    to.once("/target/position/point", _label([foot], TARGET, 5.0, "target"))
    circle = _circle(flight, 121) + centre + (0.0, 0.0, 2.0)  # m, below the tracks: one that lies on it stays visible
    to.once("/target/position/circle", _lines([circle, np.array((foot, centre))], TARGET, 0.7))
    if wind.any():
        to.once("/target/position/wind", rr.Arrows3D(vectors=[20.0 * wind], origins=[centre], colors=WIND, radii=-2.5))
        below = centre + max(0.0, 30.0 * np.sign(-wind[0])) * wind  # a label hangs under its point: off the arrow
        to.once("/target/position/wind/label", _label([below], WIND, 0.1, f"wind {np.hypot(*wind[:2]):.2g} m/s"))


def log_target(to: Recorder, log: FlightLog) -> None:
    """Where the target is, and where the law takes it to be."""
    rows = _every(_MOVES, log)
    to.columns("/target/position", log["time"][rows], rr.Transform3D.columns(translation=_ground(log)[rows]))
    if log.flight.estimator.filters:
        seen = np.column_stack([log["target_north_seen"], log["target_east_seen"], np.zeros(len(log))])
        new = np.isfinite(log["innovation_range"])
        where = rr.Transform3D.columns(translation=seen[new])
        to.columns("/target/estimate", log["time"][new], where)


def log_tracks(to: Recorder, one: StyledFlight, whole: FlightLog) -> None:
    """What is known when the flight is over: the whole way of the aircraft and of the target, and how it ended."""
    entity = to.flight(one.name)
    faint = mixed(one.colour, _BLACK, 0.35)
    corners = _every(_CORNERS, whole)
    to.once(f"{entity}/track", _lines([_track(whole)[corners] + _below(one)], faint, 0.4 * one.width))
    to.once("/target/track", _lines([_ground(whole)[corners]], TARGET, 1.0))
    if whole.outcome.value != "completed" and len(whole):
        to.once(f"{entity}/end", _label(_track(whole)[-1:], one.colour, 5.0, whole.outcome.value))


def log_airframe(to: Recorder, one: StyledFlight, flights: Sequence[StyledFlight]) -> None:
    """The aircraft's shape from its span and chord: `far` enlarged for the scene, `near` for the chase view."""
    entity = to.flight(one.name)
    to.once(f"{entity}/vehicle/body/far", airframe(one.log.flight, enlargement(flights), one.colour))
    to.once(f"{entity}/vehicle/body/near", airframe(one.log.flight, _NEAR, one.colour))
    if one.log.flight.estimator.filters:
        to.once("/target/estimate/point", rr.Points3D([(0.0, 0.0, 0.0)], colors=ESTIMATE, radii=-4.0))
        beside = np.array((0.0, 0.7 * one.log.flight.law.standoff, 0.0))  # clear of the target's label
        to.once("/target/estimate/label", _label([beside], ESTIMATE, 0.1, "estimate"))


def log_motion(to: Recorder, one: StyledFlight, rows: FlightLog) -> None:
    """The aircraft's pose at each row: level on its track, and banked within that."""
    entity, some = to.flight(one.name), _every(_MOVES, rows)
    yaw = np.where(np.isnan(rows["yaw"]), rows["heading"], rows["yaw"])[some]  # without a nose, along its heading
    level = Rotation.from_euler("Z", yaw[:, np.newaxis]).as_quat()
    pose = rr.Transform3D.columns(translation=_track(rows)[some], quaternion=level)
    to.columns(f"{entity}/vehicle", rows["time"][some], pose)
    if not np.isnan(rows["bank"]).all():
        attitude = np.column_stack([np.nan_to_num(rows["pitch"]), np.nan_to_num(rows["bank"])])[some]
        banked = rr.Transform3D.columns(quaternion=Rotation.from_euler("YX", attitude).as_quat())
        to.columns(f"{entity}/vehicle/body", rows["time"][some], banked)


def log_trail(to: Recorder, one: StyledFlight, rows: FlightLog) -> int:
    """The way behind the aircraft in whole pieces of a second; gives the row that the last of them ends at."""
    piece = max(1, round(_STRIP / rows.flight.guidance_period))
    ends = np.arange(piece, len(rows), piece)
    if not len(ends):
        return 0
    entity, track = f"{to.flight(one.name)}/trail", _track(rows)
    strips = [track[end - piece : end + 1] + _below(one) for end in ends]
    to.once(entity, rr.LineStrips3D.from_fields(colors=one.colour, radii=-_trail_radius(one)))
    to.columns(entity, rows["time"][ends], rr.LineStrips3D.columns(strips=strips))
    return int(ends[-1])


def scene_view(flights: Sequence[StyledFlight], aspect: float, name: str = "Scene") -> rrb.Spatial3DView:
    """Seen from the south and from above, just far enough to see everything; `aspect` is width over height."""
    reference = flights[0].log
    ground = _ground(reference)[::-20] if len(reference) else np.array([(*reference.flight.target.position, 0.0)])
    centres = ground - (0.0, 0.0, reference.flight.start.altitude)
    rims = (centres[:, np.newaxis] + _circle(reference.flight, 25)).reshape(-1, 3)
    start = np.array([(*reference.flight.start.position, -reference.flight.start.altitude)])
    c, s = math.cos(_ELEVATION), math.sin(_ELEVATION)
    axes = np.array(((0.0, 1.0, 0.0), (s, 0.0, -c), (-c, 0.0, -s)))  # of the picture: right, up, towards the eye
    x, y, z = axes @ np.vstack([ground, rims, start, *(_track(one.log) for one in flights)]).T
    # From (X, Y, Z) a point is seen where |x - X| <= w (Z - z) and |y - Y| <= h (Z - z): each side asks for X +- w Z
    w, h = aspect * _HALF_VIEW, _HALF_VIEW
    wing = 0.5 * enlargement(flights) * size(reference.flight)[0]
    right, left = (x + w * z).max() + wing, (w * z - x).max() + wing
    top, bottom = (y + h * z).max() + 0.5 * wing, (h * z - y).max() + 0.5 * wing
    eye = 0.5 * np.array((right - left, top - bottom, max((right + left) / w, (top + bottom) / h)))
    look = np.array((eye[0], eye[1], z.mean()))
    grid = 10.0 ** round(math.log10(0.35 * eye[2] / 2.0))
    return rrb.Spatial3DView(
        name=f"{name}: north up, grid {grid:g} m, aircraft x{enlargement(flights):g}",
        contents=[
            "+ /**",
            "- /plots/**",
            "- /ground",
            *(f"- {Recorder.flight(one.name)}/vehicle/body/near" for one in flights),
        ],
        eye_controls=rrb.EyeControls3D(position=eye @ axes, look_target=look @ axes, eye_up=(0.0, 0.0, -1.0)),
        line_grid=rrb.LineGrid3D(spacing=grid),
        time_ranges=_last(TRAIL),
    )


def chase_view(one: StyledFlight, flights: Sequence[StyledFlight]) -> rrb.Spatial3DView:
    """Behind and above the aircraft, turning with it, its horizon level."""
    entity = Recorder.flight(one.name)
    span = _NEAR * size(one.log.flight)[0]
    return rrb.Spatial3DView(
        origin=f"{entity}/vehicle",
        name=f"Chase: {one.name}, level, aircraft x{_NEAR:g}",
        contents=[
            "+ /**",
            "- /plots/**",
            "- /target/position/wind/label",
            *(f"- {Recorder.flight(other.name)}/vehicle/body/far" for other in flights),
        ],
        eye_controls=rrb.EyeControls3D(
            position=(-2.0 * span, 0.0, -0.9 * span), look_target=(2.0 * span, 0.0, 0.3 * span), eye_up=(0.0, 0.0, -1.0)
        ),
        line_grid=rrb.LineGrid3D(visible=False),
        time_ranges=_last(TRAIL),
    )


def enlargement(flights: Sequence[StyledFlight]) -> float:
    """How many times its size an aircraft has in the scene: a third of the circle's radius wide, or so."""
    needed = 0.3 * flights[0].log.flight.law.standoff / size(flights[0].log.flight)[0]
    return float(
        min((1, 2, 3, 5, 7, 10, 15, 20, 30, 40, 60, 80, 100, 200, 500, 1000), key=lambda x: abs(math.log(x / needed)))
    )


def _every(seconds: float, rows: FlightLog) -> NDArray[np.int64]:
    """Rows that far apart, and the last."""
    step = max(1, round(seconds / rows.flight.guidance_period))
    return np.unique(np.append(np.arange(0, len(rows), step), np.arange(len(rows))[-1:])).astype(np.int64)


def _below(one: StyledFlight) -> Array:
    """How far below its place a line is drawn, m: a thin one that lies on a wide one stays visible."""
    return np.array((0.0, 0.0, 0.5 * (one.width - 1.5)))


def _trail_radius(one: StyledFlight) -> float:
    return 0.75 + 0.3 * one.width


def _last(seconds: float) -> rrb.VisibleTimeRange:
    begin, end = (rrb.TimeRangeBoundary.cursor_relative(seconds=s) for s in (-seconds, 0.0))
    return rrb.VisibleTimeRange(Recorder.TIMELINE, start=begin, end=end)


def _lines(strips: list[Array], colour: Colour, points: float) -> rr.LineStrips3D:
    return rr.LineStrips3D(strips, colors=colour, radii=-points)  # below zero: points on the screen, not metres


def _label(position: Array | list[Array], colour: Colour, points: float, text: str) -> rr.Points3D:
    return rr.Points3D(position, colors=colour, radii=-points, labels=[text], show_labels=True)


def _track(log: FlightLog) -> Array:
    return np.column_stack([log["north"], log["east"], -log["altitude"]])


def _ground(log: FlightLog) -> Array:
    return np.column_stack([log["target_north"], log["target_east"], np.zeros(len(log))])


def _ground_grid(log: FlightLog) -> rr.LineStrips3D:
    """Squares of 100 m on the ground, to where they no longer matter: what shows the chase view its way."""
    places = np.vstack([_track(log), _ground(log), (0.0, 0.0, 0.0)])[:, :2]
    low, high = (
        100.0 * np.round((f(places, axis=0) + far) / 100.0) for f, far in ((np.min, -1500.0), (np.max, 1500.0))
    )
    north, east = (np.arange(a, b + 1.0, 100.0) for a, b in zip(low, high, strict=True))
    # with a corner at every crossing: of a line from behind the eye Rerun does not know the width
    lines = [np.column_stack([np.full_like(east, n), east, np.zeros_like(east)]) for n in north]
    lines += [np.column_stack([north, np.full_like(north, e), np.zeros_like(north)]) for e in east]
    return rr.LineStrips3D(lines, colors=(60, 66, 76), radii=-0.5)


def _circle(flight: Flight, corners: int) -> Array:
    angle = np.linspace(0.0, 2.0 * math.pi, corners)
    return flight.law.standoff * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(corners)])
