"""The scene in three dimensions: aircraft, tracks, target, circle, wind. NED from the flight's origin, m."""

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

TRAIL = 60.0  # s: length of the trail
_STRIP = 1.0  # s: length of a piece of the trail
_MOVES = 0.1  # s, between two poses
_CORNERS = 0.25  # s, between two corners of a whole track
_NEAR = 4.0  # how many times its size an aircraft has in the chase view
_ELEVATION = math.radians(55.0)  # of the eye above the scene
_HALF_VIEW = 0.46  # height per distance: inside what Rerun's eye sees, tan(55 deg / 2) up and down
_BLACK = (0, 0, 0)


def log_surroundings(to: Recorder, log: FlightLog) -> None:
    """Logs the target on the ground and, at the flight's altitude, the circle and the displacement by 20 s of wind."""
    to.once("/", rr.ViewCoordinates.FRD)
    to.once("/ground", _ground_grid(log))
    flight = log.flight
    wind = np.array((*flight.wind.steady, 0.0))
    foot, centre = np.zeros(3), np.array((0.0, 0.0, -flight.start.altitude))
    to.once("/target/position/point", _label([foot], TARGET, 5.0, "target"))
    circle = _circle(flight, 121) + centre + (0.0, 0.0, 2.0)  # 2 m below the tracks, which stay visible on it
    to.once("/target/position/circle", _lines([circle, np.array((foot, centre))], TARGET, 0.7))
    if wind.any():
        to.once("/target/position/wind", rr.Arrows3D(vectors=[20.0 * wind], origins=[centre], colors=WIND, radii=-2.5))
        below = (
            centre + max(0.0, 30.0 * np.sign(-wind[0])) * wind
        )  # a label hangs under its point: keep it off the arrow
        to.once("/target/position/wind/label", _label([below], WIND, 0.1, f"wind {np.hypot(*wind[:2]):.2g} m/s"))


def log_target(to: Recorder, log: FlightLog) -> None:
    """Logs the position of the target and, with an estimator, its estimate."""
    rows = _every(_MOVES, log)
    to.columns("/target/position", log["time"][rows], rr.Transform3D.columns(translation=_ground(log)[rows]))
    if log.flight.estimator.filters:
        seen = np.column_stack([log["target_north_seen"], log["target_east_seen"], np.zeros(len(log))])
        new = np.isfinite(log["innovation_range"])
        where = rr.Transform3D.columns(translation=seen[new])
        to.columns("/target/estimate", log["time"][new], where)


def log_tracks(to: Recorder, flight: StyledFlight, log: FlightLog) -> None:
    """Logs what is known once the flight is over: the tracks of aircraft and target, and how it ended."""
    entity = to.flight(flight.name)
    faint = mixed(flight.colour, _BLACK, 0.35)
    corners = _every(_CORNERS, log)
    to.once(f"{entity}/track", _lines([_track(log)[corners] + _below(flight)], faint, 0.4 * flight.width))
    to.once("/target/track", _lines([_ground(log)[corners]], TARGET, 1.0))
    if log.outcome.value != "completed" and len(log):
        to.once(f"{entity}/end", _label(_track(log)[-1:], flight.colour, 5.0, log.outcome.value))


def log_airframe(to: Recorder, flight: StyledFlight, flights: Sequence[StyledFlight]) -> None:
    """Logs the shape of the aircraft twice: `far`, enlarged for the scene, and `near`, for the chase view."""
    entity = to.flight(flight.name)
    to.once(f"{entity}/vehicle/body/far", airframe(flight.log.flight, enlargement(flights), flight.colour))
    to.once(f"{entity}/vehicle/body/near", airframe(flight.log.flight, _NEAR, flight.colour))
    if flight.log.flight.estimator.filters:
        to.once("/target/estimate/point", rr.Points3D([(0.0, 0.0, 0.0)], colors=ESTIMATE, radii=-4.0))
        beside = np.array((0.0, 0.7 * flight.log.flight.law.standoff, 0.0))  # clear of the target's label
        to.once("/target/estimate/label", _label([beside], ESTIMATE, 0.1, "estimate"))


def log_motion(to: Recorder, flight: StyledFlight, rows: FlightLog) -> None:
    """Logs the pose of the aircraft: a level frame that moves along the track, and the attitude within it."""
    entity, some = to.flight(flight.name), _every(_MOVES, rows)
    yaw = np.where(np.isnan(rows["yaw"]), rows["heading"], rows["yaw"])[
        some
    ]  # a plant without yaw points along its heading
    level = Rotation.from_euler("Z", yaw[:, np.newaxis]).as_quat()
    pose = rr.Transform3D.columns(translation=_track(rows)[some], quaternion=level)
    to.columns(f"{entity}/vehicle", rows["time"][some], pose)
    if not np.isnan(rows["bank"]).all():
        attitude = np.column_stack([np.nan_to_num(rows["pitch"]), np.nan_to_num(rows["bank"])])[some]
        banked = rr.Transform3D.columns(quaternion=Rotation.from_euler("YX", attitude).as_quat())
        to.columns(f"{entity}/vehicle/body", rows["time"][some], banked)


def log_trail(to: Recorder, flight: StyledFlight, rows: FlightLog) -> int:
    """Logs the trail behind the aircraft in pieces of a second; returns the row at which the last one ends."""
    piece = max(1, round(_STRIP / rows.flight.guidance_period))
    ends = np.arange(piece, len(rows), piece)
    if not len(ends):
        return 0
    entity, track = f"{to.flight(flight.name)}/trail", _track(rows)
    strips = [track[end - piece : end + 1] + _below(flight) for end in ends]
    to.once(entity, rr.LineStrips3D.from_fields(colors=flight.colour, radii=-_trail_radius(flight)))
    to.columns(entity, rows["time"][ends], rr.LineStrips3D.columns(strips=strips))
    return int(ends[-1])


def scene_view(flights: Sequence[StyledFlight], aspect: float, name: str = "Scene") -> rrb.Spatial3DView:
    """A view from the south and from above, far enough to contain everything; `aspect` is width over height."""
    reference = flights[0].log
    ground = _ground(reference)[::-20] if len(reference) else np.array([(*reference.flight.target.position, 0.0)])
    centres = ground - (0.0, 0.0, reference.flight.start.altitude)
    rims = (centres[:, np.newaxis] + _circle(reference.flight, 25)).reshape(-1, 3)
    start = np.array([(*reference.flight.start.position, -reference.flight.start.altitude)])
    c, s = math.cos(_ELEVATION), math.sin(_ELEVATION)
    axes = np.array(((0.0, 1.0, 0.0), (s, 0.0, -c), (-c, 0.0, -s)))  # of the picture: to the right, up, towards the eye
    x, y, z = axes @ np.vstack([ground, rims, start, *(_track(flight.log) for flight in flights)]).T
    # An eye at (X, Y, Z) sees a point if |x - X| <= w (Z - z) and |y - Y| <= h (Z - z): each side bounds X +- w Z
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
            "- /charts/**",
            "- /ground",
            *(f"- {Recorder.flight(flight.name)}/vehicle/body/near" for flight in flights),
        ],
        eye_controls=rrb.EyeControls3D(position=eye @ axes, look_target=look @ axes, eye_up=(0.0, 0.0, -1.0)),
        line_grid=rrb.LineGrid3D(spacing=grid),
        time_ranges=_last(TRAIL),
    )


def chase_view(flight: StyledFlight, flights: Sequence[StyledFlight]) -> rrb.Spatial3DView:
    """A view from behind and above the aircraft, which turns with it and keeps the horizon level."""
    entity = Recorder.flight(flight.name)
    span = _NEAR * size(flight.log.flight)[0]
    return rrb.Spatial3DView(
        origin=f"{entity}/vehicle",
        name=f"Chase: {flight.name}, level, aircraft x{_NEAR:g}",
        contents=[
            "+ /**",
            "- /plots/**",
            "- /charts/**",
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
    """The factor by which aircraft are enlarged in the scene: to about a third of the circle's radius."""
    needed = 0.3 * flights[0].log.flight.law.standoff / size(flights[0].log.flight)[0]
    return float(
        min((1, 2, 3, 5, 7, 10, 15, 20, 30, 40, 60, 80, 100, 200, 500, 1000), key=lambda x: abs(math.log(x / needed)))
    )


def _every(seconds: float, rows: FlightLog) -> NDArray[np.int64]:
    """The numbers of rows this many seconds apart, and of the last row."""
    step = max(1, round(seconds / rows.flight.guidance_period))
    return np.unique(np.append(np.arange(0, len(rows), step), np.arange(len(rows))[-1:])).astype(np.int64)


def _below(flight: StyledFlight) -> Array:
    """The offset by which a line is drawn below its place, m: a thin line on a wide one stays visible."""
    return np.array((0.0, 0.0, 0.5 * (flight.width - 1.5)))


def _trail_radius(flight: StyledFlight) -> float:
    return 0.75 + 0.3 * flight.width


def _last(seconds: float) -> rrb.VisibleTimeRange:
    begin, end = (rrb.TimeRangeBoundary.cursor_relative(seconds=s) for s in (-seconds, 0.0))
    return rrb.VisibleTimeRange(Recorder.TIMELINE, start=begin, end=end)


def _lines(strips: list[Array], colour: Colour, points: float) -> rr.LineStrips3D:
    return rr.LineStrips3D(strips, colors=colour, radii=-points)  # a negative radius is in points on the screen


def _label(position: Array | list[Array], colour: Colour, points: float, text: str) -> rr.Points3D:
    return rr.Points3D(position, colors=colour, radii=-points, labels=[text], show_labels=True)


def _track(log: FlightLog) -> Array:
    return np.column_stack([log["north"], log["east"], -log["altitude"]])


def _ground(log: FlightLog) -> Array:
    return np.column_stack([log["target_north"], log["target_east"], np.zeros(len(log))])


def _ground_grid(log: FlightLog) -> rr.LineStrips3D:
    """A grid of 100 m on the ground, reaching 1.5 km beyond the flight: it shows the motion in the chase view."""
    places = np.vstack([_track(log), _ground(log), (0.0, 0.0, 0.0)])[:, :2]
    low, high = (
        100.0 * np.round((f(places, axis=0) + far) / 100.0) for f, far in ((np.min, -1500.0), (np.max, 1500.0))
    )
    north, east = (np.arange(a, b + 1.0, 100.0) for a, b in zip(low, high, strict=True))
    # with a corner at every crossing: Rerun draws long lines that pass the eye with a wrong width
    lines = [np.column_stack([np.full_like(east, n), east, np.zeros_like(east)]) for n in north]
    lines += [np.column_stack([north, np.full_like(north, e), np.zeros_like(north)]) for e in east]
    return rr.LineStrips3D(lines, colors=(60, 66, 76), radii=-0.5)


def _circle(flight: Flight, corners: int) -> Array:
    angle = np.linspace(0.0, 2.0 * math.pi, corners)
    return flight.law.standoff * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(corners)])
