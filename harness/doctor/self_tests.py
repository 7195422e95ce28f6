"""Self-tests: wind and units of the installed JSBSim, with each airframe."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import aircraft
from harness.doctor.finding import Finding, Soundness
from harness.plants.model import load, si
from harness.plants.plant import Start
from harness.plants.sixdof import SixDof, trim
from harness.world.air import Air

WIND_TOLERANCE = 1e-6  # m/s: tolerance of the wind in JSBSim
UNIT_TOLERANCE = 1e-4  # relative: JSBSim rounds its factor for kg m^2


def self_tests() -> Iterator[Finding]:
    """Flies each airframe in wind, and compares its data with what JSBSim makes of them."""
    for name in aircraft.names():
        airframe = aircraft.folder(name)
        start = Start(airspeed=aircraft.limits(airframe).design_airspeed, heading=1.0)
        error = max(wind_triangle_error(airframe, start, Air(steady=w)) for w in ((4.0, -3.0), (-5.0, 0.0), (0.0, 5.0)))
        yield Finding(
            f"wind, {name}",
            f"v_ground - v_air - wind is {error:.1e} m/s, at most {WIND_TOLERANCE:g} allowed",
            Soundness.OK if error < WIND_TOLERANCE else Soundness.BAD,
        )
        units = compare_units(airframe)
        what, error = max(((u.quantity, abs(u.jsbsim / u.data - 1.0)) for u in units), key=lambda pair: pair[1])
        yield Finding(
            f"units, {name}",
            f"{len(units)} quantities, largest error {error:.1e} in {what}, at most {UNIT_TOLERANCE:g} allowed",
            Soundness.OK if error < UNIT_TOLERANCE else Soundness.BAD,
        )


def wind_triangle_error(airframe: Path, start: Start, air: Air) -> float:
    """The largest component of v_ground - v_air - wind after 2 s of flight, m/s; v_air is JSBSim's, in body axes."""
    flying = SixDof(airframe, 0.005, True).start(start, air)
    flying.advance(0.0, 2.0)
    fdm, state = flying.fdm, flying.state
    phi, theta, psi = (fdm[f"attitude/{angle}-rad"] for angle in ("phi", "theta", "psi"))
    through_air = _body_to_ned(phi, theta, psi) @ [si(fdm, f"velocities/{axis}-aero-fps") for axis in "uvw"]
    over_ground = np.array((state.velocity_north, state.velocity_east, state.velocity_down))
    wind = (state.wind_north, state.wind_east, state.wind_down)
    return float(np.abs(over_ground - through_air - wind).max())


def _body_to_ned(phi: float, theta: float, psi: float) -> NDArray[np.float64]:
    """The direction cosine matrix C_nb of the Euler angles (Stevens & Lewis, Eq. 1.3-20, transposed)."""
    s_f, c_f, s_t, c_t, s_p, c_p = (f(x) for x in (phi, theta, psi) for f in (math.sin, math.cos))
    return np.array(
        [
            [c_t * c_p, s_f * s_t * c_p - c_f * s_p, c_f * s_t * c_p + s_f * s_p],
            [c_t * s_p, s_f * s_t * s_p + c_f * c_p, c_f * s_t * s_p - s_f * c_p],
            [-s_t, s_f * c_t, c_f * c_t],
        ]
    )


class UnitCheck(NamedTuple):
    """One quantity in SI: from the airframe's data, and from JSBSim, converted."""

    quantity: str
    data: float
    jsbsim: float


def compare_units(airframe: Path) -> list[UnitCheck]:
    """Mass, inertia, geometry, airspeed and altitude of a trimmed airframe, from its data and from JSBSim."""
    data = aircraft.data(airframe)
    mass, ref = data["mass"], data["ref"]
    fdm = load(airframe, 0.005)
    start = Start(airspeed=aircraft.limits(airframe).design_airspeed)
    trim(fdm, start, Air())
    return [
        UnitCheck(*row)
        for row in (
            ("mass kg", mass["m"]["v"], si(fdm, "inertia/mass-slugs")),
            ("Ixx kg m2", mass["Ixx"]["v"], si(fdm, "inertia/ixx-slugs_ft2")),
            ("Ixz kg m2", mass["Ixz"]["v"], -si(fdm, "inertia/ixz-slugs_ft2")),
            ("wing area m2", ref["S"]["v"], si(fdm, "metrics/Sw-sqft")),
            ("span m", ref["b"]["v"], si(fdm, "metrics/bw-ft")),
            ("chord m", ref["c"]["v"], si(fdm, "metrics/cbarw-ft")),
            ("airspeed m/s", start.airspeed, si(fdm, "velocities/vt-fps")),
            ("altitude m", start.altitude, si(fdm, "position/h-sl-ft")),
        )
    ]
