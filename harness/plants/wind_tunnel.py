"""A wind tunnel for third-party models: the aircraft is held in the air while engines and surfaces settle.

The trim of the harness's own airframes uses the accelerations of one instant, with the surfaces placed. A third-party
model has its own flight control system, propellers and turbines, so its accelerations are valid only after they settle.
JSBSim's integrators are switched off meanwhile: time advances, and the motion of the aircraft is frozen.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from harness.plants.model import FT, Fdm, fill_empty_tanks, place, unknown
from harness.plants.plant import Start

Array = NDArray[np.float64]

POUND = 4.4482216152605  # N
_INTEGRATORS = tuple(
    f"simulation/integrator/{what}/{axis}" for what in ("rate", "position") for axis in ("rotational", "translational")
)
_ACCELERATIONS = (
    *(f"accelerations/{axis}dot-ft_sec2" for axis in "uvw"),
    *(f"accelerations/{axis}dot-rad_sec2" for axis in "pqr"),
)
_UNITS = np.array([FT, FT, FT, 1.0, 1.0, 1.0])
_CLEAN = ("gear/gear-cmd-norm", "gear/gear-pos-norm", "fcs/flap-cmd-norm", "fcs/speedbrake-cmd-norm",
    "fcs/spoiler-cmd-norm", "fcs/left-brake-cmd-norm", "fcs/right-brake-cmd-norm", "fcs/center-brake-cmd-norm",
)  # fmt: skip
STEADY = 2e-3  # m/s^2 and rad/s^2: residual accelerations of a trim
_STARTER = 5.0  # s: time of the starter
_NO_RUDDER = 0.01  # rad/s^2 over the whole travel: a rudder with less effect counts as none
_ASIDE, _ASIDE_FOR = 0.2, 0.3  # offset of the commands, and its duration, s, for the approach from one side


@dataclass(frozen=True, slots=True)
class Controls:
    """The names of the properties that command an aircraft, in the model's own normalised units."""

    elevator: str
    aileron: str
    rudder: str
    throttles: tuple[str, ...]

    @classmethod
    def of(cls, table: Mapping[str, Any]) -> Self:
        """The controls from a table of a file: names, and for `throttle` one or a list of them."""
        throttles = table["throttle"]
        names = (throttles,) if isinstance(throttles, str) else tuple(throttles)
        return cls(table["elevator"], table["aileron"], table["rudder"], names)


class TrimPoint(NamedTuple):
    """Attitude, rad, and commands, normalised, of an aircraft in the tunnel."""

    pitch: float = 0.05
    elevator: float = 0.0
    throttle: float = 0.5
    bank: float = 0.0
    aileron: float = 0.0
    rudder: float = 0.0
    sideslip: float = 0.0  # rad, beside zero only where the rudder does nothing


_RANGE = TrimPoint(pitch=0.5, elevator=1.0, throttle=1.0, bank=0.35, aileron=1.0, rudder=1.0, sideslip=0.1)
_LEAST = TrimPoint(pitch=-0.35, elevator=-1.0, throttle=0.0, bank=-0.35, aileron=-1.0, rudder=-1.0, sideslip=-0.1)
_NUDGE = TrimPoint(pitch=0.01, elevator=0.03, throttle=0.05, bank=0.01, aileron=0.03, rudder=0.03, sideslip=0.01)
_FARTHEST = TrimPoint(
    pitch=0.1, elevator=0.4, throttle=0.4, bank=0.1, aileron=0.4, rudder=0.4, sideslip=0.05
)  # of one step


class NotFiniteError(ValueError):
    """A number of the simulated aircraft is not finite."""


class WindTunnel:
    """An aircraft held in the air at one airspeed and altitude; of a loaded JSBSim that has not flown yet."""

    def __init__(
        self, fdm: Fdm, controls: Controls, start: Start, step: float, wind: tuple[float, float] = (0, 0)
    ) -> None:
        self.fdm, self.controls, self.start, self.step, self.wind = fdm, controls, start, step, wind
        self.engines = int(fdm.get_propulsion().get_num_engines())
        self.setting = TrimPoint()
        fill_empty_tanks(fdm)
        self._flying = [fdm[name] for name in _INTEGRATORS]
        for name in _INTEGRATORS:
            fdm[name] = 0

    def release(self) -> None:
        """Lets the aircraft fly."""
        for name, value in zip(_INTEGRATORS, self._flying, strict=True):
            self.fdm[name] = value

    def command(self) -> None:
        """Gives the commands of the setting."""
        controls, setting, fdm = self.controls, self.setting, self.fdm
        fdm[controls.elevator] = setting.elevator
        fdm[controls.aileron] = setting.aileron
        fdm[controls.rudder] = setting.rudder
        for throttle in controls.throttles:
            fdm[throttle] = setting.throttle

    def place(self, sideslip: float = 0.0, rates: Sequence[float] = (0.0, 0.0, 0.0), faster: float = 0.0) -> None:
        """Places the aircraft with the attitude of the setting, this sideslip and these rates beyond level flight's."""
        fdm = self.fdm
        place(fdm, replace(self.start, airspeed=self.start.airspeed + faster), self.wind)
        fdm["ic/phi-rad"] = self.setting.bank
        fdm["ic/theta-rad"] = self.setting.pitch
        fdm["ic/psi-true-rad"] = self.start.heading - self.setting.sideslip - sideslip
        for axis, rate in zip("pqr", rates, strict=True):
            fdm[f"ic/{axis}-rad_sec"] = fdm[f"ic/{axis}-rad_sec"] * (axis == "q") + rate
        for name in _CLEAN:
            fdm[name] = 0.0
        fdm.run_ic()

    def run(self, seconds: float) -> None:
        """Lets time go on."""
        for _ in range(max(1, round(seconds / self.step))):
            self.fdm.run()

    @property
    def accelerations(self) -> Array:
        """(u', v', w', p', q', r') in m/s^2 and rad/s^2, as they are now. Raises `NotFiniteError`."""
        values = _UNITS * [self.fdm[name] for name in _ACCELERATIONS]
        if not np.isfinite(values).all():
            raise NotFiniteError("a number of the simulated aircraft is not finite")
        return values

    @property
    def thrust(self) -> float:
        """Forward thrust of all engines, N."""
        return POUND * self.fdm["forces/fbx-prop-lbs"]

    def settled(self, least: float = 0.2, longest: float = 30.0, tolerance: float = 3e-5) -> Array:
        """The accelerations once they rest; a heavy propeller takes its time. Raises `NotFiniteError`."""
        last, time = self.accelerations + math.inf, 0.0
        while True:
            self.run(least)
            time += least
            now = self.accelerations
            if np.abs(now - last).max() < tolerance or time >= longest:
                return now
            last = now

    def at(self, sideslip: float = 0.0, rates: Sequence[float] = (0.0, 0.0, 0.0), faster: float = 0.0) -> Array:
        """The accelerations in the setting, with these deviations from steady flight."""
        self.command()
        self.place(sideslip, rates, faster)
        return self.settled()

    def approached(self) -> Array:
        """The accelerations in the setting, with the surfaces approached from one side.

        So hysteresis in the controls gives one answer.
        """
        with self.changed(elevator=_ASIDE, aileron=_ASIDE, rudder=_ASIDE):
            self.command()
            self.run(_ASIDE_FOR)
        return self.at()

    @contextmanager
    def changed(self, **change: float) -> Iterator[None]:
        """The setting, changed by so much within a `with` statement."""
        before = self.setting
        self.setting = before._replace(**{name: getattr(before, name) + by for name, by in change.items()})
        try:
            yield
        finally:
            self.setting = before

    @property
    def is_refuelled(self) -> bool:
        """Whether it flies by a rocket: that burns fuel that flows, and its tanks are refilled for a constant mass."""
        return not unknown(self.fdm, ["propulsion/engine/oxi-flow-rate-pps"])

    def start_engines(self) -> None:
        """Starts all engines, by the cockpit and by JSBSim's own short cut: either alone fails on some models."""
        fdm = self.fdm
        self.command()
        self.place()
        fdm["propulsion/fuel_freeze"] = 1
        for i in range(self.engines):
            fdm[f"fcs/mixture-cmd-norm[{i}]"] = 0.9
            fdm[f"fcs/advance-cmd-norm[{i}]"] = 1.0
            fdm[f"propulsion/engine[{i}]/set-running"] = 1
        fdm["propulsion/magneto_cmd"] = 3
        fdm["propulsion/cutoff_cmd"] = 0
        fdm.get_propulsion().init_running(-1)
        self._crank()
        if standing := [i for i in range(self.engines) if not fdm[f"propulsion/engine[{i}]/set-running"]]:
            fdm["propulsion/fuel_freeze"] = 0  # some engines start only when fuel flows
            for i in standing:
                fdm[f"propulsion/engine[{i}]/set-running"] = 1
            self._crank()
            fdm["propulsion/fuel_freeze"] = 1
        if self.is_refuelled:
            fdm["propulsion/fuel_freeze"] = 0
            fdm["propulsion/refuel"] = 1
            self.run(1.0)

    def _crank(self) -> None:
        self.fdm["propulsion/starter_cmd"] = 1
        self.run(_STARTER)
        self.fdm["propulsion/starter_cmd"] = 0
        self.run(1.0)

    def solve(self, unknowns: Sequence[str], rows: Sequence[int], rounds: int = 12, tolerance: float = 5e-4) -> Array:
        """Changes these unknowns of the setting until these accelerations vanish; returns what is left of them.

        The method of Levenberg and Marquardt, on accelerations that have settled.
        """
        nudges = np.array([getattr(_NUDGE, name) for name in unknowns])
        farthest = np.array([getattr(_FARTHEST, name) for name in unknowns])
        weight, now = 1e-4, self.approached()[list(rows)]
        for _ in range(rounds):
            if np.abs(now).max() < tolerance:
                break
            slopes = np.column_stack([self._slope(name, now, rows) for name in unknowns]) * nudges
            damping = np.diag(np.linalg.norm(slopes, axis=0) + 1e-9)
            before = self.setting
            for _ in range(5):
                system = np.vstack([slopes, math.sqrt(weight) * damping])
                aim = np.concatenate([now, np.zeros(len(unknowns))])
                change = -np.linalg.lstsq(system, aim, rcond=None)[0] * nudges
                change /= max(1.0, float((np.abs(change) / farthest).max()))
                moved = {name: getattr(before, name) + by for name, by in zip(unknowns, change.tolist(), strict=True)}
                self.setting = before._replace(
                    **{name: min(max(v, getattr(_LEAST, name)), getattr(_RANGE, name)) for name, v in moved.items()}
                )
                new = self.approached()[list(rows)]
                if np.linalg.norm(new) < np.linalg.norm(now):
                    now, weight = new, max(weight / 10.0, 1e-6)
                    break
                self.setting, weight = before, 10.0 * weight
            else:
                break
        return now

    def _slope(self, name: str, now: Array, rows: Sequence[int]) -> Array:
        nudge: float = getattr(_NUDGE, name)
        if getattr(self.setting, name) + nudge > getattr(_RANGE, name):
            nudge = -nudge
        with self.changed(**{name: nudge}):
            return (self.approached()[list(rows)] - now) / nudge

    def level(self) -> Array:
        """Solves for flight that goes straight: with the rudder, or with sideslip where the rudder does nothing."""
        return self.solve(("bank", "aileron", self._yaws()), (1, 3, 5), 8, 2e-3)

    def trim(self) -> float:
        """Finds steady level flight from a setting near it; returns the largest acceleration that is left."""
        unknowns = ("pitch", "elevator", "throttle", "bank", "aileron", self._yaws())
        return float(np.abs(self.solve(unknowns, range(6))).max())

    def _yaws(self) -> str:
        slope = float(self._slope("rudder", self.approached()[[5]], [5])[0])
        return "rudder" if abs(slope) > _NO_RUDDER else "sideslip"
