"""The laws that settings may name: those of the package, and those of one's own, in a file or a module.

A user-defined law is code. It is run where a user names it, never because a stored row or a recording does: a row's law
is run from the user's own file alone, and only while that has the content that the row was flown with.
"""

import copyreg
import math
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, Literal

from autopilot.guidance import Law
from autopilot.laws import LAWS, LawKind
from harness.error import SettingsError
from harness.files import content_hash
from harness.settings.law_class import kind_in
from harness.settings.law_source import FILES, LawError, Source, entries, find


@dataclass(frozen=True, slots=True, eq=False)
class OwnLaw:
    """A user-defined law, loaded."""

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


def kind_of(name: str, *, run: bool) -> LawKind:
    """The law of this name. With `run` the file of a user-defined law may be run; without, it was before.

    Raises `LawError`.
    """
    if name in LAWS:
        return LAWS[name]
    if run:
        return _own(name).kind
    if name in _LATEST:
        return _LATEST[name].kind
    raise LawError(f"is {short(name)}, a user-defined law, whose code is not run from here")


def loaded_kind(name: str) -> LawKind | None:
    """The law of this name if it is available; None for a user-defined law that this process has not loaded."""
    return LAWS.get(name) or (_LATEST[name].kind if name in _LATEST else None)


def kind_of_class(law: type) -> tuple[str, LawKind] | None:
    """The name of a law's class and what there is to know of it; None for a class without a name."""
    if law in _BY_CLASS:
        return _BY_CLASS[law].source.name, _BY_CLASS[law].kind
    return next(((name, kind) for name, kind in LAWS.items() if kind.value is law), None)


def source_of(law: Law) -> Source | None:
    """The source of a user-defined law, as this process has loaded it; None for those of the package."""
    own = _BY_CLASS.get(type(law))
    return own.source if own else None


def is_own(name: str) -> bool:
    """Whether the name is one of a user-defined law."""
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


def is_unchanged(settings: Mapping[str, Any], content: Mapping[str, str]) -> None:
    """Loads the law of a stored row if its file is here and as the row was flown, by the hashes of its `content`.

    Raises `SettingsError` for any other user-defined law: it is not run.
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


def _own(name: str) -> OwnLaw:
    """The user-defined law, loaded once for each content of its files. Raises `LawError`."""
    source = find(name)
    key = name, tuple(source.hashes.values())
    if key not in _LOADED and source.is_module and name in _LATEST:
        return _LATEST[name]  # what this process has imported, whatever the file is edited to later
    if key not in _LOADED:
        module = _run_module(source) if source.is_module else _run_file(source)
        kind = kind_in(source, module)
        _LOADED[key] = _BY_CLASS.setdefault(kind.value, OwnLaw(source, kind))
        copyreg.pickle(kind.value, _reduced)
    _LATEST[name] = _LOADED[key]
    return _LOADED[key]


def parameters(law: Any) -> dict[str, Any]:
    """The fields with which the law's class makes the same law."""
    return {field.name: getattr(law, field.name) for field in fields(law) if field.init}


def _reduced(law: Any) -> tuple[Any, ...]:
    """How a user-defined law goes to a worker: by its name, since a file is no module there."""
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
    """The error that a file raised when it was run, with its line."""
    line, trace = 0, error.__traceback__
    while trace:
        line = trace.tb_lineno if trace.tb_frame.f_code.co_filename == str(source.main) else line
        trace = trace.tb_next
    at = f"{source.main}:{line}" if line else str(source.main)
    return f"{at}: cannot be loaded: {type(error).__name__}: {error}"
