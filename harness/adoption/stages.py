"""The stages of adopting a JSBSim model: each says what it found, or raises `RefusalError`."""

import math
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from difflib import get_close_matches
from typing import Any

import numpy as np

import aircraft
from harness.adoption import cockpit
from harness.adoption.adoption import STANDARD, STEP, Adoption, motion
from harness.adoption.design import designed
from harness.adoption.linear import COMMANDS, linearised
from harness.adoption.manoeuvres import circled, law_of, turned
from harness.adoption.model import Element, faults_of_engines, integrator_after
from harness.adoption.refusal import NoSuchPropertyError, RefusalError
from harness.identification.identify import identify
from harness.plants.model import FT, SLUG, Fdm, check_body, fill_empty_tanks, load, parsed, property_names, unknown
from harness.plants.plant import End
from harness.plants.turn import GRAVITY
from harness.plants.wind_tunnel import POUND, STEADY, Controls, NotFiniteError, TrimPoint, WindTunnel
from harness.tables import counted

SPEEDS = (1.0, 1.2, 0.85, 1.5, 0.7, 2.0, 2.8)  # trim airspeeds to try, over that of the lift coefficient below
LIFT_COEFFICIENT = 0.5
_SLOWEST = 2e-4  # s: largest computing time of a step; all stages together need about 150 000
_STEPS_TIMED = 50
_THROTTLES = (0.15, 0.4, 0.65, 0.9)
_MOST = {"elevator": 0.7, "throttle": 0.93, "aileron": 0.7, "rudder": 0.7}  # largest share of a command in trim

_AXES = (
    "{:.2g} m/s^2 forwards", "{:.2g} m/s^2 sidewards", "{:.2g} m/s^2 downwards",
    "{:.2g} rad/s^2 in roll", "{:.2g} rad/s^2 in pitch", "{:.2g} rad/s^2 in yaw",
)  # fmt: skip
Found = tuple[Adoption, str]  # the adoption so far, and what a stage found, in words


def _load(a: Adoption) -> Found:
    fdm = load(a.folder, STEP)
    invented = tuple(sorted(unknown(fdm, a.names)))
    for missing in invented:
        fdm[missing] = 0.0
    for name in _names(a.wish.controls or {}):
        if unknown(fdm, [name]):
            raise NoSuchPropertyError(name, tuple(get_close_matches(name, {*property_names(fdm), *a.names})))
    told = tuple(sorted(_told(a, fdm).items()))
    engines = int(fdm.get_propulsion().get_num_engines())
    throttles = tuple(f"fcs/throttle-cmd-norm[{i}]" for i in range(max(1, engines)))
    throttles += cockpit.throttles(a.names - set(a.writers), engines)
    controls = Controls.of({**_table(replace(STANDARD, throttles=throttles)), **(a.wish.controls or {})})
    filled = ", empty tanks filled" if fill_empty_tanks(fdm) else ""
    fdm.run_ic()
    check_body(fdm)
    mass, area = SLUG * fdm["inertia/mass-slugs"], FT**2 * fdm["metrics/Sw-sqft"]
    step = _seconds_of_a_step(WindTunnel(fdm, controls, a.start, STEP))
    if step > _SLOWEST:
        raise RefusalError("load", f"a step takes {1e3 * step:.2g} ms to compute, may take {1e3 * _SLOWEST:g} ms")
    if not area > 0.0:
        raise RefusalError("load", f"the wing has an area of {area:g} m^2")
    a = replace(
        a, invented=invented, told=told, controls=controls, mass=mass, area=area, span=FT * fdm["metrics/bw-ft"],
        chord=FT * fdm["metrics/cbarw-ft"],
    )  # fmt: skip
    made = f"{len(invented)} properties invented, {len(told)} as in FlightGear"
    return a, f"{made}{filled}, {mass:.0f} kg, wing {area:.3g} m^2, {counted(engines, 'engine')}"


def _seconds_of_a_step(tunnel: WindTunnel) -> float:
    began = time.process_time()
    tunnel.run(_STEPS_TIMED * STEP)
    return (time.process_time() - began) / _STEPS_TIMED


def _told(a: Adoption, fdm: Fdm) -> dict[str, str]:
    """JSBSim's substitute for each property of FlightGear that the model reads and does not write."""
    names = {name.replace("[0]", "") for name in a.names} - set(a.writers)
    sources = {name: source for name in names if (source := cockpit.source_of(name))}
    missing = unknown(fdm, [source.lstrip("-") for source in sources.values()])
    return {name: source for name, source in sources.items() if source.lstrip("-") not in missing}


def _names(controls: Mapping[str, Any]) -> Iterator[str]:
    for value in controls.values():
        yield from [value] if isinstance(value, str) else value


def _table(controls: Controls) -> dict[str, object]:
    return {
        "elevator": controls.elevator,
        "aileron": controls.aileron,
        "rudder": controls.rudder,
        "throttle": list(controls.throttles),
    }


def _tunnel(a: Adoption) -> WindTunnel:
    """A new aircraft in the wind tunnel, its engines running."""
    tunnel = WindTunnel(load(a.folder, STEP), a.controls, a.start, STEP)
    tunnel.setting = a.setting
    tunnel.start_engines()
    return tunnel


def _engine(a: Adoption) -> Found:
    density = 1.225 * (1.0 - 2.2558e-5 * a.wish.altitude) ** 4.2559
    slow = math.sqrt(2.0 * a.mass * GRAVITY / (density * a.area * LIFT_COEFFICIENT))
    speeds = (a.wish.airspeed,) if a.wish.airspeed else tuple(slow * share for share in SPEEDS)
    a = replace(a, start=replace(a.start, airspeed=speeds[0], altitude=a.wish.altitude), speeds=speeds)
    tunnel = _tunnel(a)
    if not tunnel.engines:
        raise RefusalError("engine", "no engine: a glider cannot hold its height")
    thrusts = []
    for throttle in (0.2, 1.0):
        tunnel.setting = tunnel.setting._replace(throttle=throttle)
        tunnel.command()
        tunnel.settled()
        thrusts.append(tunnel.thrust)
    low, high = thrusts
    weight = a.mass * GRAVITY
    if high - low < 1e-3 * weight:
        much = "no" if high - low < 1e-4 * weight else "too little"
        told = f"throttle has {much} effect: thrust {low:.3g} N at 0.2 and {high:.3g} N at 1"
        causes = dict.fromkeys([*faults_of_engines(_model(a)), *_held_back(tunnel)])
        way_out = _whose(a, a.controls.throttles[0])
        raise RefusalError("engine", "; ".join([told, *causes]) if causes else f"{told}{way_out}")
    refilled = ", its tanks refilled while it burns" if tunnel.is_refuelled else ""
    told = f"{tunnel.engines} running{refilled}, thrust {low:.3g} N at throttle 0.2, {high:.3g} N at 1"
    return replace(a, engine=told), told


def _model(a: Adoption) -> Element:
    return parsed(aircraft.model(a.folder))


def _held_back(tunnel: WindTunnel) -> Iterator[str]:
    """Possible causes of missing forward thrust at full throttle."""
    fdm = tunnel.fdm
    for i in range(tunnel.engines):
        limiter, power = (f"propulsion/engine[{i}]/{name}" for name in ("ielu_intervent", "power-hp"))
        if not unknown(fdm, [limiter, power]) and fdm[limiter]:
            yield f"the torque limiter of engine {i} holds it at {fdm[power]:.3g} hp"
            break
    across = POUND * math.hypot(fdm["forces/fby-prop-lbs"], fdm["forces/fbz-prop-lbs"])
    if across > 10.0 * abs(tunnel.thrust):
        yield f"the engines push across the flight, by {across:.3g} N"


def _controls(a: Adoption) -> Found:
    """Whether each command moves the aircraft as it must; otherwise one that does, among those that there are."""
    tunnel = _tunnel(a)
    told = []
    for surface, axis in (("elevator", 4), ("aileron", 3), ("rudder", 5)):
        name = getattr(a.controls, surface)
        effect = _effect(tunnel, name, axis)
        if effect < 0.01 and surface not in (a.wish.controls or {}):
            taken = set(_names(_table(a.controls)))
            effects = {other: _effect(tunnel, other, axis) for other in _commands(a) if other not in taken}
            best = max(effects, key=lambda other: effects[other], default=name)
            if effects.get(best, 0.0) > max(0.01, effect):
                name, effect = best, effects[best]
                a = replace(a, controls=Controls.of({**_table(a.controls), surface: name}))
        if effect < 0.01 and surface != "rudder":
            raise RefusalError("controls", f"{name} moves nothing: {effect:.2g} rad/s^2{_whose(a, name)}")
        told.append(f"{surface} {effect:.2g}")
    return a, f"{', '.join(told)} rad/s^2 of the whole travel"


def _whose(a: Adoption, name: str) -> str:
    """The component of the model that makes a command do nothing, or the way out."""
    if writer := a.writers.get(name.replace("[0]", "")):
        return f"; {writer} of the model writes {name}, too"
    if integrator := integrator_after(_model(a), name):
        return f"; {integrator} of the model comes after it, as when a rate is commanded: use --controls"
    return ": use --controls"


def _commands(a: Adoption) -> list[str]:
    """Properties of the model that may command a surface."""
    return sorted(name for name in a.names if "cmd" in name and "throttle" not in name and "trim" not in name)


def _effect(tunnel: WindTunnel, name: str, axis: int) -> float:
    """The angular acceleration that 0.3 of the command's travel makes, of the whole travel."""
    tunnel.at()
    seen = []
    for value in (0.3, -0.3):
        tunnel.fdm[name] = value
        seen.append(tunnel.settled(longest=3.0)[axis])
    tunnel.fdm[name] = 0.0
    tunnel.settled(longest=3.0)
    return abs(float(seen[0] - seen[1])) / 0.6


def _trim(a: Adoption) -> Found:
    speeds, tunnel = a.speeds or (a.start.airspeed,), _tunnel(a)
    best, why = math.inf, ""
    for i, speed in enumerate(speeds, 1):
        tunnel.start = replace(a.start, airspeed=speed)
        try:
            left, reason = _trimmed(tunnel)
        except NotFiniteError as error:
            left, reason, tunnel = math.inf, str(error), _tunnel(a)
        if not reason:
            s = tunnel.setting
            sideways = f", sideslip {math.degrees(s.sideslip):.1f} deg" if s.sideslip else ""
            return replace(a, start=tunnel.start, setting=s, speeds=speeds[i:]), (
                f"{speed:.1f} m/s, pitch {math.degrees(s.pitch):.1f} deg, bank {math.degrees(s.bank):.2f} deg, "
                f"elevator {s.elevator:.2f}, aileron {s.aileron:.2f}, rudder {s.rudder:.2f}{sideways}, "
                f"throttle {s.throttle:.2f}; {left:.1e} m/s^2 or rad/s^2 is left"
            )
        if not why or left < best:
            best, why = left, f"{speed:.0f} m/s: {reason}"
    tried = f"from {min(speeds):.0f} to {max(speeds):.0f} m/s" if len(speeds) > 1 else "there"
    raise RefusalError("trim", f"no level flight {tried}; nearest at {why}")


def _trimmed(tunnel: WindTunnel) -> tuple[float, str]:
    """Trims in stages; returns the largest acceleration that is left, and why it is no trim, or nothing."""
    tunnel.setting = TrimPoint()
    tunnel.solve(("pitch", "elevator"), (2, 4), 8, 5e-3)
    pushes = []
    for throttle in _THROTTLES:
        tunnel.setting = tunnel.setting._replace(throttle=throttle)
        pushes.append(float(tunnel.at()[0]))
    if pushes[-1] > pushes[0]:
        throttle = float(np.clip(np.interp(0.0, pushes, _THROTTLES), 0.05, 0.95))
        tunnel.setting = tunnel.setting._replace(throttle=throttle)
    tunnel.solve(("pitch", "elevator", "throttle"), (0, 2, 4), 8, 2e-3)
    tunnel.level()
    left = tunnel.trim()
    if not left < STEADY:
        rest = tunnel.at()
        if rest[0] < -STEADY and tunnel.setting.throttle > _MOST["throttle"]:
            return left, f"short by {-rest[0] / GRAVITY:.2g} g at full throttle"
        return left, f"{_AXES[int(np.abs(rest).argmax())].format(left)} is left"
    for name, most in _MOST.items():
        if abs(value := getattr(tunnel.setting, name)) > most:
            return left, f"{name} {value:.2f}, at most {most:g}"
    return left, ""


def _linearise(a: Adoption) -> Found:
    tunnel = _tunnel(a)
    tunnel.at()
    a = replace(a, linear=linearised(tunnel), stall=_stall(tunnel))
    assert a.linear is not None
    m = motion(a.linear)
    lags = ", ".join(f"{name} {m[f'{name}_lag']:.2g} s" for name in COMMANDS)
    uneven = "".join(
        f"\n{name} does {', '.join(f'{effect:.2g}' for effect in getattr(a.linear, name).growing)} rad/s^2 per command "
        f"of 1, 3 and 8 times the size: something of the model stands between command and surface"
        for name in COMMANDS[:-1]
        if getattr(a.linear, name).is_uneven
    )
    return a, (
        f"roll {m['roll_time']:.3g} s, dutch roll {m['dutch_roll']:.3g} rad/s ({m['dutch_roll_damping']:.2f}), short "
        f"period {m['short_period']:.3g} rad/s ({m['short_period_damping']:.2f}), aileron {m['aileron_effect']:.3g} "
        f"rad/s^2, lags: {lags}; stall {math.degrees(a.stall):.0f} deg{uneven}"
    )


def _stall(tunnel: WindTunnel) -> float:
    """The angle of attack, rad, at which lift is greatest; 30 deg where it grows up to there."""
    setting = tunnel.setting
    alphas, lifts = [], []
    for alpha in np.arange(setting.pitch, math.radians(30.0), math.radians(1.0)).tolist():
        tunnel.setting = setting._replace(pitch=alpha)
        tunnel.command()
        tunnel.place()
        u, _, w = tunnel.accelerations[:3].tolist()
        alphas.append(alpha)
        lifts.append(u * math.sin(alpha) - w * math.cos(alpha))
        if lifts[-1] < max(lifts) - 0.5:
            break
    tunnel.setting = setting
    return float(alphas[int(np.argmax(lifts))])


def _design(a: Adoption) -> Found:
    assert a.linear is not None
    wanted = math.inf if a.wish.bandwidth is None else a.wish.bandwidth
    g = designed(a.linear, a.setting._asdict(), a.stall, a.wish.max_bank, wanted)
    law = law_of(a.start.airspeed, g.max_bank, 1.0 / g.lag)
    told = f"bank loop {g.bandwidth:.2g} rad/s, limited by {g.limited_by}; least damping {g.damping:.2f}"
    if g.max_bank < a.wish.max_bank:
        told += f"; turns of {math.degrees(g.max_bank):.0f} deg, for which aileron and rudder suffice"
    return replace(a, gains=g, law=law), told


def _turn(a: Adoption) -> Found:
    assert a.gains is not None
    t = turned(a.folder, a.start, STEP, a.gains.max_bank, a.gains.lag)
    if faults := t.faults(a.start.airspeed):
        raise RefusalError("90 deg", "; ".join(faults))
    return replace(a, flown={"turn": t}), (
        f"course within {math.degrees(t.error):.2f} deg, overshoot {math.degrees(t.overshoot):.1f} deg, course rate "
        f"{t.rate:.3f} of the command, altitude {t.altitude:.1f} m, sideslip {math.degrees(t.sideslip):.1f} deg"
    )


def _circle(a: Adoption) -> Found:
    assert a.law is not None
    c = circled(a.folder, a.start, STEP, a.law)
    if faults := c.faults(a.start.airspeed):
        raise RefusalError("circle", f"radius {a.law['standoff_m']:g} m: {'; '.join(faults)}")
    w = circled(a.folder, a.start, STEP, a.law, 0.3 * a.start.airspeed)
    return replace(a, flown={**a.flown, "circle": c, "circle_in_wind": w}), (
        f"radius {a.law['standoff_m']:g} m, error {100 * c.error:.2f} % rms over the last lap, altitude "
        f"{c.altitude:.1f} m, sideslip {math.degrees(c.sideslip):.1f} deg; in wind of 0.3 V {100 * w.error:.2f} %"
    )


def identifying(a: Adoption) -> Found:
    """How the aircraft follows its command; two lines."""
    try:
        found = identify(a.folder, aircraft.limits(a.folder).design_airspeed).identified
    except End as end:
        raise RefusalError("identify", f"a manoeuvre ended in {end.outcome}: {end}") from None
    a, m = replace(a, identified=found), found.measured
    lagged, coordinated = a.worst_errors
    return a, (
        f"lag {m['lag_s']:.3g} s, overshoot {100 * m['overshoot']:.0f} %, gain {m['gain']:.3f}, bandwidth "
        f"{m['bandwidth_rad_s']:.2g} rad/s\n"
        f"lagged is wrong by {100 * lagged:.1f} % of the command at most, coordinated by {100 * coordinated:.1f} %"
    )


STAGES: Mapping[str, Callable[[Adoption], Found]] = {
    "load": _load, "engine": _engine, "controls": _controls, "trim": _trim, "linearise": _linearise,
    "design": _design, "90 deg": _turn, "circle": _circle,
}  # fmt: skip
