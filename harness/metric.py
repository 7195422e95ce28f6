"""The numbers a flight is judged by, each from the log alone. None where the plant has no such thing."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from harness.log import FlightLog
from harness.plants.turn import rate_of_turn

Array = NDArray[np.float64]

MEANING: Mapping[str, str] = MappingProxyType(
    {
        "convergence_time_s": "first time after which |range error| stays below the tolerance, 5 s of it at least",
        "range_error_final_m": "at the end",
        "range_error_rms_m": "over the last half",
        "range_error_peak_m": "largest, over the last half",
        "overshoot_m": "largest range error of the opposite sign after the first crossing",
        "saturation_fraction": "share of the last half with the command at its limit",
        "command_activity_deg_s2": "total variation of the command per second, last half",
        "heading_rate_error_rms_deg_s": "flown minus commanded, both averaged over 0.25 s (-3 dB at 1.8 Hz)",
        "heading_rate_lag_s": "delay at which the flown rate matches the commanded one best",
        "heading_rate_gain": "flown over commanded, at that delay",
        "turn_ratio": "flown over g tan(bank) / V",
        "sideslip_rms_deg": "over the flight",
        "sideslip_peak_deg": "largest",
        "bank_peak_deg": "largest",
        "lateral_acceleration_rms_mps2": "specific force along the wing; none in a coordinated turn",
        "airspeed_deviation_rms_mps": "from the nominal airspeed",
        "altitude_deviation_peak_m": "largest, from the commanded altitude",
    }
)

SETTLED_FOR = 5.0  # s
AVERAGED_OVER = 0.25  # s
LONGEST_LAG = 2.0  # s
LEAST_EXCITATION = np.radians(0.5)  # rad/s: a command, or a turn, that varies less tells nothing of lag or ratio
LEAST_EXPLAINED = 0.5  # share of the flown rate's variation: a command that explains less tells nothing of the lag


def metrics(log: FlightLog) -> dict[str, float | None]:
    """All metrics of a flight, by the names of `MEANING`. Units by suffix. None of them when it has no row."""
    if not len(log):
        return dict.fromkeys(MEANING)
    period = log.flight.guidance_period
    time, error, command = log["time"], log["range_error"], log["heading_rate_command"]
    half = len(log) // 2
    lasted = max(time[-1] - time[half], period)
    flown = np.diff(np.unwrap(log["heading"])) / period  # mean rate while each command was held
    held = command[:-1]
    lag, gain = _lag_and_gain(held, flown, period)
    unlimited = log["unlimited_command"][half:]
    return {
        "convergence_time_s": settling_time(time, error, log.flight.metrics.tolerance),
        "range_error_final_m": float(error[-1]),
        "range_error_rms_m": _rms(error[half:]),
        "range_error_peak_m": _peak(error[half:]),
        "overshoot_m": _overshoot(error),
        "saturation_fraction": float(np.mean(np.abs(command[half:]) < np.abs(unlimited))),
        "command_activity_deg_s2": float(np.degrees(np.abs(np.diff(command[half:])).sum() / lasted)),
        "heading_rate_error_rms_deg_s": _degrees(_rms(_averaged(flown - held, AVERAGED_OVER / period))),
        "heading_rate_lag_s": lag,
        "heading_rate_gain": gain,
        "turn_ratio": _turn_ratio(log),
        "sideslip_rms_deg": _degrees(_rms(log["sideslip"])),
        "sideslip_peak_deg": _degrees(_peak(log["sideslip"])),
        "bank_peak_deg": _degrees(_peak(log["bank"])),
        "lateral_acceleration_rms_mps2": _rms(log["lateral_acceleration"]),
        "airspeed_deviation_rms_mps": _rms(log["airspeed"] - log.flight.start.airspeed),
        "altitude_deviation_peak_m": _peak(log["altitude"] - log.flight.start.altitude),
    }


def settling_time(time: Array, error: Array, tolerance: float) -> float | None:
    """When |error| is below the tolerance for good, with 5 s at least left; None when that is never."""
    outside = np.flatnonzero(~(np.abs(error) < tolerance))
    first = outside[-1] + 1 if outside.size else 0
    if first >= len(time) or time[-1] - time[first] < SETTLED_FOR:
        return None
    return float(time[first])


def _overshoot(error: Array) -> float | None:
    """None when the error never changes sign: there was nothing to overshoot."""
    crossed = np.flatnonzero(error * error[0] < 0)
    return float(np.abs(error[crossed]).max()) if crossed.size else None


def _lag_and_gain(command: Array, flown: Array, period: float) -> tuple[float | None, float | None]:
    """The delay at which the command explains most of the flown rate's variation, and the ratio there.

    Both by least squares, and exact for a pure delay: over a period, a held command delayed by a share of a period is
    a mix of two neighbours. A slow command tells the ratio, not the delay: it has to change by `LEAST_EXCITATION`
    within `AVERAGED_OVER`; nor does one tell it that gusts outweigh.
    """
    longest = min(round(LONGEST_LAG / period), len(command) // 2)
    if longest < 1 or np.std(command) < LEAST_EXCITATION:
        return None, None
    y = flown[longest:]  # what was commanded before the flight is not known
    explained, share = _mixes(command, y, longest)
    n = int(np.argmax(explained))
    u, later = (command[longest - k : len(command) - k] for k in (n, n + 1))
    mixed = (1.0 - share[n]) * u + share[n] * later
    gain = float(mixed @ y) / max(float(mixed @ mixed), 1e-300)
    apart = max(1, round(AVERAGED_OVER / period))
    is_quick = np.std(command[apart:] - command[:-apart]) >= LEAST_EXCITATION
    is_told = is_quick and explained[n] >= LEAST_EXPLAINED * len(y) * np.var(y)
    return float((n + share[n]) * period) if is_told else None, gain


def _mixes(command: Array, y: Array, longest: int) -> tuple[Array, Array]:
    """What of y the command, late by n samples, explains when mixed best with the next delay; the share of the next.

    n is below `longest`.

    Sums of squares about the means; neither is taken negatively.
    """
    c, size = command - command.mean(), len(y)  # so that the running sums lose no digits
    y = y - y.mean()
    begin = longest - np.arange(longest + 1)  # of each window
    total = _sums(c, begin, size)
    square = np.maximum(_sums(c * c, begin, size) - total * total / size, 1e-20 * (c @ c))  # less is rounding
    uu, ll = square[:-1], square[1:]
    ul = _sums(c[1:] * c[:-1], begin[1:], size) - total[:-1] * total[1:] / size
    products = np.correlate(c, y, "valid")[begin]
    uy, ly = products[:-1], products[1:]
    det = uu * ll - ul * ul
    both = det > 1e-12 * uu * ll
    a, b = ((v / np.where(both, det, 1.0)) for v in (uy * ll - ly * ul, ly * uu - uy * ul))
    both &= (a >= 0.0) & (b >= 0.0) & (a + b > 0.0)
    first, second = (np.maximum(v, 0.0) ** 2 / w for v, w in ((uy, uu), (ly, ll)))  # of one alone
    explained = np.where(both, a * uy + b * ly, np.maximum(first, second))
    return explained, np.where(both, b / np.where(both, a + b, 1.0), second > first)


def _sums(x: Array, begin: NDArray[np.intp], size: int) -> Array:
    """The sum of x over each window."""
    running: Array = np.concatenate([[0.0], np.cumsum(x)])
    return running[begin + size] - running[begin]


def _turn_ratio(log: FlightLog) -> float | None:
    bank = log["bank"]
    if np.isnan(bank).all():  # the plant has none
        return None
    coordinated = rate_of_turn(log["airspeed"], bank)
    if (_rms(coordinated) or 0.0) < LEAST_EXCITATION:
        return None
    return float(coordinated @ log["heading_rate"] / (coordinated @ coordinated))


def _averaged(x: Array, samples: float) -> Array:
    """A centred moving average: it delays nothing."""
    window = np.ones(max(1, round(samples)))
    return np.convolve(x, window / window.size, mode="valid") if len(x) >= window.size else x


def _rms(x: Array) -> float | None:
    return float(np.sqrt(np.mean(x * x))) if len(x) and np.isfinite(x).all() else None


def _peak(x: Array) -> float | None:
    return float(np.abs(x).max()) if len(x) and np.isfinite(x).all() else None


def _degrees(x: float | None) -> float | None:
    return None if x is None else float(np.degrees(x))
