"""Where a user-defined law is written: its file, and what that imports, found and read without running it."""

import ast
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

from autopilot.laws import LAWS
from harness.error import did_you_mean
from harness.files import content_hash, read

ENTRY_POINTS = "standoff_harness.laws"  # the group by which a package names its laws
FILES = "law/"  # begins what a version calls the files of a user-defined law
FORMS = "FILE.py:CLASS or MODULE:CLASS"
_OTHERWISE = {"__name__", "TYPE_CHECKING"}  # in an `if`: what follows is not run when the file is imported
_INSTALLED = ("site-packages", "dist-packages")
_YOUNG = 100_000_000  # ns


class LawError(ValueError):
    """A law that cannot be used; the message says why in one line."""


class Source(NamedTuple):
    """Where a user-defined law is written: found without running it."""

    name: str  # as settings keep it: the path of a file is absolute
    where: str  # the path of its file, or its module
    class_name: str
    main: Path
    root: Path  # below which its files lie
    files: Mapping[str, Path]  # its file and the local ones that it imports, by what a version calls them
    hashes: Mapping[str, str]  # of their content
    classes: frozenset[str]  # that they define

    @property
    def is_module(self) -> bool:
        """Whether Python imports it as a module, once in a process; a file is run for each content that it has."""
        return not self.where.endswith(".py")


_FOUND: dict[str, tuple[Source, list[tuple[int, int, int]]]] = {}  # by name, with the stamps of its files


@cache
def entries() -> Mapping[str, str]:
    """The laws of installed packages: MODULE:CLASS by name."""
    return {entry.name: entry.value for entry in entry_points(group=ENTRY_POINTS) if entry.name not in LAWS}


def find(name: str) -> Source:
    """The source of a user-defined law, found and read without running it. Raises `LawError`.

    It is read again when one of its files has another time or size; always while they are so young that a time tells
    too little.
    """
    if name in _FOUND and _FOUND[name][1] == _stamps(_FOUND[name][0]):
        return _FOUND[name][0]
    source = _find(name)
    stamps = _stamps(source)
    if stamps and max(changed for changed, *_ in stamps) < time.time_ns() - _YOUNG:
        _FOUND[name] = source, stamps
    return source


def _stamps(source: Source) -> list[tuple[int, int, int]]:
    """Modification time, ns, size and number of each file; empty if one is missing."""
    try:
        return [(of.st_mtime_ns, of.st_size, of.st_ino) for of in map(Path.stat, source.files.values())]
    except OSError:
        return []


def _find(name: str) -> Source:
    where, colon, class_name = entries().get(name, name).rpartition(":")
    if not colon or not where or not class_name.isidentifier():
        if name.endswith(".py"):
            raise LawError(f"names a file and no class of it, must be {name}:CLASS")
        known = ", ".join([*LAWS, *entries()])
        raise LawError(f"must be one of {known}, or {FORMS}{did_you_mean(name, [*LAWS, *entries()])}")
    if where.endswith(".py"):
        main = Path(where)
        if not main.is_file():
            raise LawError(f"{main}: there is no such file")
        root, package = main.parent, ""
    else:
        main, root, package = _module_file(where)
    trees = _closure(main, root, package)
    files = {_called(path, root): path for path in trees}
    classes = frozenset(n.name for tree in trees.values() for n in tree.body if isinstance(n, ast.ClassDef))
    try:
        hashes = {label: content_hash(read(path)) for label, path in files.items()}
    except OSError as error:
        raise LawError(f"{error.filename}: {error.strerror}") from None
    return Source(name, where, class_name, main, root, MappingProxyType(files), MappingProxyType(hashes), classes)


def _called(path: Path, root: Path) -> str:
    inside = path.is_relative_to(root)
    return f"{FILES}{path.relative_to(root).as_posix() if inside else path.name}"


def _module_file(module: str) -> tuple[Path, Path, str]:
    """A module's file, the folder of its outermost package, and the name of that; nothing is imported."""
    search: Sequence[str] | None = None
    spec = None
    words = module.split(".")
    for i in range(len(words)):
        name = ".".join(words[: i + 1])
        finders = (finder for finder in sys.meta_path if hasattr(finder, "find_spec"))
        spec = next((found for finder in finders if (found := finder.find_spec(name, search))), None)
        search = spec.submodule_search_locations if spec else None
        if spec is None or (search is None and i + 1 < len(words)):
            raise LawError(
                f"there is no module {name}: it must be installed, or its folder be in PYTHONPATH; "
                f"a file is named as {words[-1]}.py:CLASS"
            )
    main = Path(spec.origin) if spec and spec.origin else Path()
    if not main.is_file():
        raise LawError(f"the module {module} is no file of Python")
    depth = len(words) - 1 + (main.name == "__init__.py")
    root = main.parents[depth]
    alone = depth == 0 and not {*_INSTALLED} & {*root.parts}
    return main, root, "" if alone else words[0]


def _closure(main: Path, root: Path, package: str) -> dict[Path, ast.Module]:
    """The file and all that it imports, directly or not, from `root`: of `package` alone if one is given."""
    found: dict[Path, ast.Module] = {}
    around = [folder / "__init__.py" for folder in main.parents if package and folder.is_relative_to(root / package)]
    waiting = [main, *(path for path in around if path.is_file())]
    while waiting:
        path = waiting.pop()
        if path in found:
            continue
        try:
            found[path] = ast.parse(path.read_bytes(), str(path))
        except OSError as error:
            raise LawError(f"{path}: {error.strerror or error}") from None
        except (SyntaxError, ValueError) as error:
            raise LawError(f"{path}:{getattr(error, 'lineno', None) or 1}: is not valid Python: {error}") from None
        waiting += _imported(found[path], path, root, package)
    return found


def _imported(tree: ast.Module, path: Path, root: Path, package: str) -> Iterator[Path]:
    """The local files of each import in a file, wherever in it that stands."""
    for node in _run_by_others(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield from _files_of(alias.name, root, package)
        elif isinstance(node, ast.ImportFrom):
            below = path.parents[node.level - 1] if 0 < node.level <= len(path.parents) else root
            within = "" if node.level else package
            for name in dict.fromkeys([node.module or "", *(f"{node.module or ''}.{a.name}" for a in node.names)]):
                yield from _files_of(name.strip("."), below, within)


def _run_by_others(node: ast.AST) -> Iterator[ast.AST]:
    """All nodes, without those that are only for a type checker, or for the file as a script."""
    for inner in ast.iter_child_nodes(node):
        if isinstance(inner, ast.If) and _OTHERWISE & {getattr(n, "id", "") for n in ast.walk(inner.test)}:
            for one in inner.orelse:
                yield from (one, *_run_by_others(one))
        else:
            yield inner
            yield from _run_by_others(inner)


def _files_of(name: str, root: Path, package: str) -> Iterator[Path]:
    """The files of a module below `root`, with those of the packages around it."""
    words = name.split(".")
    if not name or (package and words[0] != package):
        return
    for i in range(len(words)):
        base = root.joinpath(*words[: i + 1])
        yield from (path for path in (base.with_suffix(".py"), base / "__init__.py") if path.is_file())
