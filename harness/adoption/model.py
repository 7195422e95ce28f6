"""A JSBSim model behind the fence, the properties that it names, and its copy with an inner loop."""

import copy
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
    """Of each property that the model writes, the component that does."""
    return {
        (output.text or "").strip().replace("[0]", ""): f"<{component.tag} name={component.get('name', '')!r}>"
        for component in root.iter()
        for output in component.findall("output")
    }
