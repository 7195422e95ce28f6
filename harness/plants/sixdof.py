"""The plant `sixdof`: a JSBSim airframe under its native inner loop.

In this order: trimming a model, engaging its inner loop, flying it.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import aircraft
from autopilot.angles import wrap
from harness.flight_errors import Errors
from harness.plants.model import FT, Fdm, check_body, cross, dot, load, node, place, write
from harness.plants.plant import End, Outcome, PlantError, Start
from harness.plants.state import State
from harness.plants.turn import GRAVITY
from harness.plants.wind_tunnel import STEADY, Controls, NotFiniteError, TrimPoint, WindTunnel
from harness.world.air import Air, Vector

Array = NDArray[np.float64]

GROUND = 15.0  # m above the ground: a flight ends below it
DEPARTURE_BANK = math.radians(80.0)
AT_ONCE = 1000  # steps whose gusts are turned into Python's numbers at once
STALL_TIME = 3.0  # s beyond the stall angle of attack without recovery

_NO_ERRORS = Errors()


class NoTrimError(ValueError):
    """There is no steady level flight at this airspeed."""


_NUDGE = 1e-5  # rad, or share of the throttle: step of numerical derivatives


class Trim(NamedTuple):
    """Pitch, rad, elevator, rad, and throttle, 0 to 1, of steady level flight."""

    pitch: float
    elevator: float
    throttle: float


def trim(fdm: Fdm, start: Start, air: Air) -> Trim:
    """Puts the aircraft at `start`, level and unaccelerated in the wind there, and returns its trim.

    Newton's method on the accelerations that JSBSim computes. It places the surfaces directly: the actuators do not run
    before the inner loop is engaged, so their lag cannot falsify the result. Raises `NoTrimError` without a solution,
    `ModelError` for what is no body.
    """
    place(fdm, start, air.horizontal(0))
    _connect(fdm, False)
    x = Trim(pitch=0.05, elevator=0.0, throttle=0.5)
    for _ in range(30):
        residual = _accelerations(fdm, x)
        if max(map(abs, residual)) < 1e-11:
            break
        by_pitch, by_elevator, by_throttle = (_slope(fdm, x, i, residual) for i in range(3))
        change = _solve(by_pitch, by_elevator, by_throttle, residual)
        share = min(1.0, 0.1 / max(1e-9, *map(abs, change)))  # at most 0.1 rad, 0.1 of the throttle at a time
        x = Trim._make(v - share * d for v, d in zip(x, change, strict=True))
    is_steady = max(map(abs, _accelerations(fdm, x))) < 1e-8
    check_body(fdm)
    if not (is_steady and 0.0 < x.throttle < 1.0 and abs(x.pitch) < math.pi / 6):
        raise NoTrimError(f"no level trim at {start.airspeed:g} m/s, {start.altitude:g} m high")
    return x


def _slope(fdm: Fdm, x: Trim, i: int, residual: Vector) -> Vector:
    """The derivative of the accelerations by the i-th unknown, a forward difference."""
    u, w, q = _accelerations(fdm, Trim._make(v + _NUDGE * (i == j) for j, v in enumerate(x)))
    return (u - residual[0]) / _NUDGE, (w - residual[1]) / _NUDGE, (q - residual[2]) / _NUDGE


def _solve(a: Vector, b: Vector, c: Vector, r: Vector) -> Vector:
    """Solves [a b c] x = r by Cramer's rule: the same bits on every machine, unlike a linear algebra library."""
    det = dot(a, cross(b, c)) or math.nan
    return dot(r, cross(b, c)) / det, dot(a, cross(r, c)) / det, dot(a, cross(b, r)) / det


def _accelerations(fdm: Fdm, x: Trim) -> Vector:
    """(u', w', q') in m/s^2, m/s^2, rad/s^2 at this pitch, elevator and throttle."""
    fdm["ic/theta-rad"] = x.pitch
    fdm["fcs/elevator-pos-rad"] = x.elevator
    fdm["actuators/throttle-norm"] = x.throttle
    fdm.run_ic()
    return (
        FT * fdm["accelerations/udot-ft_sec2"],
        FT * fdm["accelerations/wdot-ft_sec2"],
        fdm["accelerations/qdot-rad_sec2"],
    )


def engage(fdm: Fdm, trimmed: Trim, start: Start, rate_trim: bool) -> None:
    """Hands the trimmed aircraft to its inner loop, which holds this altitude and airspeed.

    A JSBSim actuator or filter without a past takes its first input at once, past its lag and rate limit. So each runs
    a first time here, in trim and with time at rest: what it takes is the trim.
    """
    command(fdm, trimmed, start, rate_trim)
    _connect(fdm, True)
    fdm.run_ic()


def command(fdm: Fdm, trimmed: Trim, start: Start, rate_trim: bool) -> None:
    """Tells the inner loop the trim, and what it shall hold."""
    write(fdm, "inner-loop/trim/pitch-rad", trimmed.pitch)
    write(fdm, "inner-loop/trim/pitch-rate-rad_s", fdm["velocities/q-rad_sec"])  # level on a sphere turns down with it
    write(fdm, "inner-loop/trim/elevator-rad", trimmed.elevator)
    write(fdm, "inner-loop/trim/throttle-norm", trimmed.throttle)
    write(fdm, "inner-loop/command/altitude-m", start.altitude)
    write(fdm, "inner-loop/command/airspeed-mps", start.airspeed)
    write(fdm, "inner-loop/command/heading-rate-rad_s", 0.0)
    write(fdm, "inner-loop/rate-trim", float(rate_trim))


def _connect(fdm: Fdm, connected: bool) -> None:
    """Whether the inner loop and the actuators run."""
    write(fdm, "inner-loop/engaged", float(connected))
    write(fdm, "actuators/engaged", float(connected))


READ = (
    "position/from-start-neu-n-ft",
    "position/from-start-neu-e-ft",
    "velocities/v-north-fps",
    "velocities/v-east-fps",
    "velocities/vt-fps",
    "attitude/phi-rad",
    "velocities/p-rad_sec",
    "position/h-sl-ft",
    "velocities/v-down-fps",
    "attitude/theta-rad",
    "attitude/psi-rad",
    "velocities/q-rad_sec",
    "velocities/r-rad_sec",
    "inner-loop/bank-command-rad",
    "aero/alpha-rad",
    "aero/beta-rad",
    "accelerations/Ny",
    "accelerations/Nz",
    "fcs/left-aileron-pos-rad",
    "fcs/elevator-pos-rad",
    "fcs/rudder-pos-rad",
    "actuators/throttle-norm",
    "atmosphere/gust-north-fps",
    "atmosphere/gust-east-fps",
    "atmosphere/gust-down-fps",
)


@dataclass(frozen=True, slots=True)
class SixDof:
    """A JSBSim airframe, given by its folder, under its native inner loop, stepped by `step` seconds.

    `rate_trim` switches the slow integrator that removes the turn-rate shortfall of a bank-only turn. The inner loop is
    the one of an airframe without `errors`.
    """

    airframe: Path
    step: float
    rate_trim: bool
    errors: Errors = _NO_ERRORS

    def start(self, start: Start, air: Air) -> "SixDofFlying":
        if not start.altitude > GROUND:
            raise PlantError("start.altitude", f"{start.altitude:g} m is not above {GROUND:g} m, where flights end")
        limits = aircraft.limits(self.airframe)
        fdm = load(self.airframe, self.step, self.errors)
        if adopted := aircraft.adopted(self.airframe):
            self._engage_adopted(fdm, adopted, start, air)
            stepper = _stepper(fdm, air)
            stepper(1, lambda: None)  # the air at the start: the first step flies to the next
            return SixDofFlying(fdm, self.step, start, air, limits.stall, stepper)
        try:
            trimmed = trim(fdm, start, air)
        except NoTrimError as error:
            allowed = f"{self.airframe.name} flies from {limits.slowest:g} to {limits.fastest:g} m/s"
            raise PlantError("start.airspeed", f"{error}; {allowed}") from None
        engage(fdm, trimmed, start, self.rate_trim)
        stepper = _stepper(fdm, air)
        if len(air.gusts):  # the first gust is there before the surfaces answer it
            _connect(fdm, False)
            stepper(1, fdm.run_ic)
            _connect(fdm, True)
        return SixDofFlying(fdm, self.step, start, air, limits.stall, stepper)

    def _engage_adopted(self, fdm: Fdm, adopted: Mapping[str, Any], start: Start, air: Air) -> None:
        """Trims an adopted model in the wind tunnel, hands it to its inner loop, and lets it fly."""
        tunnel = WindTunnel(fdm, Controls.of(adopted["controls"]), start, self.step, air.horizontal(0))
        try:
            tunnel.start_engines()
            tunnel.setting = TrimPoint(**adopted["trim"])
            if not tunnel.trim() < STEADY:
                raise PlantError(
                    "start.airspeed", f"no level trim at {start.airspeed:g} m/s, {start.altitude:g} m high"
                )
        except NotFiniteError as error:
            raise PlantError("start.airspeed", f"{self.airframe.name}: {error}") from None
        trimmed = tunnel.setting
        write(fdm, "adopted/trim/aileron-norm", trimmed.aileron)
        write(fdm, "adopted/trim/rudder-norm", trimmed.rudder)
        command(fdm, Trim(trimmed.pitch, trimmed.elevator, trimmed.throttle), start, self.rate_trim)
        _connect(fdm, True)
        fdm.run()  # filters of the inner loop take their first input
        tunnel.release()


Stepper = Callable[[int, Callable[[], object]], None]
"""Makes so many steps, each by a call such as `fdm.run`, before which JSBSim gets the air at the end of the step."""


def _stepper(fdm: Fdm, air: Air) -> Stepper:
    return _in_gusts(fdm, air) if len(air.gusts) else _in_steady_air


def _in_steady_air(steps: int, run: Callable[[], object]) -> None:
    for _ in range(steps):
        run()


def _in_gusts(fdm: Fdm, air: Air) -> Stepper:
    """JSBSim's steady wind is the horizontal wind in which the aircraft was trimmed; gusts are the difference to it."""
    set_x, set_y, set_z, roll, pitch, yaw = (
        node(fdm, name).set_double_value
        for name in (
            *(f"atmosphere/gust-{axis}-fps" for axis in ("north", "east", "down")),
            *(f"gust/{axis}-rad_sec" for axis in "pqr"),
        )
    )
    height, heading = (node(fdm, name).get_double_value for name in ("position/h-sl-ft", "attitude/psi-rad"))
    (shear_x, shear_y), level = air.shear, air.altitude / FT
    met_x, met_y, _ = air.gust(0)
    gusts, rotation = air.gusts, air.rotation(FT * fdm["metrics/bw-ft"])

    def block(k: int) -> Iterator[tuple[float, ...]]:
        """The numbers of some steps from the k-th on; those of a whole flight take four times the memory of arrays."""
        apart = (gusts[k : k + AT_ONCE] - (met_x, met_y, 0.0)) / FT
        return zip(*apart.T.tolist(), *rotation[k : k + AT_ONCE].T.tolist(), strict=True)

    rows = chain.from_iterable(map(block, range(0, len(gusts), AT_ONCE)))
    sin, cos, is_sheared = math.sin, math.cos, bool(shear_x or shear_y)

    def step(steps: int, run: Callable[[], object]) -> None:
        for W_x, W_y, W_z, p, q, r_x, r_y in islice(rows, steps):
            if is_sheared:
                above = height() - level
                W_x, W_y = W_x + shear_x * above, W_y + shear_y * above
            psi = heading()
            set_x(W_x)
            set_y(W_y)
            set_z(W_z)
            roll(p)
            pitch(q)
            yaw(r_y * cos(psi) - r_x * sin(psi))
            run()

    return step


Frame = tuple[float, float, float, float, float, float, float]
"""What turns readings of JSBSim into a state: the position at the start, m, the steady wind and the wind in which the
aircraft was trimmed, m/s, each north and east, and the step, s."""


def state_of(read: Sequence[float], before: float, frame: Frame) -> State:
    """The state, from the values of `READ`; `before` is the heading one step ago: the rate is the mean over it."""
    (
        n, e, v_n, v_e, V, phi, p, h, v_d, theta, psi, q, r, phi_c, alpha, beta, N_y, N_z,
        aileron, elevator, rudder, throttle, gust_x, gust_y, gust_z,
    ) = read  # fmt: skip
    north, east, W_x, W_y, start_x, start_y, step = frame
    v_n, v_e = FT * v_n, FT * v_e
    heading = math.atan2(v_e - W_y, v_n - W_x)
    return State._make(
        (
            north + FT * n, east + FT * e, v_n, v_e, FT * V,
            heading, wrap(heading - before) / step, phi, p, FT * h, FT * v_d, theta, psi, q, r,
            phi_c, alpha, beta, GRAVITY * N_y, N_z, aileron, elevator, rudder, throttle,
            start_x + FT * gust_x, start_y + FT * gust_y, FT * gust_z,
        )
    )  # fmt: skip


def is_flying(state: State, stall: float) -> bool:
    """Whether the aircraft is above the ground, below an angle of attack, rad, and not on its back."""
    return state.altitude > GROUND and abs(state.bank) < DEPARTURE_BANK and state.angle_of_attack < stall


class SixDofFlying:
    """The aircraft in flight, in JSBSim."""

    def __init__(self, fdm: Fdm, step: float, start: Start, air: Air, stall: float, stepper: Stepper) -> None:
        self.fdm, self.stall = fdm, stall
        self.readers = [node(fdm, name).get_double_value for name in READ]
        self.frame: Frame = (*start.position, *air.steady, *air.horizontal(0), step)
        self._run: Callable[[], bool] = fdm.run
        self._step = stepper
        self._velocity_north, self._velocity_east = self.readers[2:4]
        self._command = node(fdm, "inner-loop/command/heading-rate-rad_s").set_double_value
        self.stalled_for = 0.0
        self.state = self.read(self.heading())

    def advance(self, heading_rate: float, period: float) -> None:
        self.state = state = self.read(self.fly(heading_rate, period))
        if is_flying(state, self.stall) and math.isfinite(sum(state)):
            self.stalled_for = 0.0
        else:
            self.judge(state, period)

    def fly(self, heading_rate: float, period: float) -> float:
        """Flies on, and gives the heading one step before the end, rad; what is then is not looked at."""
        self._command(heading_rate)
        self._step(round(period / self.frame[-1]) - 1, self._run)
        before = self.heading()
        self._step(1, self._run)
        return before

    def heading(self) -> float:
        """psi_a, rad: the direction of (ground velocity - steady wind)."""
        W_x, W_y = self.frame[2:4]
        return math.atan2(FT * self._velocity_east() - W_y, FT * self._velocity_north() - W_x)

    def read(self, before: float) -> State:
        """The state now: see `state_of`."""
        return state_of([get() for get in self.readers], before, self.frame)

    def judge(self, state: State, period: float) -> None:
        """Raises `End` for an aircraft on the ground, departed or with a non-finite state, or in a lasting stall."""
        if not all(map(math.isfinite, state)):
            raise End(Outcome.INVALID, "a number of the simulated aircraft is not finite")
        if state.altitude <= GROUND:
            raise End(Outcome.GROUND, f"below {GROUND:g} m")
        if abs(state.bank) >= DEPARTURE_BANK:
            raise End(Outcome.DEPARTED, f"bank of {math.degrees(state.bank):.0f} deg")
        self.stalled_for += period
        if self.stalled_for > STALL_TIME:
            raise End(Outcome.DEPARTED, f"stalled for {STALL_TIME:g} s")
