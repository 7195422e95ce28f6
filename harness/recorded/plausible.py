"""Whether the numbers of a recorded flight can be what they are said to be: degrees for radians, g for m/s²."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from harness.recorded.recorded_flight import QUANTITIES, Array, Basis, Channel, LogError, RecordedFlight

# What an aircraft that flies reaches at most; of a few values a log may say anything.
MOST: Mapping[str, float] = MappingProxyType(
    {
        "bank": np.pi, "pitch": np.pi / 2, "bank_command": np.pi, "pitch_command": np.pi / 2, "roll_rate": 15.0,
        "pitch_rate": 15.0, "yaw_rate": 15.0, "angle_of_attack": np.pi, "sideslip": np.pi, "aileron": 1.6,
        "elevator": 1.6, "rudder": 1.6, "heading_rate_command": 2.0,
    }
)  # fmt: skip
_FASTEST_TURN = 6.0  # rad/s: largest plausible rate of a direction
_SHARE = 90.0  # percentile of a signal that is compared with its plausible range
_SAID = "looks like degrees; the map gives its unit"
_DEGREES = 180.0 / np.pi
_BETWEEN = (0.3 * _DEGREES, 3.0 * _DEGREES)  # ratios that indicate degrees instead of radians
_SPAN = 0.4  # s: length of the spans in which angle and rate are compared
_FEWEST = 8  # least number of spans
_SHORTEST = 1e-6  # s: shortest time between two values; a shorter one is damaged
_ALIKE = 0.7  # least correlation of an angle with its rate for a comparison of units
_PAIRS = (("bank", "roll_rate"), ("pitch", "pitch_rate"))


def plausible(flight: RecordedFlight) -> RecordedFlight:
    """The flight, with what is odd as problems. Raises `LogError` for units that cannot be: a line for each channel."""
    wrong = [*_too_large(flight), *_against_rates(flight), *_gravity(flight)]
    if wrong:
        raise LogError("\n".join(dict.fromkeys(wrong)))
    return _without_echoes(flight)


def _too_large(flight: RecordedFlight) -> Iterator[str]:
    for name, channel in flight.channels.items():
        if name in MOST and len(channel) > 3:
            size = float(np.percentile(np.abs(channel.values), _SHARE))
            if size > 1.1 * MOST[name]:
                yield f"{channel.source}: {name} reaches {size:.3g} {QUANTITIES[name].unit}: {_SAID}"
        if name in ("yaw", "course") and len(channel) > 3:
            apart = np.maximum(np.diff(channel.time), _SHORTEST)
            pace = float(np.percentile(np.abs(np.diff(channel.values) / apart), _SHARE))
            if pace > _FASTEST_TURN and np.ptp(channel.values) > 2.0 * np.pi:
                yield f"{channel.source}: {name} turns at {pace:.3g} rad/s: {_SAID}"


def _against_rates(flight: RecordedFlight) -> Iterator[str]:
    """Problems of angles that change about 57 times as much, or as little, as the integral of their rates."""
    for angle, rate in _PAIRS:
        if not flight.has(angle, rate):
            continue
        turned, told = _turned(flight[angle], flight[rate])
        if len(turned) < _FEWEST or np.std(told) == 0.0 or np.std(turned) == 0.0:
            continue
        ratio = float(np.std(turned) / np.std(told))
        if np.corrcoef(turned, told)[0, 1] < _ALIKE:
            continue
        if _BETWEEN[0] < ratio < _BETWEEN[1]:
            yield (
                f"{flight[angle].source}: {angle} changes {ratio:.0f} times as much as the integral of {rate}: "
                f"{angle} looks like degrees, or {rate} was radians already"
            )
        elif _BETWEEN[0] < 1.0 / ratio < _BETWEEN[1]:
            yield (
                f"{flight[rate].source}: {rate} is {1.0 / ratio:.0f} times the derivative of {angle}: "
                f"{rate} looks like degrees, or {angle} was radians already"
            )


def _turned(angle: Channel, rate: Channel) -> tuple[Array, Array]:
    """The changes of the angle in spans of `_SPAN`, and the integrals of the rate over them; rad."""
    time = np.arange(max(angle.time[0], rate.time[0]), min(angle.time[-1], rate.time[-1]), _SPAN)
    total = np.append(0.0, np.cumsum(0.5 * np.diff(rate.time) * (rate.values[1:] + rate.values[:-1])))
    turned, told = np.diff(angle.at(time)), np.diff(np.interp(time, rate.time, total))
    known = np.isfinite(turned)
    return turned[known], told[known]


def _gravity(flight: RecordedFlight) -> Iterator[str]:
    name = "vertical_acceleration"
    if name in flight and len(flight[name]) > 3:
        usual, source = float(np.median(flight[name].values)), flight[name].source
        if 0.5 < abs(usual) < 2.0:
            yield f"{source}: {name} is {usual:.2g} m/s2 (median): looks like g; give its unit in the map"
        elif usual > 5.0:
            yield f"{source}: {name} is {usual:.3g} m/s2 (median): points up; it must be negative in level flight"


def _without_echoes(flight: RecordedFlight) -> RecordedFlight:
    """The flight without commands that repeat the flown values, as autopilots log them in manual mode."""
    channels, problems = dict(flight.channels), list(flight.problems)
    for name, channel in flight.channels.items():
        flown = flight.channels.get(name.removesuffix("_command")) if name.endswith("_command") else None
        if flown is not None and channel.basis is Basis.COMMANDED and len(channel) > 3:
            same = np.isin(channel.values, flown.values).mean()
            if same > 0.95 and np.ptp(channel.values) > 0.0:
                del channels[name]
                problems.append(f"{channel.source}: {name} repeats the flown values: it is no command, and left out")
    return replace(flight, channels=channels, problems=tuple(problems))
