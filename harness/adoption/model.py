"""A JSBSim model behind the fence, the properties that it names, and its copy with an inner loop."""

import copy
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from harness.adoption.refusal import RefusalError
from harness.fence import Fenced, FenceError, fenced
from harness.plants.model import data_root

Element = ElementTree.Element

_PROSE = {"fileheader", "description", "documentation", "author", "note", "notes", "reference", "license"}
_COMPONENTS = {  # of a flight control system
    "summer", "pure_gain", "scheduled_gain", "aerosurface_scale", "lag_filter", "lead_lag_filter", "washout_filter",
    "second_order_filter", "integrator", "pid", "switch", "deadband", "fcs_function", "kinematic", "actuator", "sensor",
}  # fmt: skip
_NAME = re.compile(r"(?<![\w\]/])/?[a-zA-Z_][\w.-]*(?:\[\d+\])?(?:/[\w.-]+(?:\[\d+\])?)+")


@dataclass(frozen=True, slots=True)
class Original:
    """A model by name, with what the fence made of it."""

    name: str
    fenced: Fenced

    @property
    def root(self) -> Element:
        """The model as one tree."""
        return self.fenced.root


def source(name: str) -> Original:
    """The model in this file or folder, or of this name among those that come with JSBSim. Raises `RefusalError`."""
    path = Path(name)
    shipped = data_root() / "aircraft" / name / f"{name}.xml"
    if path.name == name and path.suffix != ".xml" and shipped.exists():  # a bare name: no folder hides JSBSim's model
        path = shipped
    if not path.exists():
        raise RefusalError("guard", f"{name} is neither a file MODEL.xml nor a model that comes with JSBSim")
    try:
        return Original(path.stem, fenced(path, data_root()))
    except FenceError as error:
        raise RefusalError("guard", str(error)) from None


def named(root: Element) -> set[str]:
    """The names of all properties in a model."""
    return set(_named(root))


def _named(element: Element) -> Iterator[str]:
    if element.tag in _PROSE:
        return
    for text in (element.text, element.get("execute"), element.get("value")):
        yield from _NAME.findall(text or "")
    for child in element:
        yield from _named(child)
        yield from _NAME.findall(child.tail or "")


def with_inner_loop(model: Original, inner_loop: str) -> str:
    """The text of the model with these systems before all that runs in it."""
    root = copy.deepcopy(model.root)
    root.set("name", model.name)
    at = next((i for i, child in enumerate(root) if child.tag in ("system", "autopilot", "flight_control")), len(root))
    for i, system in enumerate(ElementTree.fromstring(f"<systems>{inner_loop}</systems>")):
        root.insert(at + i, system)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def writers(root: Element) -> dict[str, str]:
    """The component that writes each property of the model."""
    return {
        (output.text or "").strip().replace("[0]", ""): f"<{component.tag} name={component.get('name', '')!r}>"
        for component in root.iter()
        for output in component.findall("output")
    }


def faults_of_engines(root: Element) -> Iterator[str]:
    """Why engines may push less than their model's author meant."""
    span = root.find("metrics/wingspan")
    for engine in root.iterfind("propulsion/engine"):
        propeller = engine.find("thruster//propeller")
        if propeller is None:
            continue
        if engine.find("turbine_engine") is not None:
            yield "a turbine drives a propeller: JSBSim takes its thrust in lb for a power in ft lb/s"
        width = propeller.find("diameter")
        if width is not None and span is not None and "unit" not in width.attrib and span.get("unit", "FT") == "FT":
            told, wing = _number(width), _number(span)
            if told > 0.5 * wing:
                yield f'a propeller of <diameter> {told:g} without unit="IN" has {told:g} ft, on a wing of {wing:g} ft'


def _number(element: Element) -> float:
    try:
        return float(element.text or "")
    except ValueError:
        return math.nan


def integrator_after(root: Element, command: str) -> str | None:
    """The first component between a command and what it moves that integrates: what it commands is then a rate."""
    components = [each for each in root.iter() if each.tag in _COMPONENTS]
    reached, more = {command.replace("[0]", "")}, True
    while more:
        more = False
        for component in components:
            reads = {name.replace("[0]", "") for name in _read(component)}
            if reads & reached and not (made := _made(component)) <= reached:
                if component.tag in ("integrator", "pid"):
                    return f"<{component.tag} name={component.get('name', '')!r}>"
                reached, more = reached | made, True
    return None


def _read(component: Element) -> Iterator[str]:
    for element in component.iter():
        if element.tag not in ("output", "description"):
            yield from _NAME.findall(f"{element.text or ''} {element.get('value', '')}")


def _made(component: Element) -> set[str]:
    """The properties that a component writes: JSBSim makes one of its name, too."""
    name = component.get("name", "").strip()
    own = name if "/" in name else f"fcs/{name.lower().replace(' ', '-')}"
    return {own, *((output.text or "").strip().replace("[0]", "") for output in component.findall("output"))}
