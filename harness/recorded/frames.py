"""Frames of vectors in logs: axes to north-east-down and forward-right-down, bodies to the earth, quaternions."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from harness.recorded.recorded_flight import Array, Basis, RecordedFlight, sampled

# For each frame, where its axes stand among north, east and down (or forward, right and down), and their signs.
AXES: Mapping[str, tuple[tuple[int, float], tuple[int, float], tuple[int, float]]] = MappingProxyType(
    {
        "ned": ((0, 1.0), (1, 1.0), (2, 1.0)),
        "enu": ((1, 1.0), (0, 1.0), (2, -1.0)),
        "nwu": ((0, 1.0), (1, -1.0), (2, -1.0)),
        "frd": ((0, 1.0), (1, 1.0), (2, 1.0)),
        "flu": ((0, 1.0), (1, -1.0), (2, -1.0)),
    }
)
EARTH = ("ned", "enu", "nwu")
BODY = ("frd", "flu")


def bank_pitch_yaw(w: Array, x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
    """The Euler angles of a quaternion that turns forward-right-down into north-east-down, rad."""
    bank = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return bank, pitch, yaw


def to_earth(u: Array, v: Array, w: Array, bank: Array, pitch: Array, yaw: Array) -> tuple[Array, Array, Array]:
    """A vector along the body's axes as north, east and down."""
    ahead = u * np.cos(pitch) + (v * np.sin(bank) + w * np.cos(bank)) * np.sin(pitch)
    aside = v * np.cos(bank) - w * np.sin(bank)
    down = -u * np.sin(pitch) + (v * np.sin(bank) + w * np.cos(bank)) * np.cos(pitch)
    return ahead * np.cos(yaw) - aside * np.sin(yaw), ahead * np.sin(yaw) + aside * np.cos(yaw), down


def with_derived(flight: RecordedFlight) -> RecordedFlight:
    """The flight with its velocity to the north, east and down, where it has that along the body's axes."""
    body, attitude = ("velocity_forward", "velocity_right", "velocity_below"), ("bank", "pitch", "yaw")
    if flight.has(*body, *attitude) and "velocity_north" not in flight:
        time = flight[body[0]].time
        values = to_earth(*flight.table((*body, *attitude), time).T)
        for name, value in zip(("velocity_north", "velocity_east", "velocity_down"), values, strict=True):
            channel = sampled(time, value, Basis.DERIVED, "velocity in the body's axes, and attitude")
            if len(channel):
                flight = flight.with_channel(name, channel)
    return flight
