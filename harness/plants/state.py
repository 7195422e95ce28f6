"""What a plant shows of the aircraft at one moment."""

import math
from typing import NamedTuple

NAN = math.nan


class State(NamedTuple):
    """The aircraft at one moment. SI, rad; NED from the flight's origin; NaN where a plant has no such thing.

    `heading` is psi_a: of an airframe the direction of (ground velocity - steady wind); of a plant that gusts carry at
    once the psi_a of Eq. (1), while laws are shown what they would measure (`observe`). `yaw` is the nose.
    Aileron positive rolls right, elevator positive pitches down, rudder positive yaws left. Sideslip is positive with
    the wind from the right.
    """

    north: float
    east: float
    velocity_north: float  # over the ground
    velocity_east: float
    airspeed: float
    heading: float
    heading_rate: float
    bank: float  # the fields so far, and the next, are what a law may know of its own aircraft
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
    lateral_acceleration: float = NAN  # specific force along the body's y axis: what a coordinated turn keeps at zero
    load_factor: float = NAN
    aileron: float = NAN
    elevator: float = NAN
    rudder: float = NAN
    throttle: float = NAN
    wind_north: float = 0.0  # of the air at the aircraft, gusts included
    wind_east: float = 0.0
    wind_down: float = 0.0
