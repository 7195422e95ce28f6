"""A JSBSim model, loaded and checked. The only file that imports JSBSim; it and those that use it know feet."""

import math
import os
import re
from collections.abc import Iterable
from copy import deepcopy
from pathlib import Path
from tempfile import TemporaryDirectory
from xml.etree import ElementTree

import jsbsim

import aircraft
import autopilot
from harness.fence import FenceError, checked
from harness.flight_errors import Errors
from harness.plants.plant import PlantError, Start
from harness.world.air import Vector

FT = 0.3048  # m
SLUG = 4.4482216152605 / FT  # kg
RADIUS = 6371000.0  # m, as in planet.xml
_SI = {"ft": FT, "fps": FT, "sqft": FT**2, "slugs": SLUG, "slugs_ft2": SLUG * FT**2}

_PLANTS = Path(__file__).parent
_INNER_LOOP = Path(autopilot.__file__).parent
_LOOP = "inner_loop"  # as a model names it
_PROPERTY = re.compile(r"(?<![\w/])[a-z][\w-]*(?:/[\w-]+)+")
_MOST_TANKS = 100
_MOST_FUEL = 1e9  # lb: JSBSim takes what the tank holds
_EMPTY = 1.0  # %
_AB2 = 3  # JSBSim's number for the second-order Adams-Bashforth integrator

Fdm = jsbsim.FGFDMExec
_NO_ERRORS = Errors()


class _LoadLog(jsbsim.FGLogger):
    """Keeps JSBSim's messages of level WARN and above: the only sign in Python of a model that was read in part."""

    def __init__(self) -> None:
        self.problems: list[str] = []
        self._text = ""

    def message(self, message: str) -> None:
        self._text += message

    def flush(self) -> None:
        if jsbsim.LogLevel.WARN <= self.log_level <= jsbsim.LogLevel.FATAL:
            self.problems.append(" ".join(self._text.split()))
        self._text = ""


_load_log = _LoadLog()
jsbsim.set_logger(_load_log)
jsbsim.FGJSBBase().debug_lvl = 0


class ModelError(PlantError):
    """JSBSim cannot load the airframe's model, or the model lacks a property."""

    def __init__(self, message: str) -> None:
        super().__init__("aircraft", message)


def parsed(model: Path) -> ElementTree.Element:
    """The root of a model, which reads no other file but the inner loop and writes none. Raises `ModelError`.

    What a model includes would be in no flight's key.
    """
    try:
        root = checked(model, systems=(_LOOP,))
    except FenceError as error:
        raise ModelError(str(error)) from None
    for loop in (model.with_name(f"{_LOOP}.xml"), model.parent / "Systems" / f"{_LOOP}.xml"):
        if os.path.lexists(loop):
            raise ModelError(f"{loop}: JSBSim would read it instead of the inner loop of the harness: move it away")
    return root


def _properties(model: ElementTree.Element) -> list[str]:
    """The names of all properties that the model and its inner loop read."""
    roots = (model, ElementTree.parse(_INNER_LOOP / f"{_LOOP}.xml").getroot())
    texts = (text for root in roots for text in root.itertext())
    return sorted({name for text in texts for name in _PROPERTY.findall(text)})


def load(airframe: Path, step: float, errors: Errors = _NO_ERRORS) -> Fdm:
    """A new JSBSim with this airframe and its inner loop, stepping by `step` seconds. Raises `ModelError`.

    Errors of the aircraft are in a copy of its model: JSBSim cannot set mass or lags of a loaded one.
    """
    airframe = airframe.absolute()  # JSBSim takes a relative folder to be one of its own
    is_foreign = aircraft.adopted(airframe) is not None
    if not errors.of_aircraft:
        return _load(airframe, step, is_foreign)
    if is_foreign:
        raise ModelError(f"{airframe.name} is an adopted model: errors of the aircraft are for the harness's own")
    with TemporaryDirectory(prefix="harness-") as folder:
        copy = Path(folder) / airframe.name
        copy.mkdir()
        model = deepcopy(parsed(aircraft.model(airframe)))
        _alter(model, errors)
        ElementTree.ElementTree(model).write(aircraft.model(copy), encoding="utf-8")
        return _load(copy, step, is_foreign)


def _alter(model: ElementTree.Element, errors: Errors) -> None:
    """Puts the errors of the aircraft into its model. Raises `ModelError` for one that `make models` did not write."""

    def found(path: str) -> ElementTree.Element:
        if (element := model.find(path)) is None:
            raise ModelError(f"{model.get('name')}: no {path} in the model, for an error of the aircraft")
        return element

    def number(path: str) -> float:
        return float(found(path).text or "nan")

    found("mass_balance/emptywt").text = repr(errors.mass_scale * number("mass_balance/emptywt"))
    x = "mass_balance/location[@name='CG']/x"  # metres aft, as the chord
    found(x).text = repr(number(x) + errors.cg_aft * number("metrics/chord"))
    if not errors.actuator_lag:
        return
    channel = found("flight_control/channel")
    for i, surface in enumerate(("elevator", "aileron", "rudder")):
        before, late = f"inner-loop/{surface}-rad", f"actuators/late-{surface}-rad"
        commanded = [element for element in channel.iter("input") if (element.text or "").strip() == before]
        if commanded:
            lag = ElementTree.Element("lag_filter", name=late)
            ElementTree.SubElement(lag, "input").text = before
            ElementTree.SubElement(lag, "c1").text = repr(1.0 / errors.actuator_lag)
            channel.insert(i, lag)
        for element in commanded:
            element.text = late


def _load(airframe: Path, step: float, is_foreign: bool) -> Fdm:
    """A foreign model's warnings are its own, and its properties were seen to when it was adopted."""
    model = parsed(aircraft.model(airframe))
    _load_log.problems.clear()
    fdm = jsbsim.FGFDMExec(None)
    fdm.set_dt(step)  # before the model: its components keep the step they were made with
    try:
        loaded = fdm.load_planet(_text(_PLANTS / "planet.xml"), False) and fdm.load_model_with_paths(
            _text(Path(airframe.name)), _text(airframe.parent), _text(airframe), _text(_INNER_LOOP), True
        )
    except RuntimeError as error:  # also what the C++ library throws besides JSBSim's own BaseError
        raise ModelError(f"{aircraft.model(airframe)}: {' '.join(str(error).split())}") from error
    if not loaded or (_load_log.problems and not is_foreign):
        raise ModelError(f"{aircraft.model(airframe)}: {'; '.join(_load_log.problems) or 'not loaded'}")
    missing = [] if is_foreign else unknown(fdm, _properties(model))
    if missing:
        for name in missing:  # JSBSim ends the whole process when it reads, or merely drops, an unknown property
            fdm[name] = 0.0
        raise ModelError(f"{aircraft.model(airframe)}: unknown properties {', '.join(missing)}")
    for integrator in ("rate", "position"):
        write(fdm, f"simulation/integrator/{integrator}/rotational", _AB2)
    return fdm


def check_body(fdm: Fdm) -> None:
    """Raises `ModelError` for a mass or a tensor of inertia that no body has: JSBSim would fly it all the same.

    JSBSim computes the inertia in `run_ic()`.
    """
    mass = SLUG * fdm["inertia/mass-slugs"]
    if not 0.0 < mass < math.inf:
        raise ModelError(f"the mass of the model is {mass:g} kg, must be above 0")
    inertia = {x: SLUG * FT**2 * fdm[f"inertia/{x}-slugs_ft2"] for x in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")}
    ixx, iyy, izz, ixy, ixz, iyz = inertia.values()
    minors = ixx, ixx * iyy - ixy**2, dot((ixx, -ixy, -ixz), cross((-ixy, iyy, -iyz), (-ixz, -iyz, izz)))
    if not all(0.0 < minor < math.inf for minor in minors):
        told = ", ".join(f"{name} {value:.3g}" for name, value in inertia.items())
        raise ModelError(
            f"no body has the moments of inertia of the model, {told} kg m²: they must be positive definite"
        )


def dot(a: Vector, b: Vector) -> float:
    """The scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """The vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def unknown(fdm: Fdm, names: Iterable[str]) -> list[str]:
    """Those of these properties that do not exist."""
    return [name for name in names if not fdm.get_property_manager().hasNode(name)]


def property_names(fdm: Fdm) -> list[str]:
    """The names of all properties that JSBSim has of its own or for the model, but for those of FlightGear."""
    return [line.partition(" ")[0] for line in fdm.query_property_catalog("").splitlines() if line]


def fill_empty_tanks(fdm: Fdm) -> bool:
    """Fills all tanks of a model whose tanks are all empty; whether it did."""
    tanks = [f"propulsion/tank[{i}]" for i in range(_MOST_TANKS)]
    tanks = [tank for tank in tanks if not unknown(fdm, [f"{tank}/contents-lbs"])]
    if not tanks or any(fdm[f"{tank}/pct-full"] > _EMPTY for tank in tanks):
        return False
    for tank in tanks:
        fdm[f"{tank}/contents-lbs"] = _MOST_FUEL
    return True


def data_root() -> Path:
    """The folder of the models that come with JSBSim."""
    return Path(jsbsim.get_default_root_dir())


def _text(path: Path) -> str:
    """The path as JSBSim takes it: text, whose bytes in UTF-8 are the name. Raises `ModelError`."""
    try:
        return os.fsencode(path).decode()
    except UnicodeDecodeError:
        raise ModelError(f"{path}: the name is not text in UTF-8, which JSBSim needs: rename the folder") from None


def write(fdm: Fdm, name: str, value: float) -> None:
    """Sets an existing property, in JSBSim's unit. `ModelError` for an unknown name, which JSBSim would create."""
    node(fdm, name).set_double_value(value)


def si(fdm: Fdm, name: str) -> float:
    """A property in SI: the suffix of its name gives the unit. rad and dimensionless numbers stay as they are."""
    return fdm[name] * _SI.get(name.rpartition("-")[2], 1.0)


def node(fdm: Fdm, name: str) -> jsbsim.FGPropertyNode:
    """A property, to be read or set many times. `ModelError` for an unknown name."""
    found = fdm.get_property_manager().get_node(name)
    if found is None:
        raise ModelError(f"the model has no property {name!r}")
    return found


def place(fdm: Fdm, start: Start, wind: tuple[float, float]) -> None:
    """Writes the initial condition in the order that JSBSim needs: attitude, wind, then velocity over the ground.

    The flight starts on the equator, where the direction of north changes least along the way.
    """
    W_x, W_y = wind
    write(fdm, "ic/lat-geod-rad", 0.0)
    write(fdm, "ic/long-gc-rad", 0.0)
    write(fdm, "ic/h-sl-ft", start.altitude / FT)
    write(fdm, "ic/phi-rad", 0.0)
    write(fdm, "ic/theta-rad", 0.0)
    write(fdm, "ic/psi-true-rad", start.heading)
    write(fdm, "ic/vw-mag-fps", math.hypot(W_x, W_y) / FT)
    write(fdm, "ic/vw-dir-deg", math.degrees(math.atan2(W_y, W_x)))
    write(fdm, "ic/vn-fps", (start.airspeed * math.cos(start.heading) + W_x) / FT)
    write(fdm, "ic/ve-fps", (start.airspeed * math.sin(start.heading) + W_y) / FT)
    write(fdm, "ic/vd-fps", 0.0)
    ahead = start.airspeed + W_x * math.cos(start.heading) + W_y * math.sin(start.heading)
    write(fdm, "ic/q-rad_sec", -ahead / RADIUS)  # level flight over a sphere pitches down with it
