"""The estimator of the target: the truth, or the paper's extended Kalman filter (Section 2.2).

A sensor gives range and azimuth; the filter's state is X = (x, x', y, y') of Eq. (4), north and east of the flight's
origin. Where the paper is silent: the filter starts from the first measurement, at `initial_velocity`; between two
measurements the estimate moves at constant velocity. Where its print must be a slip: Z_k observes X_k (Eq. (4) has
Z_k+1), and arctan(y/x) is atan2(y, x).
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, Any, Literal, NamedTuple, Protocol

import numpy as np
from annotated_types import Ge, Gt, Le
from numpy.typing import NDArray

from autopilot.angles import wrap
from autopilot.quantities import About, Metres, MetresPerSecond, OneOf, Seconds, Unit

Array = NDArray[np.float64]

SquareMetres = Annotated[float, Unit("m2", 1.0)]
SquareRadians = Annotated[float, Unit("rad2", 1.0)]  # not degrees: the paper's 0.015 rad^2, to the digit
SquareMetresPerSecond = Annotated[float, Unit("m2_s2", 1.0)]

_CLOSEST = 1e-6  # m: nearer to the sensor than this a target has no azimuth


class Measurement(NamedTuple):
    """Range, m, and azimuth, rad, clockwise from north, of the target: Z of Eq. (4); also an innovation of these."""

    range: float
    azimuth: float


class Estimate(NamedTuple):
    """The target as estimated at one moment, and the variance of each number. SI, north-east."""

    target_north: float
    target_east: float
    target_velocity_north: float
    target_velocity_east: float
    target_north_variance: float
    target_east_variance: float
    target_velocity_north_variance: float
    target_velocity_east_variance: float


class TargetFilter(Protocol):
    """The filter of one flight: `update` at every measurement, `miss` at a lost one, `ahead` in between."""

    @property
    def known(self) -> Sequence[float]:
        """What it knows since the latest measurement, in numbers of its own: all that `ahead` computes with."""
        ...

    def update(self, measured: Measurement) -> Measurement:
        """Processes the next measurement and returns its innovation; NaN for the one from which the filter starts."""
        ...

    def miss(self) -> None:
        """Moves on by a period whose measurement was lost. The first measurement never is."""
        ...

    def ahead(self, known: Sequence[Any], age: Any) -> Estimate:
        """The estimate `age` s after a measurement, lost or not, at which this was known.

        Numbers, or arrays of them, one for each of many moments; the array has the bits of each number alone.
        """
        ...


class EstimatorKind(NamedTuple):
    """The declaration of an estimator: how a law gets to know the target."""

    about: str  # its source of knowledge, in a few words
    start: "Callable[[Estimator], TargetFilter] | None" = None  # before its first measurement; None: no filter
    libraries: tuple[str, ...] = ()  # the distributions whose version decides its estimates


ESTIMATORS: Mapping[str, EstimatorKind] = MappingProxyType(
    {
        "truth": EstimatorKind("the target's own state"),
        "ekf": EstimatorKind("estimated from range and azimuth", lambda settings: ekf(settings), ("filterpy",)),
    }
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimator:
    """The settings of the estimator. Defaults are the paper's; its diag(0.5, 0.015) is in m^2 and rad^2."""

    kind: Annotated[
        str, OneOf(tuple(ESTIMATORS)), About("; ".join(f"{name}: {kind.about}" for name, kind in ESTIMATORS.items()))
    ] = "truth"
    acceleration: Annotated[
        Literal["known", "unknown"],
        About("known: kind truth provides it; unknown: the law receives 0, as always with kind ekf"),
    ] = "known"
    turn_rate: Annotated[
        Literal["known", "unknown"],
        About("known: kind truth provides it; unknown: the law receives 0, as always with kind ekf"),
    ] = "known"
    period: Annotated[Seconds, Gt(0), Le(1e3), About("measurement period, T_s")] = 0.5
    sensor_position: Annotated[tuple[Metres, Metres], About("north, east of the origin")] = (0.0, 0.0)
    range_variance: Annotated[SquareMetres, Gt(0), About("variance of the range noise, P")] = 0.5
    azimuth_variance: Annotated[SquareRadians, Gt(0), Le(10), About("variance of the azimuth noise, P")] = 0.015
    process_position_variance: Annotated[
        SquareMetres, Ge(0), About("process noise per axis and measurement period, Q")
    ] = 0.2
    process_velocity_variance: Annotated[
        SquareMetresPerSecond, Ge(0), About("process noise per axis and measurement period, Q")
    ] = 0.01
    lost_share: Annotated[float, Ge(0), Le(1), About("share of measurements lost at random; never the first")] = 0.0
    lost_from: Annotated[Seconds, Ge(0), About("time at which a gap in the measurements begins")] = 0.0
    lost_for: Annotated[Seconds, Ge(0), About("length of this gap, in which the filter predicts only")] = 0.0
    initial_position: Annotated[
        tuple[Metres, Metres] | None, About("initial estimate: north, east; default: the first measurement")
    ] = None
    initial_position_variance: Annotated[SquareMetres, Ge(0), About("per axis; used with initial_position")] = 1.0
    initial_velocity: Annotated[tuple[MetresPerSecond, MetresPerSecond], About("north, east")] = (0.0, 0.0)
    initial_velocity_variance: Annotated[
        SquareMetresPerSecond, Ge(0), About("per axis; by default (2 m/s)^2, the speed of the paper's target")
    ] = 4.0

    @property
    def filters(self) -> bool:
        """Whether the law knows the target through a sensor and a filter, rather than the truth."""
        return ESTIMATORS[self.kind].start is not None

    def start(self) -> TargetFilter:
        """The filter before its first measurement. ValueError for a kind without a filter."""
        start = ESTIMATORS[self.kind].start
        if start is None:
            raise ValueError(f"the estimator {self.kind!r} has no filter")
        return start(self)


def ekf(settings: Estimator) -> "Tracker":
    """The paper's extended Kalman filter before its first measurement."""
    from filterpy.kalman import ExtendedKalmanFilter  # imported when used: importing it takes half a second

    T_s, q, q_dot = settings.period, settings.process_position_variance, settings.process_velocity_variance
    kalman = ExtendedKalmanFilter(dim_x=4, dim_z=2)
    kalman.F = np.kron(np.eye(2), [[1.0, T_s], [0.0, 1.0]])
    kalman.Q = np.diag([q, q_dot, q, q_dot])
    kalman.R = np.diag([settings.range_variance, settings.azimuth_variance])
    return Tracker(settings, kalman)


class Tracker:
    """The extended Kalman filter of one flight."""

    def __init__(self, settings: Estimator, kalman: Any) -> None:
        self.kalman = kalman  # filterpy's, which has no types: x, P, y and mahalanobis are those of the latest update
        self.known: tuple[float, ...] = ()
        self._settings = settings

    def update(self, measured: Measurement) -> Measurement:
        """Processes the next measurement and returns its innovation; NaN for the one from which the filter starts."""
        kalman, sensor, innovation = self.kalman, self._settings.sensor_position, Measurement(math.nan, math.nan)
        begins = not self.known
        if begins:
            kalman.x, kalman.P = initial(self._settings, measured)
        else:
            kalman.predict()
        if not begins or self._settings.initial_position is not None:
            kalman.update(np.array([measured]).T, linearised, expected, args=sensor, hx_args=sensor, residual=residual)
            innovation = Measurement(*kalman.y[:, 0].tolist())
        self._keep()
        return innovation

    def miss(self) -> None:
        """Moves on by a period without a measurement, as the filter predicts: at constant velocity, ever less sure."""
        self.kalman.predict()
        self._keep()

    def _keep(self) -> None:
        P = self.kalman.P.tolist()
        self.known = (*self.kalman.x[:, 0].tolist(), P[0][0], P[0][1], P[1][1], P[2][2], P[2][3], P[3][3])

    def ahead(self, known: Sequence[Any], age: Any) -> Estimate:
        """At constant velocity, with the share of Q for that time."""
        x, x_dot, y, y_dot, P_00, P_01, P_11, P_22, P_23, P_33 = known
        s = self._settings
        share = age / s.period
        q, q_dot = share * s.process_position_variance, share * s.process_velocity_variance
        return Estimate(
            x + age * x_dot,
            y + age * y_dot,
            x_dot,
            y_dot,
            P_00 + age * (2.0 * P_01 + age * P_11) + q,
            P_22 + age * (2.0 * P_23 + age * P_33) + q,
            P_11 + q_dot,
            P_33 + q_dot,
        )


def initial(s: Estimator, measured: Measurement) -> tuple[Array, Array]:
    """X, (4, 1), and its covariance at the first measurement: as set, or from the measured position and its noise."""
    if s.initial_position is None:
        r, cos, sin = measured.range, math.cos(measured.azimuth), math.sin(measured.azimuth)
        x, y = s.sensor_position[0] + r * cos, s.sensor_position[1] + r * sin
        turned = np.array([[cos, -sin], [sin, cos]])
        position = turned @ np.diag([s.range_variance, r * r * s.azimuth_variance]) @ turned.T
    else:
        x, y = s.initial_position
        position = s.initial_position_variance * np.eye(2)
    P = s.initial_velocity_variance * np.eye(4)
    P[::2, ::2] = position
    return np.array([[x], [s.initial_velocity[0]], [y], [s.initial_velocity[1]]]), P


def measurement(x: float, y: float, x_s: float, y_s: float) -> Measurement:
    """H_t without noise: range and azimuth of a target at (x, y) from a sensor at (x_s, y_s). m, rad."""
    return Measurement(math.hypot(x - x_s, y - y_s), math.atan2(y - y_s, x - x_s))


def expected(X: Array, x_s: float, y_s: float) -> Array:
    """H_t at the state X, (4, 1), for a sensor at (x_s, y_s): a column, (2, 1)."""
    x, _, y, _ = X[:, 0].tolist()
    return np.array([measurement(x, y, x_s, y_s)]).T


def linearised(X: Array, x_s: float, y_s: float) -> Array:
    """The Jacobian of H_t at the state X, (2, 4)."""
    x, _, y, _ = X[:, 0].tolist()
    r = max(math.hypot(x - x_s, y - y_s), _CLOSEST)
    c, s = (x - x_s) / r, (y - y_s) / r
    return np.array([[c, 0.0, s, 0.0], [-s / r, 0.0, c / r, 0.0]])


def residual(z: Array, z_expected: Array) -> Array:
    """The innovation z - z_expected, (2, 1), with its azimuth wrapped: crossing south is not a full turn."""
    (r, alpha), (r_expected, alpha_expected) = z[:, 0].tolist(), z_expected[:, 0].tolist()
    return np.array([[r - r_expected], [wrap(alpha - alpha_expected)]])
