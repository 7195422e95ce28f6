"""The manoeuvres that an adopted model must fly: a change of course by 90 deg, and a circle."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from autopilot.angles import wrap
from autopilot.laws import law
from autopilot.standoff import PAPER_STANDOFF
from harness.adoption.refusal import RefusalError
from harness.flight import Flight
from harness.loop import simulate
from harness.plants.plant import End, Outcome, Start
from harness.plants.sixdof import SixDof
from harness.plants.state import State
from harness.plants.turn import GRAVITY
from harness.world.air import Air
from harness.world.target import Target
from harness.world.wind import Wind

Array = NDArray[np.float64]

PERIOD = 0.05  # s: guidance period
CIRCLING_SHARE = 0.35  # tangent of the bank on the circle, over that of the largest bank
COMMANDED_SHARE = 0.85  # tangent of the bank at the command limit, over that of the largest bank
_SIDESLIP = math.radians(6.0)


def rate_of_bank(airspeed: float, max_bank: float, share: float) -> float:
    """The heading rate, rad/s, at a share of the tangent of the largest bank."""
    return share * GRAVITY * math.tan(max_bank) / airspeed


@dataclass(frozen=True, slots=True)
class Turned:
    """A change of course by 90 deg. SI, rad."""

    error: float  # of the course, over the last 5 s
    overshoot: float  # beyond 90 deg
    altitude: float  # largest error
    sideslip: float  # largest
    rate: float  # heading rate over its command of one lag before, in the middle of the turn; NaN where that is zero

    def faults(self, airspeed: float) -> list[str]:
        """Why it does not count as a change of course; empty if it does."""
        return [
            *(
                [f"course {math.degrees(self.error):.1f} deg off, at most 1.5"]
                if self.error > math.radians(1.5)
                else []
            ),
            *_of_path(self.altitude, self.sideslip, airspeed),
        ]


def _of_path(altitude: float, sideslip: float, airspeed: float) -> list[str]:
    allowed = max(15.0, 0.3 * airspeed)
    return [
        *([f"altitude {altitude:.0f} m off, at most {allowed:.0f}"] if altitude > allowed else []),
        *([f"sideslip {math.degrees(sideslip):.1f} deg, at most 6"] if sideslip > _SIDESLIP else []),
    ]


def turned(folder: Path, start: Start, step: float, max_bank: float, lag: float) -> Turned:
    """Flies a change of course by 90 deg to the right. Raises `RefusalError` when the flight ends early."""
    flying = SixDof(folder, step, rate_trim=True).start(replace(start, heading=0.0), Air())
    limit = rate_of_bank(start.airspeed, max_bank, COMMANDED_SHARE)
    gain = min(0.25 / lag, 0.5)  # 1/s, of the course error; lag is that of the bank's loop
    states, commands = [], []
    aim = 0.5 * math.pi
    for i in range(round((aim / limit + 12.0 / gain + 10.0) / PERIOD)):
        rate = gain * wrap((aim if i * PERIOD > 2.0 else 0.0) - flying.state.heading)
        commands.append(min(max(rate, -limit), limit))
        try:
            flying.advance(commands[-1], PERIOD)
        except End as end:
            raise RefusalError("90 deg", f"ended in {end.outcome} after {i * PERIOD:.1f} s: {end}") from None
        states.append(flying.state)
    column = _columns(states)
    course = np.unwrap(column["heading"])
    turning = np.flatnonzero((course > math.radians(30.0)) & (course < math.radians(60.0)))
    before = np.array(commands)[np.maximum(turning - round(lag / PERIOD), 0)].sum()
    return Turned(
        error=float(np.abs(course[-round(5.0 / PERIOD) :] - aim).max()),
        overshoot=max(0.0, float(course.max()) - aim),
        altitude=float(np.abs(column["altitude"] - start.altitude).max()),
        sideslip=float(np.abs(column["sideslip"] - column["sideslip"][0]).max()),
        rate=float(column["heading_rate"][turning].sum() / before) if before else math.nan,
    )


def _columns(states: list[State]) -> dict[str, Array]:
    return dict(zip(State._fields, np.array(states).T, strict=True))


@dataclass(frozen=True, slots=True)
class Circled:
    """Laps around a target. SI, rad."""

    error: float  # of the range, rms over the last lap, over the radius
    altitude: float  # largest error
    sideslip: float  # largest

    def faults(self, airspeed: float) -> list[str]:
        """Why it does not count as a circle; empty if it does."""
        return [
            *([f"{100 * self.error:.1f} % of the radius off, at most 2 %"] if not self.error < 0.02 else []),
            *_of_path(self.altitude, self.sideslip, airspeed),
        ]


def circled(folder: Path, start: Start, step: float, law: Mapping[str, float], wind: float = 0.0) -> Circled:
    """Flies two and a half laps with this law, see `law_of`. Raises `RefusalError` when the flight ends early."""
    flight = circle(folder, start, step, law, wind)
    log = simulate(flight)
    if log.outcome is not Outcome.COMPLETED:
        raise RefusalError("circle", f"ended in {log.outcome}: {log.reason}")
    R = law["standoff_m"]
    lap = round(_lap(R, start.airspeed, wind) / flight.guidance_period)
    return Circled(
        error=float(np.sqrt(np.mean(log["range_error"][-lap:] ** 2))) / R,
        altitude=float(np.abs(log["altitude"] - start.altitude).max()),
        sideslip=float(np.abs(log["sideslip"] - log["sideslip"][0]).max()),
    )


def _lap(radius: float, airspeed: float, wind: float) -> float:
    """The longest that a lap takes, s."""
    return 2.0 * math.pi * radius / airspeed / (1.0 - (wind / airspeed) ** 2)


def law_of(airspeed: float, max_bank: float, follow: float) -> dict[str, float]:
    """Circle, limit and gains of the paper's law for an aircraft that follows at `follow`, 1/s; as a file has them.

    k1 R_d is the paper's. k2 is 0.15 of the rate at which the aircraft follows: the paper's own, scaled with the circle
    too, keeps the command at its limit.
    """
    R = float(f"{airspeed / rate_of_bank(airspeed, max_bank, CIRCLING_SHARE):.2g}")
    k2 = float(f"{0.15 * follow:.3g}")
    limit = rate_of_bank(airspeed, max_bank, COMMANDED_SHARE)
    return {
        "standoff_m": R, "max_heading_rate_deg_s": math.degrees(limit), "k1": 0.05 * PAPER_STANDOFF / R, "k2": k2,
        "k3": 0.5 * k2,
    }  # fmt: skip


def circle(folder: Path, start: Start, step: float, scaled: Mapping[str, float], wind: float = 0.0) -> Flight:
    """The flight of a circle that suits the aircraft, from half a radius outside it; the wind blows east."""
    R, gains = scaled["standoff_m"], {name: scaled[name] for name in ("k1", "k2", "k3")}
    limit = math.radians(scaled["max_heading_rate_deg_s"])
    return Flight(
        plant="sixdof",
        aircraft=str(folder),
        law=law("nftsm", "fitted", standoff=R, max_heading_rate=limit, **gains),
        duration=float(round(2.5 * _lap(R, start.airspeed, wind))),
        guidance_period=PERIOD,
        step=step,
        start=replace(start, position=(-1.5 * R, 0.3 * R), heading=0.0),
        target=Target(position=(0.0, 0.0)),
        wind=Wind(steady=(0.0, wind)),
    )
