"""The house: its rooms lie on floors, imports go downwards, and a name stands for one thing."""

import ast
import tomllib
from collections import defaultdict
from graphlib import TopologicalSorter

import grimp

import harness
from tests.builders import ROOT

HIGHEST = 12  # floors
# Names of classes that two rooms still share. It may only shrink.
SHARED: set[str] = set()


def contract() -> tuple[list[str], set[tuple[str, str]]]:
    """The layers of the import contract, the top first, and the imports that it names as exceptions."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    (layers,) = (each for each in settings["contracts"] if each["type"] == "layers")
    exceptions = {tuple(each.split(" -> ")) for each in layers.get("ignore_imports", ())}
    return layers["layers"], exceptions


def imports_of_rooms() -> dict[str, set[str]]:
    """Of each room, which is a module or a folder of `harness`, the rooms that it imports."""
    graph = grimp.build_graph("harness")
    _, exceptions = contract()
    room = {name: name.split(".")[1] for name in graph.modules if "." in name}
    imports: dict[str, set[str]] = {name: set() for name in room.values()}
    for importer, its_room in room.items():
        for imported in graph.find_modules_directly_imported_by(importer):
            if imported in room and room[imported] != its_room and (importer, imported) not in exceptions:
                imports[its_room].add(room[imported])
    return imports


def test_the_longest_way_down_through_the_imports_has_at_most_12_floors_and_no_circle() -> None:
    imports = imports_of_rooms()
    floor: dict[str, int] = {}
    for room in TopologicalSorter(imports).static_order():  # raises where rooms import each other in a circle
        floor[room] = 1 + max((floor[below] for below in imports[room]), default=0)
    assert max(floor.values()) <= HIGHEST, floor


def test_the_contract_of_the_imports_has_at_most_12_layers_and_the_exceptions_are_imports() -> None:
    layers, exceptions = contract()
    assert len(layers) <= HIGHEST
    graph = grimp.build_graph("harness")
    assert all(graph.direct_import_exists(importer=importer, imported=imported) for importer, imported in exceptions)


def test_no_two_rooms_have_classes_of_one_name() -> None:
    rooms: defaultdict[str, set[str]] = defaultdict(set)
    for path in (ROOT / "harness").rglob("*.py"):
        room = path.relative_to(ROOT / "harness").parts[0]
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef):
                rooms[node.name].add(room)
    assert {name: found for name, found in rooms.items() if len(found) > 1 and name not in SHARED} == {}


def test_no_module_has_the_name_of_what_the_package_exports() -> None:
    modules = {path.stem for path in (ROOT / "harness").iterdir() if path.suffix == ".py" or path.is_dir()}
    assert modules & {*harness.__all__} == set()
