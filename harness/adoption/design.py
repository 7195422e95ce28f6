"""The gains of an adopted model's inner loop, from its derivatives by one rule for all, from a light biplane to a jet.

The bank loop is placed with a damping ratio of 0.8 and the requested bandwidth, as far as aileron, its hysteresis and
its actuator allow; then with less bandwidth, down to 0.4 of that, until every mode of the linear loop is damped enough.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from harness.adoption.linear import Eigenvalues, Linear, eigenvalues_of, oscillation
from harness.adoption.refusal import RefusalError
from harness.plants.turn import GRAVITY

Array = NDArray[np.float64]

ZETA = 0.8
LEAST_DAMPING = 0.28
_GROWING = 0.02  # 1/s: slower divergence is stabilised by guidance
_AILERON, _RUDDER = 0.95, 0.8  # shares of the travel left by the trim: limits of the inner loop
_IN_TURN = 0.8  # largest share of these limits in a steady turn
_LEAST_BANK, _SIDESLIP = math.radians(10.0), math.radians(4.0)  # rad: least bank and largest sideslip of a turn
_STEP = math.radians(45.0)  # rad: step of the bank that may use the whole aileron
_WOBBLE = math.radians(1.0)  # rad: largest oscillation of the bank by hysteresis
ADOPTED_GAINS = (  # beside those of the inner loop itself
    "aileron-in-turn", "aileron-from-sideslip", "bank-i", "bank-model-per-s",
    "rudder-in-turn", "rudder-from-roll-rate", "sideslip-i", "sideslip-limit",
)  # fmt: skip
_NO_RUDDER = 1e-3  # rad/s^2 over the whole travel: a rudder with less effect counts as none
_P, _Q, _R, _W, _U = 3, 4, 5, 2, 0


@dataclass(frozen=True, slots=True)
class LoopDesign:
    """The tables `gain` and `limit` of the inner loop, `adopted` of what connects it, and what they deliver."""

    gain: Mapping[str, float]
    limit: Mapping[str, float]
    adopted: Mapping[str, float]
    bandwidth: float  # rad/s, of the bank loop
    limited_by: str
    damping: float  # of the least damped mode of the linear loop
    max_bank: float  # rad: the requested bank, or the largest that rudder and aileron can coordinate

    @property
    def lag(self) -> float:
        """Lag of the bank behind its command, s."""
        return 2.0 * ZETA / self.bandwidth


def designed(linear: Linear, trim: Mapping[str, float], stall: float, max_bank: float, wanted: float) -> LoopDesign:
    """The design for this aircraft; `wanted` in rad/s, angles in rad. Raises `RefusalError` where no loop is stable."""
    fastest, limited_by = _fastest(linear, trim, wanted)
    share, lateral, damping = _damped(linear, fastest)
    if share < 1.0:
        limited_by = f"damping of the yawing oscillation ({damping:.2f}), at {share * fastest:.2g} rad/s"
    max_bank = _steepest(linear, trim, max_bank)
    for share_of_pitch in np.geomspace(1.0, 0.3, 8).tolist():
        pitching = _pitching(linear, trim, stall, max_bank, share_of_pitch)
        eigenvalues = eigenvalues_of(_closed_pitching(linear, pitching))
        if oscillation(eigenvalues)[1] >= LEAST_DAMPING and eigenvalues.real.max() < _GROWING:
            break
    else:
        if eigenvalues.real.max() > 0.05:
            raise RefusalError("design", f"pitch and altitude cannot be held: {eigenvalues.real.max():.2g} 1/s grows")
    bandwidth = share * fastest
    gain = {
        "rate-trim-per-s": 0.2 * bandwidth / (2.0 * ZETA),
        "rate-trim-model-per-s": 1.0 / _turn_lag(linear, lateral, bandwidth),
        **lateral.gain,
        **pitching,
        **_speed(linear),
        "throttle-in-turn": _throttle_in_turn(linear),
    }
    room = 1.0 - abs(trim["aileron"])
    limit = {
        "bank-rad": max_bank,
        "aileron-rad": _AILERON * room,
        "rudder-rad": _RUDDER * (1.0 - abs(trim["rudder"])),
        "elevator-rad": 0.95 * (1.0 - abs(trim["elevator"])),
        "climb-mps": 0.06 * linear.airspeed,
        "angle-of-attack-rad": max(0.9 * stall, linear.pitch + math.radians(2.0)),
    }
    return LoopDesign(
        gain,
        limit,
        lateral.adopted,
        bandwidth,
        limited_by,
        damping,
        max_bank,
    )


def _fastest(linear: Linear, trim: Mapping[str, float], wanted: float) -> tuple[float, str]:
    """The bandwidth of the bank loop, rad/s, before the linear loop is checked, and what limits it."""
    b = abs(float(linear.aileron.effect[_P]))
    if b < 1e-3:
        raise RefusalError("design", f"the aileron rolls the aircraft by {b:.2g} rad/s^2 only: use --controls")
    by_aileron = 0.6 * math.sqrt(b * (1.0 - abs(trim["aileron"])) / _STEP)
    by_hysteresis = math.sqrt(b * linear.aileron.hysteresis / 2.0 / _WOBBLE)
    by_lag = 0.5 / linear.aileron.lag if linear.aileron.lag > 0.0 else math.inf
    choices = [
        (wanted, "what was wanted"),
        (max(by_aileron, by_hysteresis), f"the aileron's power ({b:.3g} rad/s^2)"),
        (by_lag, f"the aileron's lag ({linear.aileron.lag:.2g} s)"),
    ]
    return min(choices)


def _steepest(linear: Linear, trim: Mapping[str, float], max_bank: float) -> float:
    """The steepest turn, rad, up to this one, that aileron and rudder hold to both sides with little sideslip.

    Raises `RefusalError` where there is none.
    """
    rows = [_P, _R]
    surfaces = np.column_stack([linear.aileron.effect[rows], linear.rudder.effect[rows]])
    if abs(linear.rudder.effect[_R]) < _NO_RUDDER:
        return max_bank
    most = _IN_TURN * np.array([_AILERON * (1.0 - abs(trim["aileron"])), _RUDDER * (1.0 - abs(trim["rudder"]))])
    sideslip = np.outer(np.linspace(-_SIDESLIP, _SIDESLIP, 9), linear.beta[rows])

    def is_held(bank: float, side: float) -> bool:
        turning = GRAVITY / linear.airspeed * math.sin(bank)
        moments = turning * (side * linear.yawing[rows] + math.tan(bank) * linear.pitching[rows]) + sideslip
        return bool((most >= np.abs(np.linalg.solve(surfaces, moments.T)).T).all(axis=1).any())

    banks = np.linspace(max_bank, min(max_bank, _LEAST_BANK), 60).tolist()
    for bank in banks:
        if is_held(bank, 1.0) and is_held(bank, -1.0):
            return float(bank)
    raise RefusalError("design", f"aileron and rudder do not hold a turn of {math.degrees(banks[-1]):.0f} deg")


@dataclass(frozen=True, slots=True)
class _Lateral:
    gain: Mapping[str, float]
    adopted: Mapping[str, float]


def _lateral(linear: Linear, omega: float) -> _Lateral:
    a, b = -float(linear.rolling[_P]), float(linear.aileron.effect[_P])
    a = max(a, 0.0)
    if a > 2.0 * ZETA * omega:
        kp, kd = omega * a / (2.0 * ZETA * b), 0.0
    else:
        kp, kd = omega**2 / b, (2.0 * ZETA * omega - a) / b
    N_da, N_dr = float(linear.aileron.effect[_R]), float(linear.rudder.effect[_R])
    N_r, N_b = float(linear.yawing[_R]), float(linear.beta[_R])
    L_r, N_p = float(linear.yawing[_P]), float(linear.rolling[_R])
    rudder = {"rudder-from-aileron": 0.0, "rudder-from-yaw-rate": 0.0, "rudder-from-sideslip": 0.0}
    adopted = {
        "aileron-in-turn": _within(-L_r / b, 3.0),
        "aileron-from-sideslip": _within(-float(linear.beta[_P]) / b, 4.0),  # the dihedral would hold the bank back
        "rudder-in-turn": 0.0,
        "rudder-from-roll-rate": 0.0,
        "bank-i": 0.15 * omega * kp,
        "bank-model-per-s": omega / ZETA,
        "sideslip-i": 0.0,
        "sideslip-limit": 0.3,
    }
    if abs(N_dr) > _NO_RUDDER:
        A, _ = linear.lateral()
        frequency, damping = oscillation(eigenvalues_of(A))
        rudder["rudder-from-aileron"] = _within(-N_da / N_dr, 0.6)
        rudder["rudder-from-yaw-rate"] = -math.copysign(max(0.0, 2.0 * frequency * (0.5 - damping)) / abs(N_dr), N_dr)
        if N_b < 0.5:  # directionally weak or unstable: the rudder is the fin
            rudder["rudder-from-sideslip"] = (1.0 - N_b) / N_dr
        adopted["rudder-in-turn"] = _within(-N_r / N_dr, 5.0)
        # In a turn's entry the yaw rate grows by g/V of the roll rate; without the rudder the nose stays behind.
        adopted["rudder-from-roll-rate"] = _within((GRAVITY / linear.airspeed - N_p) / N_dr, 1.0)
        adopted["sideslip-i"] = 0.25 * max(N_b, 1.0 if N_b < 0.5 else 0.0) / N_dr
    return _Lateral({"bank-p": kp, "bank-i": 0.0, "roll-rate": kd, **rudder}, adopted)


def _damped(linear: Linear, fastest: float) -> tuple[float, _Lateral, float]:
    """The share of the bandwidth that leaves enough damping, or the most there is; gains and damping with it."""
    tried = []
    for share in np.geomspace(1.0, 0.4, 8).tolist():
        lateral = _lateral(linear, share * fastest)
        eigenvalues = eigenvalues_of(_closed_lateral(linear, lateral))
        if eigenvalues.real.max() < _GROWING:
            tried.append((share, lateral, oscillation(eigenvalues)[1]))
    if not tried:
        raise RefusalError("design", _why_unstable(linear, eigenvalues))
    enough = min(LEAST_DAMPING, max(damping for *_, damping in tried) - 0.03)  # slower would be no better
    return next(each for each in tried if each[-1] >= enough)


def _within(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)


def _closed_lateral(linear: Linear, gains: _Lateral) -> Array:
    """States: sideslip, roll rate, yaw rate, bank, aileron, rudder, integrals of bank and of sideslip."""
    A, B = linear.lateral()
    g, turn = gains.gain, GRAVITY / linear.airspeed
    closed = np.zeros((8, 8))
    closed[:4, :4], closed[:4, 4:6] = A, B
    aileron = np.zeros(8)
    aileron[[1, 3]] = -g["roll-rate"], -g["bank-p"]
    rudder = g["rudder-from-aileron"] * aileron
    aileron[0] = gains.adopted["aileron-from-sideslip"]
    aileron[6] = -gains.adopted["bank-i"]
    rudder[0] += g["rudder-from-sideslip"]
    rudder[1] += gains.adopted["rudder-from-roll-rate"]
    rudder[2] += g["rudder-from-yaw-rate"]
    rudder[3] -= g["rudder-from-yaw-rate"] * turn
    aileron[3] += gains.adopted["aileron-in-turn"] * turn
    rudder[3] += gains.adopted["rudder-in-turn"] * turn
    rudder[7] += gains.adopted["sideslip-i"]
    for row, law, lag in ((4, aileron, linear.aileron.lag), (5, rudder, linear.rudder.lag)):
        rate = 1.0 / max(lag, 0.01)
        closed[row] = rate * law
        closed[row, row] -= rate
    closed[6, 3], closed[7, 0] = 1.0, 1.0
    return closed


def _turn_lag(linear: Linear, gains: _Lateral, bandwidth: float) -> float:
    """Lag of the yaw rate behind the bank command, s: the mean delay, which limits the rate trim.

    At a large angle of attack the nose goes ahead of the course while the aircraft rolls in, and the lag is short.
    """
    bank_lag, g = 2.0 * ZETA / bandwidth, gains.gain
    closed = _closed_lateral(linear, gains)
    model = gains.adopted["bank-model-per-s"]
    A, B, C = np.zeros((10, 10)), np.zeros(10), np.zeros(10)
    A[:8, :8] = closed
    A[6] = 0.0
    A[6, [3, 9]] = 1.0, -1.0  # the integral of what the bank is beyond its model
    A[8, 8], A[9, [8, 9]], B[8] = -model, (model, -model), model
    aileron_rate, rudder_rate = (1.0 / max(surface.lag, 0.01) for surface in (linear.aileron, linear.rudder))
    B[4] = aileron_rate * g["bank-p"]
    B[5] = rudder_rate * g["rudder-from-aileron"] * g["bank-p"]
    if not gains.adopted["sideslip-i"]:
        A[7, 7] = -1.0
    C[2] = 1.0
    once = np.linalg.solve(A, B)
    lag = -float(C @ np.linalg.solve(A, once)) / float(C @ once)
    return min(max(lag, 0.2 * bank_lag), 2.0 * bank_lag)


def _why_unstable(linear: Linear, eigenvalues: Eigenvalues) -> str:
    N_b, N_dr = float(linear.beta[_R]), float(linear.rudder.effect[_R])
    if N_b < 0.0:
        return f"directionally unstable (N_beta {N_b:.2g} 1/s^2) and the rudder ({N_dr:.2g} 1/s^2) cannot hold it"
    return f"no bank loop is stable: {eigenvalues.real.max():.2g} 1/s grows at {abs(eigenvalues.imag).max():.2g} rad/s"


def _pitching(
    linear: Linear, trim: Mapping[str, float], stall: float, max_bank: float, share: float
) -> dict[str, float]:
    A, B = linear.short_period()
    M_d = float(B[1])
    if abs(M_d) < 1e-3:
        raise RefusalError("design", f"the elevator pitches the aircraft by {M_d:.2g} rad/s^2 only: use --controls")
    stiffness, damping = float(np.linalg.det(A)), -float(np.trace(A))
    k = share * max(1.0, stiffness)
    omega = math.sqrt(max(stiffness, 0.0) + k)
    if linear.elevator.lag > 0.0:
        omega = min(omega, max(0.7 / linear.elevator.lag, math.sqrt(max(stiffness, 0.0) + 0.3)))
        k = omega**2 - max(stiffness, 0.0)
    k_q = max(0.0, 2.0 * 0.7 * omega - damping)
    k *= max(1.0, damping / (2.0 * 0.7 * omega))  # what is damped more moves more slowly
    heave = max(-float(A[0, 0]), 0.2)
    climb = 1.2
    path = min(heave * (1.0 + climb), 0.4 * omega)
    climb = max(path / heave - 1.0, 0.5)
    altitude = 0.25 * heave * (1.0 + climb) * climb / (1.0 + climb)
    turn = _in_turn(linear)
    bank = 0.8 * max_bank
    load = 1.0 / math.cos(bank)
    pitch = (linear.pitch + turn[0] * (load - 1.0)) * math.cos(bank) - linear.pitch
    return {
        "altitude-per-s": altitude,
        "climb-i-per-s2": 0.1 * altitude**2,
        "climb-to-pitch": climb / linear.airspeed,
        "pitch-p": -k / M_d,
        "pitch-rate": -k_q / M_d,
        "pitch-in-turn": pitch / (load - 1.0),
        "elevator-in-turn": turn[1],
    }


def _in_turn(linear: Linear) -> tuple[float, float]:
    """(angle of attack, rad, and elevator) per unit of load factor beyond one, at once with the turn's pitch rate."""
    rows = [_W, _Q]
    system = np.column_stack([linear.alpha[rows], linear.elevator.effect[rows]])
    pitch_rate = 1.9 * GRAVITY / linear.airspeed  # per unit of load factor: (g/V) (n - 1/n), near n = 1.1
    lift = np.array([-GRAVITY * math.cos(linear.pitch), -float(linear.pitching[_Q]) * pitch_rate])
    alpha, elevator = np.linalg.solve(system, lift)
    return float(alpha), float(elevator)


def _closed_pitching(linear: Linear, g: Mapping[str, float]) -> Array:
    """States: angle of attack, pitch rate, pitch, altitude, elevator, integral of the altitude."""
    A, B = linear.short_period()
    V = linear.airspeed
    closed = np.zeros((6, 6))
    closed[:2, :2], closed[:2, 4] = A, B
    closed[2, 1] = 1.0
    closed[3, 0], closed[3, 2] = -V, V
    climb = np.array([V, 0, -V, -g["altitude-per-s"], 0, -g["climb-i-per-s2"]])  # commanded less flown
    law = -g["pitch-p"] * g["climb-to-pitch"] * climb
    law[1] += g["pitch-rate"]
    law[2] += g["pitch-p"]
    rate = 1.0 / max(linear.elevator.lag, 0.01)
    closed[4] = rate * law
    closed[4, 4] -= rate
    closed[5, 3] = 1.0
    return closed


def _speed(linear: Linear) -> dict[str, float]:
    push = linear.along(linear.throttle.effect)
    if push < 1e-3:
        raise RefusalError("design", f"the throttle accelerates the aircraft by {push:.2g} m/s^2 only: use --controls")
    omega = min(0.2, 0.25 / linear.throttle.lag) if linear.throttle.lag > 0.0 else 0.2
    return {"airspeed-p": 2.0 * omega / push, "airspeed-i": omega**2 / push}


def _throttle_in_turn(linear: Linear) -> float:
    alpha, elevator = _in_turn(linear)
    rise = linear.along(linear.alpha) - GRAVITY  # without the lift that tilts forward with the body
    drag = rise * alpha + linear.along(linear.elevator.effect) * elevator
    return min(max(-drag / linear.along(linear.throttle.effect), 0.0), 2.0)
