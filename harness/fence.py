"""The check of a JSBSim model, which is a program: a model that passes reads and writes no file, and opens no socket.

JSBSim would write any file that a model names, listen on a port, and end the process on some; so a model is read here
first. `fenced` makes one tree of a model and of the files beside it; `checked` reads a model that is about to fly.
"""

import math
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path, PurePosixPath
from typing import Any
from xml.etree import ElementTree
from xml.parsers import expat

from harness.error import HarnessError
from harness.files import content_hash, read, replacing

SECTIONS = (  # of a model; not the others of JSBSim: output, input, child, planet
    "fileheader", "metrics", "mass_balance", "ground_reactions", "propulsion", "system", "autopilot", "flight_control",
    "aerodynamics", "external_reactions", "buoyant_forces",
)  # fmt: skip
MOST_BYTES = 20_000_000  # of a file; the largest that travels with JSBSim has 0.12 million
MOST_ELEMENTS = 60_000  # of a model with all that it includes; there 6000
DEEPEST = 60  # elements in each other; there 13. JSBSim itself ends the process at some thousands
LONGEST_DELAY = 60.0  # s, or thousands of frames, of a component: JSBSim keeps a number for each step
_ENGINES = ("Engines", "engines", "Engine", "engine")  # folders, in the order in which JSBSim looks
_SYSTEMS = (".", "Systems", "systems")
_PROPERTY = re.compile(r"/?[A-Za-z_][\w.-]*(\[\d+\])?(/[A-Za-z_][\w.-]*(\[\d+\])?)+", re.ASCII)
_MASSES = ("emptywt", "ixx", "iyy", "izz")


class FenceError(HarnessError, ValueError):
    """A forbidden or invalid part of a model, in one line: `FILE:LINE: what is wrong, what is allowed`."""


class Tag(ElementTree.Element):
    """An element of a model, which knows where it stands."""

    place = ""  # FILE:LINE


@dataclass(frozen=True, slots=True)
class Fenced:
    """A model as one tree, with what it includes put in."""

    root: Tag
    sources: dict[str, str]  # the hash of each file that it was made from, by its path
    left_out: tuple[str, ...]  # what JSBSim would have read, `FILE:LINE: <output>`

    def write(self, file: Path) -> None:
        """Writes the model as one file. Raises OSError."""
        with replacing(file) as partial:
            ElementTree.ElementTree(self.root).write(partial, encoding="utf-8", xml_declaration=True)


def fence(model: Path, folder: Path, library: Path | None = None) -> Fenced:
    """Writes a copy of the model, fenced, into the folder, named as the folder is. Raises `FenceError` and OSError."""
    made = fenced(model, library)
    made.write(folder / f"{folder.name}.xml")
    return made


def fenced(model: Path, library: Path | None = None) -> Fenced:
    """A model, given as its file or as the folder that is named like it, and all that it includes. `FenceError`.

    It may include files in its own folder, in the folders `engine` and `systems` of a tree that is laid out as
    JSBSim's, and in those of `library`, which is JSBSim's own: to this alone entities are allowed.
    """
    file = model / f"{model.name}.xml" if model.is_dir() else model
    return _Fencing(file, library).made()


def checked(model: Path, systems: tuple[str, ...] = ()) -> Tag:
    """The root of a model that is about to be flown as it is: it may include these systems alone. `FenceError`.

    It is the same object for the same content: change a copy.
    """
    return _checked(model, _content(model), systems)


@lru_cache(maxsize=16)
def _checked(model: Path, content: bytes, systems: tuple[str, ...]) -> Tag:
    root = _parsed(model, content, entities=False)
    _is_model(root)
    for section in root:
        if section.tag not in SECTIONS:
            raise _at(section, f"<{section.tag}> is not read, only {', '.join(SECTIONS)}")
    for element in root.iter():
        if (name := element.get("file")) is not None and (element.tag != "system" or name not in systems):
            only = " or ".join(f'<system file="{system}">' for system in systems) or "what stands in the model"
            raise _at(element, f'<{element.tag} file="{name}"> is not read, only {only}')
    _check(root)
    return root


@dataclass(slots=True)
class _Fencing:
    """The state of `fenced`."""

    model: Path
    library: Path | None
    sources: dict[str, str] = field(default_factory=dict)
    left_out: list[str] = field(default_factory=list)
    declared: dict[str, ElementTree.Element] = field(default_factory=dict)  # the first declaration of each property
    elements: int = 0

    def made(self) -> Fenced:
        root = self.read(self.model)
        _is_model(root)
        for section in list(root):
            if section.tag == "child":
                raise _at(section, "<child> is another model, which is not read: leave it out")
            if section.tag not in SECTIONS:
                self.leave_out(root, section, f"<{section.tag}>")
                continue
            self.include(section, (".",) if section.tag != "system" else _SYSTEMS, "systems")
            for engine in section.findall("engine") if section.tag == "propulsion" else ():
                self.include(engine, _ENGINES, "engine")
                for thruster in engine.findall("thruster"):
                    self.include(thruster, _ENGINES, "engine")
        for element in root.iter():
            element.attrib.pop("file", None)  # elsewhere JSBSim does not read it
            for output in element.findall("output"):
                if _path(output.text)[:2] == ["simulation", "integrator"]:  # a detector of crashes stops the time
                    self.leave_out(element, output, f"<output> {(output.text or '').strip()}")
        _check(root)
        return Fenced(root, self.sources, tuple(self.left_out))

    def leave_out(self, parent: ElementTree.Element, element: ElementTree.Element, what: str) -> None:
        parent.remove(element)
        self.left_out.append(f"{_place(element)}: {what}")

    def include(self, element: ElementTree.Element, folders: Collection[str], shared: str) -> None:
        """Puts what the element's file holds into the element, as JSBSim would; `shared` is the library's folder."""
        name = element.attrib.pop("file", None)
        declared = element.findall("property")
        if name is None:
            self.declare(element, declared)
            return
        root = self.read(self.found(element, name, folders, shared))
        if element.tag in ("engine", "thruster"):
            element.append(root)
            return
        if root.tag != element.tag:
            raise _at(root, f"<{root.tag}> stands where <{element.tag}> must, which {_place(element)} includes")
        for own in declared:  # what is declared where a file is included overrides what the file declares
            element.remove(own)
        self.declare(root, root.findall("property"))
        element.extend(root)
        for own in declared:
            if (first := self.declared.get(_name(own))) is not None:
                first.set("value", own.get("value", "0"))
            else:
                element.append(own)
                self.declare(element, [own])
        for key, value in root.attrib.items():
            element.attrib.setdefault(key, value)

    def declare(self, section: ElementTree.Element, properties: list[ElementTree.Element]) -> None:
        """Leaves out what an earlier section has declared: JSBSim keeps the value of the first."""
        for each in properties:
            if self.declared.setdefault(_name(each), each) is not each:
                section.remove(each)

    def found(self, element: ElementTree.Element, name: str, folders: Collection[str], shared: str) -> Path:
        """The file that JSBSim would read. Raises `FenceError` for one that is not in an allowed folder."""
        path = PurePosixPath(name.replace("\\", "/"))
        if path.suffix != ".xml":
            path = path.with_name(f"{path.name}.xml") if path.name else path
        home, tree = self.model.parent, self.model.resolve().parent.parent
        inside = f'<{element.tag} file="{name}">: a model includes files in its own folder only, {home}'
        if path.is_absolute() or ".." in path.parts:
            raise _at(element, inside)
        roots = [(home, home / folder) for folder in folders]
        roots += [(tree.parent / shared,) * 2] if tree.name == "aircraft" and shared else []
        roots += [(self.library / shared,) * 2] if self.library else []
        for root, folder in roots:
            if (file := folder / path).is_symlink() or file.exists():
                if not file.resolve().is_relative_to(root.resolve()):
                    raise _at(element, f"{inside}; {file} leads to {file.resolve()}")
                return file
        looked = ", ".join(str(folder) for _, folder in roots)
        raise _at(element, f'<{element.tag} file="{name}">: there is no {path} in {looked}')

    def read(self, file: Path) -> Tag:
        content = _content(file)
        self.sources[str(file)] = content_hash(content)
        own = self.library is not None and file.resolve().is_relative_to(self.library.resolve())
        root = _parsed(file, content, entities=own)
        self.elements += sum(1 for _ in root.iter())
        if self.elements > MOST_ELEMENTS:
            raise FenceError(f"{file}: more than {MOST_ELEMENTS} elements with what was included before")
        return root


def _content(file: Path) -> bytes:
    """The content of a plain file of limited size."""
    try:
        if file.exists() and not file.is_file():
            raise FenceError(f"{file}: must be a file")
        if (size := file.stat().st_size) > MOST_BYTES:
            raise FenceError(f"{file}: has {size} bytes, may have {MOST_BYTES}")
        return read(file)
    except OSError as error:
        raise FenceError(f"{file}: {error.strerror}") from None
    except ValueError as error:
        if isinstance(error, FenceError):
            raise
        raise FenceError(f"{str(file)!r}: no file has such a name") from None


def _parsed(file: Path, content: bytes, entities: bool) -> Tag:
    """The root of an XML file."""
    builder = ElementTree.TreeBuilder(element_factory=Tag)
    parser = expat.ParserCreate()
    parser.buffer_text = True
    depth = elements = 0

    def refused(what: str) -> FenceError:
        return FenceError(f"{file}:{parser.CurrentLineNumber}: {what}")

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth, elements
        depth, elements = depth + 1, elements + 1
        if depth > DEEPEST:
            raise refused(f"elements stand more than {DEEPEST} deep in each other")
        if elements > MOST_ELEMENTS:
            raise refused(f"more than {MOST_ELEMENTS} elements")
        tag = builder.start(name, attributes)
        assert isinstance(tag, Tag)  # as the builder's factory makes them
        tag.place = f"{file}:{parser.CurrentLineNumber}"

    def end(name: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(name)

    def doctype(*_: Any) -> None:
        if not entities:
            raise refused("a DOCTYPE is not read, for its entities may grow without bound: leave it out")

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = builder.data
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        raise FenceError(f"{file}:{error.lineno}: not valid XML: {expat.ErrorString(error.code)}") from None
    except (ValueError, LookupError) as error:  # of an encoding
        if isinstance(error, FenceError):
            raise
        raise FenceError(f"{file}: {error}") from None
    root = builder.close()
    assert isinstance(root, Tag)
    return root


def _is_model(root: Tag) -> None:
    if root.tag != "fdm_config":
        raise _at(root, f"<{root.tag}> is no JSBSim model, which is <fdm_config>")


def _check(root: ElementTree.Element) -> None:
    """Raises `FenceError` for what a model may not say."""
    for section in root:
        declared = set(map(id, section.findall("property")))
        for element in section.iter():
            for written in _written(element, id(element) in declared):
                if fault := fault_of(written):
                    raise _at(element, fault)
            if element.tag == "delay":
                _check_delay(element)
            for text in (element.text or "", *(value for key, value in element.items() if key != "name")):
                if not all(map(math.isfinite, _numbers(text))):
                    raise _at(element, f"<{element.tag}> has {text.strip()[:60]!r}: a number must be finite")
    for mass in (each for section in root.iter("mass_balance") for each in section if each.tag in _MASSES):
        if not all(number > 0.0 for number in _numbers(mass.text)):
            raise _at(mass, f"<{mass.tag}> is {(mass.text or '').strip()}, must be above 0")


def fault_of(name: str) -> str:
    """Why nothing may write a property of this name; empty if it may."""
    path = _path(name)
    if "simulation" in path[:-1]:
        return f"writes {'/'.join(path)}: a model may read what is under simulation/ only"
    if ".." in path or "." in path:
        return f"{name.strip()}: the name of a property may not have . or .. in it"
    return ""


def fault_of_command(name: str) -> str:
    """Why no property that is written can have this name; empty if one can."""
    if not _PROPERTY.fullmatch(name):
        return f"{name!r} is no name of a property, which is like fcs/elevator-cmd-norm or fcs/throttle-cmd-norm[1]"
    return fault_of(name)


def _written(element: ElementTree.Element, is_declaration: bool) -> Iterator[str]:
    """The names of the properties that the element writes or makes."""
    yield element.get("name", "")
    if is_declaration or element.tag == "output" or (element.tag == "property" and "value" in element.attrib):
        yield from (element.text or "").splitlines()  # JSBSim takes the first that is not empty


def _check_delay(element: ElementTree.Element) -> None:
    unit, most = ("frames", 1e3 * LONGEST_DELAY) if element.get("type") == "frames" else ("s", LONGEST_DELAY)
    numbers = _numbers(element.text)
    if len(numbers) != 1 or not 0.0 <= numbers[0] <= most:
        raise _at(
            element, f"<delay> is {(element.text or '').strip()[:60]}, must be a number from 0 to {most:g} {unit}"
        )


def _numbers(text: str | None) -> list[float]:
    """The numbers of a text that holds nothing else; otherwise none."""
    try:
        return [float(word) for word in (text or "").split()]
    except ValueError:
        return []


def _name(property_: ElementTree.Element) -> str:
    """The name of the property in JSBSim."""
    return (property_.text or "").strip().replace("[0]", "")


def _path(name: str | None) -> list[str]:
    """The parts of a property's name, as JSBSim takes them, without index and sign."""
    bare = re.sub(r"\[[^\]]*\]", "", (name or "").strip().lstrip("+-"))
    return [part.strip() for part in bare.split("/") if part.strip()]


def _place(element: ElementTree.Element) -> str:
    return element.place if isinstance(element, Tag) else element.tag


def _at(element: ElementTree.Element, what: str) -> FenceError:
    return FenceError(f"{_place(element)}: {what}")
