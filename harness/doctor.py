"""The self-tests of an installation: versions, wind and units on the JSBSim that is really there."""

import platform
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from typing import NamedTuple

import aircraft
from harness.air import Air
from harness.plant import Start
from harness.plants.sixdof import compare_units, wind_triangle_error

PACKAGES = ("standoff-harness", "jsbsim", "numpy", "filterpy", "pandas", "pydantic", "rerun-sdk")
WIND_TOLERANCE = 1e-6  # m/s
UNIT_TOLERANCE = 1e-4  # relative: JSBSim rounds its factor for kg m^2


class Finding(NamedTuple):
    """One thing examined."""

    what: str
    measured: str
    sound: bool


def examine() -> Iterator[Finding]:
    """Everything the doctor looks at, one by one."""
    yield Finding("python", platform.python_version(), True)
    for package in PACKAGES:
        try:
            yield Finding(package, version(package), True)
        except PackageNotFoundError:
            yield Finding(package, "not installed", False)
    for name in aircraft.names():
        airframe = aircraft.folder(name)
        start = Start(airspeed=aircraft.limits(airframe).design_airspeed, heading=1.0)
        error = max(wind_triangle_error(airframe, start, Air(steady=w)) for w in ((4.0, -3.0), (-5.0, 0.0), (0.0, 5.0)))
        yield Finding(f"wind, {name}", f"v_ground - v_air - wind: {error:.1e} m/s", error < WIND_TOLERANCE)
        units = compare_units(airframe)
        what, error = max(((u.what, abs(u.jsbsim / u.data - 1.0)) for u in units), key=lambda pair: pair[1])
        yield Finding(f"units, {name}", f"{len(units)} quantities, worst {error:.1e} ({what})", error < UNIT_TOLERANCE)
