"""The state of the aircraft that every plant gives."""

import math
from typing import NamedTuple

NAN = math.nan


class State(NamedTuple):
    """The aircraft at one moment. SI, rad; north-east-down from the flight's origin; NaN for what a plant lacks.

    `heading` is psi_a. On the plant `sixdof` it is the direction of (ground velocity - steady wind); on the others it
    is the psi_a of Eq. (1), and in gusts `harness.loop.observe` gives the law the direction that it would measure.
    `yaw` is the direction of the nose. Positive aileron rolls right, positive elevator pitches down, positive rudder
    yaws left. Sideslip is positive with the relative wind from the right.
    """

    north: float
    east: float
    velocity_north: float  # over the ground
    velocity_east: float
    airspeed: float
    heading: float
    heading_rate: float
    bank: float  # right wing down; the fields up to roll_rate are what a law may know of its own aircraft
    roll_rate: float
    altitude: float
    velocity_down: float
    pitch: float = NAN
    yaw: float = NAN
    pitch_rate: float = NAN
    yaw_rate: float = NAN  # about the body's z axis
    bank_command: float = NAN
    angle_of_attack: float = NAN
    sideslip: float = NAN
    lateral_acceleration: float = NAN  # specific force along the body's y axis: zero in a coordinated turn
    load_factor: float = NAN
    aileron: float = NAN
    elevator: float = NAN
    rudder: float = NAN
    throttle: float = NAN
    wind_north: float = 0.0  # velocity of the air at the aircraft, gusts included
    wind_east: float = 0.0
    wind_down: float = 0.0
