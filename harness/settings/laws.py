"""The laws that settings may name: those of the package, and those of one's own, in a file or a module.

A law of one's own is code. It is run where a user names it, never because a stored row or a recording does: a row's law
is run from the user's own file alone, and only while that has the content that the row was flown with.
"""

import ast
import copyreg
import math
import sys
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from inspect import isclass
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any, Literal, NamedTuple, get_origin

from autopilot.guidance import Law
from autopilot.laws import LAWS, LawKind
from harness.error import SettingsError, did_you_mean
from harness.files import content_hash, read
from harness.settings.table import Setting, schema_of

ENTRY_POINTS = "standoff_harness.laws"  # the group by which a package names its laws
FILES = "law/"  # begins what a version calls the files of a law of one's own
FORMS = "FILE.py:CLASS or MODULE:CLASS"
_MEMBERS = ("start", "command", "broken_conditions")  # besides the fields
_FIELDS = ("standoff", "max_heading_rate")  # numbers that every result has
_OTHERWISE = {"__name__", "TYPE_CHECKING"}  # in an `if`: what follows is not run when the file is imported
_INSTALLED = ("site-packages", "dist-packages")


class LawError(ValueError):
    """A law that cannot be used; the message says why in one line."""


class Source(NamedTuple):
    """Where a law of one's own is written: found without running it."""

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


@dataclass(frozen=True, slots=True, eq=False)
class OwnLaw:
    """A law of one's own, loaded."""

    source: Source
    kind: LawKind


@dataclass(frozen=True, slots=True, eq=False)
class NotRun:
    """The law of a recorded flight that is a user's own: its settings alone, since nothing that a file names is run."""

    table: Mapping[str, Any]  # [flight.law] in file units

    @property
    def standoff(self) -> float:
        return float(self.table["standoff_m"])

    @property
    def max_heading_rate(self) -> float:
        return math.radians(float(self.table["max_heading_rate_deg_s"]))

    @property
    def command(self) -> Literal["heading_rate", "course_rate"]:
        return "course_rate" if self.table.get("command") == "course_rate" else "heading_rate"

    def start(self, context: object) -> Any:
        raise LawError(f"{self.table['name']}: a recording does not run the law that it names")

    def broken_conditions(self, speed_ratio: float) -> list[str]:
        return []


_LOADED: dict[tuple[str, tuple[str, ...]], OwnLaw] = {}  # by name and content
_LATEST: dict[str, OwnLaw] = {}  # by name
_BY_CLASS: dict[type, OwnLaw] = {}
_FOUND: dict[str, tuple[Source, list[tuple[int, int, int]]]] = {}  # by name, with the stamps of its files
_YOUNG = 100_000_000  # ns


def kind_of(name: str, *, run: bool) -> LawKind:
    """The law of this name. With `run` the file of a law of one's own may be run; without, it was before.

    Raises `LawError`.
    """
    if name in LAWS:
        return LAWS[name]
    if run:
        return _own(name).kind
    if name in _LATEST:
        return _LATEST[name].kind
    raise LawError(f"is {short(name)}, a law of somebody's own, whose code is not run from here")


def loaded_kind(name: str) -> LawKind | None:
    """The law of this name where it is at hand; None for one of somebody's own that this process has not loaded."""
    return LAWS.get(name) or (_LATEST[name].kind if name in _LATEST else None)


def kind_of_class(law: type) -> tuple[str, LawKind] | None:
    """The name of a law's class and what there is to know of it; None for a class without a name."""
    if law in _BY_CLASS:
        return _BY_CLASS[law].source.name, _BY_CLASS[law].kind
    return next(((name, kind) for name, kind in LAWS.items() if kind.value is law), None)


def source_of(law: Law) -> Source | None:
    """The source of a law of one's own, as this process has loaded it; None for those of the package."""
    own = _BY_CLASS.get(type(law))
    return own.source if own else None


def is_own(name: str) -> bool:
    """Whether the name is one of a law of one's own."""
    return name not in LAWS and (":" in name or name.endswith(".py") or name in entries())


def short(name: str) -> str:
    """The name without the folders of its file."""
    where, colon, class_name = name.rpartition(":")
    return f"{Path(where).name}:{class_name}" if colon and where.endswith(".py") else name


def short_names(names: Iterable[str]) -> dict[str, str]:
    """The short form of each name; the name itself where two have the same."""
    given = list(dict.fromkeys(names))
    shortened = list(map(short, given))
    return dict(zip(given, shortened if len(set(shortened)) == len(given) else given, strict=True))


def absolute(name: str, folder: Path) -> str:
    """The name with the path of its file from `folder`."""
    where, colon, class_name = name.rpartition(":")
    return f"{(folder / Path(where).expanduser()).absolute()}:{class_name}" if colon and where.endswith(".py") else name


@cache
def entries() -> Mapping[str, str]:
    """The laws of installed packages: MODULE:CLASS by name."""
    return {entry.name: entry.value for entry in entry_points(group=ENTRY_POINTS) if entry.name not in LAWS}


def is_unchanged(settings: Mapping[str, Any], content: Mapping[str, str]) -> None:
    """Loads the law of a stored row if its file is here and as the row was flown, by the hashes of its `content`.

    Raises `SettingsError` for any other law of one's own: it is not run.
    """
    match settings:
        case {"law": {"name": str(name)}} if name not in LAWS:
            pass
        case _:
            return
    then = {file: digest for file, digest in content.items() if file.startswith(FILES)}
    try:
        source = find(name)
        if source.class_name not in source.classes:
            raise LawError("its file has no such class")
        if source.hashes != then or _own(name).source.hashes != then:
            raise LawError("it has changed since, and for a row only the law that it was flown with may be run")
    except LawError as error:
        raise SettingsError([f"flight.law.name: {short(name)}: {error}"]) from None


def find(name: str) -> Source:
    """The source of a law of one's own, found and read without running it. Raises `LawError`.

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
    """Of each file when it changed, ns, its size and its number; empty when one is gone."""
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


def _own(name: str) -> OwnLaw:
    """The law of one's own, loaded once for each content of its files. Raises `LawError`."""
    source = find(name)
    key = name, tuple(source.hashes.values())
    if key not in _LOADED and source.is_module and name in _LATEST:
        return _LATEST[name]  # what this process has imported, whatever the file is edited to later
    if key not in _LOADED:
        module = _run_module(source) if source.is_module else _run_file(source)
        kind = _kind(source, module)
        _LOADED[key] = _BY_CLASS.setdefault(kind.value, OwnLaw(source, kind))
        copyreg.pickle(kind.value, _reduced)
    _LATEST[name] = _LOADED[key]
    return _LOADED[key]


def parameters(law: Any) -> dict[str, Any]:
    """The fields with which the law's class makes the same law."""
    return {field.name: getattr(law, field.name) for field in fields(law) if field.init}


def _reduced(law: Any) -> tuple[Any, ...]:
    """How a law of one's own goes to a worker: by its name, since a file is no module there."""
    return _restored, (_BY_CLASS[type(law)].source.name, parameters(law))


def _restored(name: str, values: Mapping[str, Any]) -> Law:
    return _own(name).kind.value(**values)


def _run_module(source: Source) -> ModuleType:
    earlier = sys.modules.get(source.where)
    try:
        return earlier or import_module(source.where)
    except (Exception, SystemExit) as error:
        raise LawError(_raised(source, error)) from None


def _run_file(source: Source) -> ModuleType:
    """The module of a file, under a name of its own; its local modules are imported as from the file's folder."""
    local = [Path(label.removeprefix(FILES)) for label in source.files if source.files[label] != source.main]
    names = [".".join((path.parent if path.name == "__init__.py" else path.with_suffix("")).parts) for path in local]
    for name in names:  # those of another law, or of an earlier content
        if name in sys.modules and _lies_below(sys.modules[name], {law.source.root for law in _LOADED.values()}):
            del sys.modules[name]
    module = ModuleType(f"own_law_{source.main.stem}_{content_hash(repr(source).encode())[:8]}")
    module.__file__ = str(source.main)
    sys.modules[module.__name__] = module
    sys.path.insert(0, str(source.root))
    earlier, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        exec(compile(source.main.read_bytes(), str(source.main), "exec"), module.__dict__)
        for name in names:  # what is imported later, in a function, is at hand then
            import_module(name)
    except (Exception, SystemExit) as error:
        del sys.modules[module.__name__]
        raise LawError(_raised(source, error)) from None
    finally:
        sys.dont_write_bytecode = earlier
        sys.path.remove(str(source.root))
    return module


def _lies_below(module: ModuleType, roots: set[Path]) -> bool:
    file = getattr(module, "__file__", None)
    return bool(file) and any(Path(str(file)).is_relative_to(root) for root in roots)


def _raised(source: Source, error: BaseException) -> str:
    """What a file raised when it was run, with the line in it."""
    line, trace = 0, error.__traceback__
    while trace:
        line = trace.tb_lineno if trace.tb_frame.f_code.co_filename == str(source.main) else line
        trace = trace.tb_next
    at = f"{source.main}:{line}" if line else str(source.main)
    return f"{at}: cannot be loaded: {type(error).__name__}: {error}"


def _kind(source: Source, module: ModuleType) -> LawKind:
    """The law of a module. Raises `LawError` with everything that it lacks."""
    value: Any = getattr(module, source.class_name, None)
    if not isinstance(value, type):
        laws = [name for name, one in vars(module).items() if isclass(one) and one.__module__ == module.__name__]
        there = f"it has {', '.join(laws)}" if laws else "it has no class"
        raise LawError(
            f"{source.main}: there is no class {source.class_name}, {there}{did_you_mean(source.class_name, laws)}"
        )
    sets = getattr(value, "gain_sets", getattr(module, "GAIN_SETS", {}))
    wrong = [*_wrong_with(value), *_wrong_sets(value, sets)]
    if wrong:
        raise LawError(f"{source.main}: {source.class_name} is not a law yet: {'; '.join(wrong)}")
    return LawKind(value, sets, next(iter(sets), ""), getattr(module, "RULES", {}))


def _wrong_with(value: type) -> Iterator[str]:
    """Everything that a class lacks to be a law, and what is wrong with its fields."""
    own = vars(value)
    params = getattr(value, "__dataclass_params__", None)
    if not is_dataclass(value) or ("__dataclass_params__" not in own and own.get("__annotations__")):
        yield "it is no dataclass: write @dataclass(frozen=True) above it"
    elif params and not params.frozen:
        yield "it is not frozen: write @dataclass(frozen=True)"
    for member in _MEMBERS:
        if not hasattr(value, member) and member not in _names(value):
            yield f"it lacks {_wanted(member)}"
    for name in _FIELDS:
        if name not in _names(value):
            yield f"it lacks {_wanted(name)}"
    if is_dataclass(value):
        yield from _wrong_fields(value)


def _wanted(member: str) -> str:
    return {
        "start": "start(self, context), which returns the function from an Observation to a Guidance",
        "command": 'command = "heading_rate", the quantity that it limits',
        "broken_conditions": "broken_conditions(self, speed_ratio), a list of sentences, perhaps empty",
        "standoff": "the field standoff: float = 200.0, in m",
        "max_heading_rate": "the field max_heading_rate: float = 0.087, in rad/s",
    }[member]


def _names(value: type) -> list[str]:
    return [field.name for field in fields(value)] if is_dataclass(value) else []


def _wrong_fields(value: type) -> Iterator[str]:
    try:
        settings = schema_of(value).settings.values()
    except Exception as error:  # of an annotation that means nothing here
        yield f"the annotations of its fields cannot be read: {error}"
        return
    for setting in settings:
        if setting.name == "name":
            yield "a field cannot be called name: that is the law's own in [flight.law]"
        if setting.table or not _is_plain(setting):
            yield f"the field {setting.name} must be a float, int, bool, str, Literal or a tuple of these"
        if setting.name in _FIELDS and setting.kind is not float:
            yield f"the field {setting.name} must be a float"
        if setting.name == "gains" and setting.kind is not str:
            yield 'the field gains must be text: gains: str = "custom"'


def _is_plain(setting: Setting) -> bool:
    return setting.kind in (float, int, bool, str) or get_origin(setting.kind) is Literal


def _wrong_sets(value: type, sets: Any) -> Iterator[str]:
    if not isinstance(sets, Mapping) or not all(isinstance(numbers, Mapping) for numbers in sets.values()):
        yield "its gain_sets must be numbers by the name of a field, by the name of a set"
        return
    for label, numbers in sets.items():
        for name, number in numbers.items():
            if name not in _names(value):
                yield f"its gain set {label} sets {name}, which is no field{did_you_mean(name, _names(value))}"
            elif not isinstance(number, int | float) or not math.isfinite(number):
                yield f"its gain set {label} has {name} = {number!r}, must be a finite number"
