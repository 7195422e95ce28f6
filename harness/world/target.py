"""The target on the ground: it moves in segments of constant acceleration and turn rate, or along a recorded track."""

import math
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NamedTuple

from annotated_types import Ge, Le

from autopilot.quantities import About, Degrees, DegreesPerSecond, Metres, MetresPerSecond, MetresPerSecond2, Seconds
from harness.world.track import load_track

_FASTEST_TURN = math.radians(1000.0)  # far beyond any target: larger angles would lose their digits


class TargetState(NamedTuple):
    """The target at one moment. SI, rad, north and east of the flight's origin."""

    target_north: float
    target_east: float
    target_velocity_north: float
    target_velocity_east: float
    target_acceleration: float = 0.0  # rate of change of its speed
    target_turn_rate: float = 0.0  # clockwise


@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """An interval in which the target accelerates, turns, or both. Overlapping segments add up."""

    from_: Annotated[Seconds, Ge(0), Le(1e6), About("begin")]
    to: Annotated[Seconds, Ge(0), Le(1e6), About("end")]
    acceleration: Annotated[MetresPerSecond2, Ge(-100), Le(100), About("along-track acceleration")] = 0.0
    turn_rate: Annotated[DegreesPerSecond, Ge(-_FASTEST_TURN), Le(_FASTEST_TURN), About("turn rate, clockwise")] = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """Where the target starts and how it moves."""

    position: Annotated[tuple[Metres, Metres], About("north, east of the origin")] = (10.0, 10.0)
    speed: Annotated[MetresPerSecond, Ge(0), About("initial speed")] = 0.0
    heading: Annotated[Degrees, About("initial direction, clockwise from north")] = 0.0
    segments: Annotated[tuple[Segment, ...], About("manoeuvres: intervals of constant acceleration and turn rate")] = ()
    track: Annotated[str | None, About("a recorded track instead, a CSV: time_s, north_m, east_m")] = None

    def start(self) -> Callable[[float], TargetState]:
        """The motion as a function of the time, s, with the state as its value. Raises `TrackError`."""
        if self.track is not None:
            recorded = load_track(Path(self.track)).at
            return lambda time: TargetState._make(recorded(time))
        legs = self.legs()
        if len(legs) == 1 and not self.speed and not legs[0].acceleration:
            rest = TargetState(*self.position, 0.0, 0.0)
            return lambda time: rest
        begins = [leg.begin for leg in legs]
        return lambda time: legs[bisect_right(begins, time) - 1].at(time)

    def breakpoints(self) -> list[float]:
        """The times, s, at which acceleration or turn rate changes; of a track, the times of its rows."""
        return load_track(Path(self.track)).begins if self.track is not None else [leg.begin for leg in self.legs()]

    def legs(self) -> list["Leg"]:
        """The motion of the segments, cut at every change of acceleration or turn rate; the last leg has no end."""
        cuts = sorted({0.0, *(s.from_ for s in self.segments), *(s.to for s in self.segments)})
        legs: list[Leg] = []
        n, e, speed, heading = *self.position, self.speed, self.heading
        for i, begin in enumerate(cuts):
            active = [s for s in self.segments if s.from_ <= begin < s.to]
            leg = Leg(
                begin, n, e, speed, heading, sum(s.acceleration for s in active), sum(s.turn_rate for s in active)
            )
            legs.append(leg)
            if i + 1 < len(cuts):
                length = cuts[i + 1] - begin
                n, e = leg.at(cuts[i + 1])[:2]
                speed, heading = speed + leg.acceleration * length, heading + leg.turn_rate * length
        return legs


class Leg(NamedTuple):
    """Motion at constant acceleration and turn rate from time `begin`, s, on. SI, rad."""

    begin: float
    north: float
    east: float
    speed: float
    heading: float
    acceleration: float
    turn_rate: float

    def at(self, time: float) -> TargetState:
        """The state at `time`, s, in closed form."""
        t = time - self.begin
        a, w = self.acceleration, self.turn_rate
        v0, v = self.speed, self.speed + a * t
        psi0, psi = self.heading, self.heading + w * t
        if abs(w * t) < 1e-6:
            way, mean = (v0 + 0.5 * a * t) * t, psi0 + 0.5 * w * t
            dn, de = way * math.cos(mean), way * math.sin(mean)
        else:  # the integral of v(t) (cos psi, sin psi), by parts
            dn = (v * math.sin(psi) - v0 * math.sin(psi0)) / w + a * (math.cos(psi) - math.cos(psi0)) / (w * w)
            de = (v0 * math.cos(psi0) - v * math.cos(psi)) / w + a * (math.sin(psi) - math.sin(psi0)) / (w * w)
        return TargetState(self.north + dn, self.east + de, v * math.cos(psi), v * math.sin(psi), a, w)
