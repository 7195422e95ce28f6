"""An airframe without its inner loop, replayed: what it does with given commands of its surfaces, in given air."""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from harness.plants.model import FT, load, node, write

Array = NDArray[np.float64]


class Moment(NamedTuple):
    """Where an aircraft that is replayed begins. SI, rad; the velocity is over the ground."""

    altitude: float
    bank: float
    pitch: float
    yaw: float
    velocity_north: float
    velocity_east: float
    velocity_down: float
    roll_rate: float
    pitch_rate: float
    yaw_rate: float


_BEGUN_AT = (
    ("ic/h-sl-ft", FT), ("ic/phi-rad", 1.0), ("ic/theta-rad", 1.0), ("ic/psi-true-rad", 1.0), ("ic/vn-fps", FT),
    ("ic/ve-fps", FT), ("ic/vd-fps", FT), ("ic/p-rad_sec", 1.0), ("ic/q-rad_sec", 1.0), ("ic/r-rad_sec", 1.0),
)  # fmt: skip
SURFACES = ("aileron", "elevator", "rudder", "throttle")  # what is commanded when an aircraft is replayed
_SET = (
    *(("inner-loop/" + name, 1.0) for name in ("aileron-rad", "elevator-rad", "rudder-rad", "throttle-norm")),
    *((f"atmosphere/gust-{axis}-fps", FT) for axis in ("north", "east", "down")),
)
REPLAYED = (
    "bank", "pitch", "yaw", "roll_rate", "pitch_rate", "yaw_rate", "angle_of_attack", "sideslip", "airspeed",
)  # fmt: skip
_SEEN = (
    "attitude/phi-rad", "attitude/theta-rad", "attitude/psi-rad", "velocities/p-rad_sec", "velocities/q-rad_sec",
    "velocities/r-rad_sec", "aero/alpha-rad", "aero/beta-rad", "velocities/vt-fps",
)  # fmt: skip


def replay(airframe: Path, step: float, begin: Moment, commands: Array) -> Array:
    """What the aircraft does with these commands of its surfaces, without its inner loop. Raises `ModelError`.

    `commands`: a row for each step and one for the beginning, `SURFACES` and then the air's velocity to the north, east
    and down. Gives as many rows of `REPLAYED`. SI, rad; NaN from where a number is not finite.
    """
    fdm = load(airframe, step)  # anew: filters and actuators remember an earlier flight
    write(fdm, "inner-loop/engaged", 0.0)
    write(fdm, "inner-loop/trim/elevator-rad", 0.0)  # commands of the elevator are deviations from it
    write(fdm, "actuators/engaged", 1.0)
    write(fdm, "ic/lat-geod-rad", 0.0)
    write(fdm, "ic/long-gc-rad", 0.0)
    for (name, unit), value in zip(_BEGUN_AT, begin, strict=True):
        write(fdm, name, value / unit)
    setters = [node(fdm, name).set_double_value for name, _ in _SET]
    readers = [node(fdm, name).get_double_value for name in _SEEN]
    rows = (commands / [unit for _, unit in _SET]).tolist()
    seen: Array = np.full((len(rows), len(_SEEN)), math.nan)
    for i, row in enumerate(rows):
        for put, value in zip(setters, row, strict=True):
            put(value)
        if i:
            fdm.run()
        else:
            fdm.run_ic()
        seen[i] = [get() for get in readers]
        if not np.isfinite(seen[i]).all():
            seen[i] = math.nan
            break
    seen[:, -1] *= FT
    return seen
