"""The aircraft about its trim: derivatives of its accelerations, lags of its surfaces, and its motions' eigenvalues."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from harness.plants.turn import GRAVITY
from harness.plants.wind_tunnel import WindTunnel

Array = NDArray[np.float64]
Eigenvalues = NDArray[np.complex128]

COMMANDS = ("elevator", "aileron", "rudder", "throttle")
_U, _V, _W, _P, _Q, _R = range(6)
_LITTLE = 1e-3  # rad/s^2 over the whole travel: a smaller effect counts as none
_ANGLE, _RATE, _SPEED, _COMMAND = math.radians(0.5), math.radians(1.0), 0.01, 0.05


class Surface(NamedTuple):
    """The effect of a command: accelerations, m/s^2 and rad/s^2; lag, s; and the dead zone of the command."""

    effect: Array
    lag: float
    hysteresis: float
    growing: tuple[float, ...]  # about its own axis, by commands of growing size

    @property
    def is_uneven(self) -> bool:
        """Whether something stands between command and surface: the effect, if any, depends on the command's size."""
        sizes = [abs(effect) for effect in self.growing]
        return max(sizes) > max(2.0 * min(sizes), _LITTLE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Linear:
    """Derivatives of (u', v', w', p', q', r') about a trim. SI, rad; surfaces in the model's normalised commands."""

    airspeed: float
    pitch: float
    alpha: Array
    beta: Array
    rolling: Array
    pitching: Array
    yawing: Array
    faster: Array
    elevator: Surface
    aileron: Surface
    rudder: Surface
    throttle: Surface

    @property
    def roll_time(self) -> float:
        """Time constant of the roll, s."""
        return -1.0 / float(self.rolling[_P]) if self.rolling[_P] < 0 else math.inf

    def lateral(self) -> tuple[Array, Array]:
        """(A, B) of the states sideslip, roll rate, yaw rate and bank, and the commands of aileron and rudder."""
        V, rows = self.airspeed, [_V, _P, _R]
        A, B = np.zeros((4, 4)), np.zeros((4, 2))
        A[:3, 0], A[:3, 1], A[:3, 2] = self.beta[rows], self.rolling[rows], self.yawing[rows]
        B[:3, 0], B[:3, 1] = self.aileron.effect[rows], self.rudder.effect[rows]
        A[0] /= V
        B[0] /= V
        A[0, 3] = GRAVITY * math.cos(self.pitch) / V
        A[3, 1], A[3, 2] = 1.0, math.tan(self.pitch)
        return A, B

    def short_period(self) -> tuple[Array, Array]:
        """(A, B) of the states angle of attack and pitch rate, and the elevator's command."""
        rows = [_W, _Q]
        scale = np.array([self.airspeed * math.cos(self.pitch), 1.0])
        A = np.column_stack([self.alpha[rows], self.pitching[rows]]) / scale[:, None]
        return A, self.elevator.effect[rows] / scale

    def along(self, accelerations: Array) -> float:
        """The part of accelerations along the path of flight, m/s^2."""
        return float(accelerations[_U] * math.cos(self.pitch) + accelerations[_W] * math.sin(self.pitch))


def eigenvalues_of(matrix: Array) -> Eigenvalues:
    """The eigenvalues, as complex numbers where all are real, too."""
    return np.asarray(np.linalg.eigvals(matrix), complex)


def oscillation(eigenvalues: Eigenvalues) -> tuple[float, float]:
    """(frequency, rad/s, and damping ratio) of the least damped oscillation; (0, 1) where there is none."""
    pairs = [(abs(s), -s.real / abs(s)) for s in eigenvalues.tolist() if s.imag > 1e-6]
    return min(pairs, key=lambda pair: pair[1], default=(0.0, 1.0))


def linearised(tunnel: WindTunnel) -> Linear:
    """Central differences about the tunnel's setting."""
    V = tunnel.start.airspeed

    def between(high: Array, low: Array, step: float) -> Array:
        return (high - low) / (2.0 * step)

    def by_rate(axis: int) -> Array:
        unit = _RATE * np.eye(3)[axis]
        return between(tunnel.at(rates=unit.tolist()), tunnel.at(rates=(-unit).tolist()), _RATE)

    def by_pitch() -> Array:
        with tunnel.changed(pitch=_ANGLE):
            high = tunnel.at()
        with tunnel.changed(pitch=-_ANGLE):
            low = tunnel.at()
        gravity = GRAVITY * np.array([-math.cos(tunnel.setting.pitch), 0.0, -math.sin(tunnel.setting.pitch), 0, 0, 0])
        return between(high, low, _ANGLE) - gravity

    faster = _SPEED * V
    linear = Linear(
        airspeed=V,
        pitch=tunnel.setting.pitch,
        alpha=by_pitch(),
        beta=between(tunnel.at(sideslip=_ANGLE), tunnel.at(sideslip=-_ANGLE), _ANGLE),
        rolling=by_rate(0),
        pitching=by_rate(1),
        yawing=by_rate(2),
        faster=between(tunnel.at(faster=faster), tunnel.at(faster=-faster), faster),
        elevator=_surface(tunnel, "elevator", _Q),
        aileron=_surface(tunnel, "aileron", _P),
        rudder=_surface(tunnel, "rudder", _R),
        throttle=_surface(tunnel, "throttle", _U),
    )
    tunnel.at()
    return linear


def _surface(tunnel: WindTunnel, name: str, axis: int) -> Surface:
    """The effect of a command, by steps of growing size, since hysteresis hides small ones."""
    room = 0.95 - abs(getattr(tunnel.setting, name)) if name != "throttle" else 0.3
    sizes = [min(size, max(room, 0.05)) for size in (_COMMAND, 3 * _COMMAND, 8 * _COMMAND)]
    slopes = []
    for size in sizes:
        with tunnel.changed(**{name: size}):
            high = tunnel.at()
        with tunnel.changed(**{name: -size}):
            low = tunnel.at()
        slopes.append((high - low) / (2.0 * size))
    growing = tuple(float(slope[axis]) for slope in slopes)
    small, large = abs(growing[0]), abs(growing[-1])
    hidden = sizes[0] * (1.0 - small / large) if large > 0 and small < 0.7 * large else 0.0
    return Surface(slopes[1] if not hidden else slopes[2], _lag(tunnel, name, axis, sizes[1]), hidden, growing)


def _lag(tunnel: WindTunnel, name: str, axis: int, size: float) -> float:
    """The time in which a step of the command has done 63 % of what it does in the end, s."""
    before = tunnel.at()[axis]
    with tunnel.changed(**{name: size if getattr(tunnel.setting, name) + size < 1.0 else -size}):
        tunnel.command()
        seen = []
        for _ in range(round((6.0 if name == "throttle" else 1.0) / tunnel.step)):
            tunnel.fdm.run()
            seen.append(tunnel.accelerations[axis])
    change = np.abs(np.array(seen) - before)
    if not change[-1] > 0.0:
        return 0.0
    return tunnel.step * float(np.argmax(change >= (1.0 - math.exp(-1.0)) * change[-1]))
