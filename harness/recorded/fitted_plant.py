"""The aircraft of a recorded flight, for the plants `lagged` and `coordinated`: a file that stands for an airframe."""

import math
from types import MappingProxyType

import numpy as np

from harness.plants.coordinated import AirspeedHold
from harness.plants.identified import Identified, table_of
from harness.plants.turn import GRAVITY
from harness.recorded.assessment import Assessment, averaged
from harness.recorded.following import BANK, HEADING_RATE, SAMPLES_IN_LAG, Commanded
from harness.recorded.recorded_flight import Array, Basis, LogError
from harness.recorded.response_fit import GAIN, ResponseFit

SUREST = 0.4  # largest half-width of the lag's interval over the lag, for which the response is identified
HELD = AirspeedHold(gain=0.0, frequency=1.0, damping=1.0)  # constant airspeed: its change is not fitted
# Where autopilots keep the largest bank that they command: the parameter, and its unit, rad.
BANK_LIMITS = {
    "ROLL_LIMIT_DEG": math.radians(1.0),
    "LIM_ROLL_CD": math.radians(0.01),
    "FW_R_LIM": math.radians(1.0),
}


def identified(found: Assessment) -> Identified:
    """The identified response for the plants. Raises `LogError` with the reason if the log does not excite it enough.

    The heading rate has the response to its own command, or that of the bank, whichever lag has the narrower interval.
    """
    fits: dict[Commanded, ResponseFit] = {}
    refusals: list[str] = []
    for of, fit in ((BANK, found.bank), (HEADING_RATE, found.heading_rate)):
        if fit is None:
            refused = found[of.lag.title].reason
        elif not (refused := _unsure(fit, of)):
            fits[of] = fit
            continue
        if of.command in found.flight:
            refusals.append(refused)
    if not fits:
        reason = refusals[0] if refusals else "it has neither a bank command nor a heading rate command"
        raise LogError(f"no aircraft can be fitted to this log: {reason}")
    fit = min(fits.values(), key=_doubt)
    (low, high), gain = fit.lag_interval(), fit.sample(GAIN).interval() or (math.nan, math.nan)
    return Identified(
        airspeed=float(f"{np.median(_airspeeds(found)):.3g}"),
        heading_rate=fit.response,
        bank=fits[BANK].response if BANK in fits else None,
        hold=HELD,
        bank_limit=_bank_limit(found),
        measured=MappingProxyType(
            {"gain": fit.gain, "gain_low": gain[0], "gain_high": gain[1], "lag_s": fit.lag, "lag_low_s": low,
             "lag_high_s": high, "explained": fit.explained}
        ),
        errors=MappingProxyType({}),
    )  # fmt: skip


def _unsure(fit: ResponseFit, of: Commanded) -> str:
    """Why the response is not identified; empty if it is."""
    if fit.interval * SAMPLES_IN_LAG > fit.lag:
        return (
            f"too few samples for the dynamics: the {of.flown} has {1.0 / fit.interval:.2g} new values a second, "
            f"{SAMPLES_IN_LAG / fit.lag:.2g} are needed for a lag of {fit.lag:.2g} s"
        )
    low, high = fit.lag_interval()
    if not (fit.lag > 0.0 and _doubt(fit) <= SUREST):
        return f"not excited enough: the lag is {fit.lag:.2g} s, anything from {low:.2g} to {high:.2g} s fits"
    return ""


def _doubt(fit: ResponseFit) -> float:
    """Half of the lag's interval over the lag."""
    low, high = fit.lag_interval()
    return 0.5 * (high - low) / fit.lag


def document(found: Assessment) -> str:
    """The text of the file. Raises `LogError`."""
    one, speeds = identified(found), _airspeeds(found)
    of_receipt = ["# The lag includes the latency of the telemetry: it is an upper bound."]
    lines = [
        f"# Written by `harness assess --fit` from {found.flight.name}, {found.begin:.1f} to {found.end:.1f} s:",
        "# the response for the plants lagged and coordinated. SI, rad.",
        *(of_receipt if found.flight.of_receipt else []),
        "",
        "[limits] # as flown",
        f"slowest = {min(speeds.min(), one.airspeed):.3g}",
        f"design_airspeed = {one.airspeed:g}",
        f"fastest = {max(speeds.max(), one.airspeed):.3g}",
        f"bank = {one.bank_limit:.4g}",
        "",
        *table_of(one, "in the recorded flight, with the ends of 95 % intervals"),
    ]
    return "\n".join(lines) + "\n"


def _airspeeds(found: Assessment) -> Array:
    """True airspeeds, m/s, as means over a second."""
    flight = found.flight
    if not flight.has("airspeed") or flight["airspeed"].basis is not Basis.MEASURED:
        raise LogError("no aircraft can be fitted to this log: it has no measured airspeed")
    scale = found.wind.scale[0] if found.wind and found.wind.scale else 1.0
    return scale * averaged(flight["airspeed"], 1.0)[1]


def _bank_limit(found: Assessment) -> float:
    """The largest bank that the autopilot commands: by its parameters, else the largest commanded or flown."""
    for name, unit in BANK_LIMITS.items():
        if (value := found.flight.parameters.get(name, 0.0)) > 0.0:
            return value * unit
    for name in ("bank_command", "bank"):
        if name in found.flight:
            return float(np.abs(found.flight[name].values).max())
    fastest = float(np.abs(found.flight["heading_rate_command"].values).max())
    return math.atan(fastest * float(np.median(_airspeeds(found))) / GRAVITY)
