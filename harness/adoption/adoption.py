"""The state of an adoption, and the files of an adopted aircraft."""

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

import aircraft
from harness.adoption.design import ADOPTED_GAINS, LoopDesign
from harness.adoption.linear import COMMANDS, Linear, eigenvalues_of, oscillation
from harness.adoption.manoeuvres import Circled, Turned
from harness.adoption.model import Original, with_inner_loop
from harness.files import write_text
from harness.plants.identified import Identified, document
from harness.plants.plant import Start
from harness.plants.wind_tunnel import Controls, TrimPoint

STEP = 0.005  # s: simulation step
STANDARD = Controls("fcs/elevator-cmd-norm", "fcs/aileron-cmd-norm", "fcs/rudder-cmd-norm", ("fcs/throttle-cmd-norm",))
_NO_GAINS = dict.fromkeys(ADOPTED_GAINS, 0.0)
_TEMPLATE = "inner_loop.xml.jinja"


@dataclass(frozen=True, slots=True, kw_only=True)
class Wish:
    """The user's options of an adoption. SI, rad; an airspeed of None is found."""

    airspeed: float | None = None
    altitude: float = 1000.0
    max_bank: float = math.radians(35.0)
    bandwidth: float | None = None  # rad/s, target of the bank loop; None: the highest that the aircraft allows
    controls: Mapping[str, Any] | None = None  # names of properties


@dataclass(frozen=True, slots=True, kw_only=True)
class Adoption:
    """The results of the stages so far. SI, rad."""

    name: str
    wish: Wish
    folder: Path
    names: frozenset[str]  # of all properties in the model
    writers: Mapping[str, str]  # of a property: the component of the model that writes it
    controls: Controls = STANDARD
    invented: tuple[str, ...] = ()
    told: tuple[tuple[str, str], ...] = ()  # properties of FlightGear, each with that of JSBSim that it follows
    mass: float = 1.0
    area: float = 1.0
    span: float = 1.0
    chord: float = 1.0
    speeds: tuple[float, ...] = ()  # at which a trim is still to be sought; without any, at that of the start
    start: Start = Start(heading=0.0)
    setting: TrimPoint = TrimPoint()
    stall: float = 0.3
    linear: Linear | None = None
    gains: LoopDesign | None = None
    engine: str = ""
    law: Mapping[str, float] | None = None  # standoff, limit and gains of the paper's law that suit the aircraft
    flown: Mapping[str, Turned | Circled] = field(default_factory=dict)  # by what was flown
    identified: Identified | None = None

    @property
    def worst_errors(self) -> tuple[float, float]:
        """The largest errors of the plants lagged and coordinated, rms over the command's; NaN when not identified."""
        errors = self.identified.errors.values() if self.identified else [(math.nan, math.nan)]
        return max(lagged for lagged, _ in errors), max(coordinated for _, coordinated in errors)


def write(adoption: Adoption, model: Original) -> None:
    """Writes the files that a flight of the model needs, as far as they are known. Raises OSError."""
    folder, gains = adoption.folder, adoption.gains
    tables: dict[str, Mapping[str, float]] = {
        "gain": gains.gain if gains else {},
        "limit": gains.limit if gains else {"bank-rad": adoption.wish.max_bank},
        "adopted": gains.adopted if gains else _NO_GAINS,
    }
    rounded = {title: {k: float(f"{v:.5g}") for k, v in table.items()} for title, table in tables.items()}
    template = Environment(
        loader=FileSystemLoader(Path(__file__).parent), undefined=StrictUndefined, keep_trailing_newline=True
    ).get_template(_TEMPLATE)
    inner_loop = template.render(rounded, controls=adoption.controls, invented=adoption.invented, told=adoption.told)
    write_text(aircraft.model(folder), with_inner_loop(model, inner_loop))
    write_text(folder / "inner_loop.toml", _inner_loop(rounded))
    write_text(folder / "airframe.toml", "\n".join(_airframe(adoption, model)) + "\n")
    if adoption.law:
        write_text(folder / "circle.toml", _circle(adoption))
    if adoption.identified:
        write_text(aircraft.identified(folder), document(folder, [adoption.identified]))


def _inner_loop(tables: Mapping[str, Mapping[str, float]]) -> str:
    lines = ["# Written by `harness adopt`: the gains of the inner loop. Surfaces are the model's normalised commands."]
    for title, values in tables.items():
        lines += ["", f"[{title}]", *(f"{name} = {{ v = {value!r} }}" for name, value in values.items())]
    return "\n".join(lines) + "\n"


def _v(value: float, unit: str = "") -> str:
    told = f', u = "{unit}"' if unit else ""
    return f"{{ v = {value:.6g}{told} }}"


def _airframe(a: Adoption, model: Original) -> Iterator[str]:
    V = a.start.airspeed
    quoted = json.dumps
    yield "# Written by `harness adopt` from a JSBSim model: what it found there. SI, rad; commands are normalised."
    yield from ("[meta]", f"name = {quoted(a.name)}", f"long_name = {quoted(a.name)}")
    yield from ('layout = "adopted JSBSim model"', "has_rudder = true")
    yield from ("", "[mass]", f"m = {_v(a.mass, 'kg')}")
    yield from ("", "[ref]", f"S = {_v(a.area, 'm^2')}", f"b = {_v(a.span, 'm')}", f"c = {_v(a.chord, 'm')}")
    yield from ("", "[envelope]", f"V_min = {_v(0.8 * V, 'm/s')}")
    yield from (f"V_design = {_v(V, 'm/s')}", f"V_max = {_v(1.2 * V, 'm/s')}")
    yield from ("", "[aero]", f"alpha_stall = {_v(a.stall, 'rad')}")
    yield from ("", "[adopted]", f"step = {STEP}", f"altitude = {a.start.altitude!r}", f"engine = {quoted(a.engine)}")
    yield f"invented = {quoted(list(a.invented))}"
    yield f"told = {quoted([name for name, _ in a.told])}"
    yield f"left_out = {quoted([text.rpartition('/')[2] for text in model.fenced.left_out])}"
    yield from ("", "[adopted.sources] # their hashes", *_sources(model))
    yield from ("", "[adopted.controls]", f"elevator = {quoted(a.controls.elevator)}")
    yield from (f"aileron = {quoted(a.controls.aileron)}", f"rudder = {quoted(a.controls.rudder)}")
    yield f"throttle = {quoted(list(a.controls.throttles))}"
    yield from ("", "[adopted.trim]", *(f"{k} = {x:.6g}" for k, x in a.setting._asdict().items()))
    if a.gains:
        loop = {"bandwidth": a.gains.bandwidth, "lag": a.gains.lag, "damping": a.gains.damping}
        yield from ("", "[adopted.loop]", *(f"{k} = {x:.4g}" for k, x in loop.items()))
    for name, flight in a.flown.items():
        yield from ("", f"[adopted.flown.{name}]", *(f"{k} = {x:.4g}" for k, x in asdict(flight).items()))
    if a.identified:
        errors = dict(zip(("lagged_error", "coordinated_error"), a.worst_errors, strict=True))
        follows = {**a.identified.measured, **errors}
        yield from ("", "[adopted.follows] # its command", *(f"{k} = {x:.4g}" for k, x in follows.items()))
    if a.linear:
        yield from ("", "[adopted.motion]", *(f"{k} = {_finite(x)}" for k, x in motion(a.linear).items()))
        yield from ("", "[adopted.derivatives] # of u', v', w', p', q', r'", *_derivatives(a.linear))


def _sources(model: Original) -> Iterator[str]:
    for path, digest in model.fenced.sources.items():
        yield f"{json.dumps(Path(path).name)} = {json.dumps(digest)}"


def _derivatives(linear: Linear) -> Iterator[str]:
    for name in ("alpha", "beta", "rolling", "pitching", "yawing", "faster"):
        yield f"{name} = [{', '.join(f'{v:.4g}' for v in getattr(linear, name))}]"
    for name in COMMANDS:
        yield f"{name} = [{', '.join(f'{v:.4g}' for v in getattr(linear, name).effect)}]"
    yield from ("", "[adopted.growing] # what a command of 1, 3 and 8 times the size does about its axis, per command")
    for name in COMMANDS:
        yield f"{name} = [{', '.join(f'{v:.4g}' for v in getattr(linear, name).growing)}]"


def _finite(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else str(value)


def motion(linear: Linear) -> dict[str, float]:
    """The modes of the aircraft without its inner loop, and its surfaces' lags. SI."""
    dutch, dutch_damping = oscillation(eigenvalues_of(linear.lateral()[0]))
    period, period_damping = oscillation(eigenvalues_of(linear.short_period()[0]))
    return {
        "roll_time": linear.roll_time, "dutch_roll": dutch, "dutch_roll_damping": dutch_damping,
        "short_period": period, "short_period_damping": period_damping,
        "aileron_effect": float(linear.aileron.effect[3]), "aileron_hysteresis": linear.aileron.hysteresis,
        **{f"{name}_lag": getattr(linear, name).lag for name in COMMANDS},
    }  # fmt: skip


def _circle(a: Adoption) -> str:
    law = a.law or {}
    R, V = law["standoff_m"], a.start.airspeed
    gains = "\n".join(f"{name} = {law[name]:.3g}" for name in ("k1", "k2", "k3"))
    return f"""\
title = "A circle that suits {a.name}"
question = "Does the paper's law, its gains scaled to the aircraft, hold its circle?"

[flight]
plant = "sixdof"
aircraft = "."
duration_s = {2.5 * 2.0 * math.pi * R / V:.0f}.0
guidance_period_s = 0.05
step_s = {STEP}

[flight.law]
name = "nftsm"
standoff_m = {R:g}
max_heading_rate_deg_s = {law["max_heading_rate_deg_s"]:.3g}
{gains}

[flight.start]
position_m = [{-1.5 * R:.5g}, {0.3 * R:.5g}]
heading_deg = 0.0
airspeed_mps = {V:.6g}
altitude_m = {a.start.altitude:g}

[flight.target]
position_m = [0.0, 0.0]

[flight.metrics]
tolerance_m = {0.01 * R:.3g}
"""
