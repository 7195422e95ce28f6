"""Kernels: lifted loops that Numba has compiled, kept on disk by the content of their text."""

import importlib.util
import os
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from harness.compiled.closure import NotLiftedError, Shape, held
from harness.compiled.lifted import module_of
from harness.files import content_hash, replacing
from harness.provenance import processor

_HEADER = '''"""Written by the harness: see harness/compiled/kernel.py. {versions}"""

from collections import namedtuple

from numba import njit as jit

from harness.compiled import arithmetic as arithmetic_

'''
_LOOP = "jit(cache=True, _nrt=False)"  # what it calls inherits this: references to arrays are not counted
FOLDER = "STANDOFF_HARNESS_CACHE"  # the variable that names the folder of the kernels
_KEPT, _YOUNG = 100, 3600.0  # modules; s: a process may be about to import one that is younger


class NotCompiledError(Exception):
    """The flight cannot be compiled; the message says why."""


@cache
def is_installed() -> bool:
    """Whether there is a Numba."""
    return importlib.util.find_spec("numba") is not None


class Kernel(NamedTuple):
    """A compiled loop."""

    fly: Callable[..., Any]
    told: tuple[str, ...]  # the names of the channels that its law tells


_KERNELS: dict[Shape, Kernel | str] = {}  # by the shape of what the loop holds; or why there is none


def kernel(function: Any) -> tuple[Kernel, tuple[Any, ...]]:
    """A function compiled, and what it is called with last: the numbers that it holds. Raises `NotCompiledError`."""
    try:
        shape, numbers = held(function)
        found = _KERNELS.get(shape)
    except NotLiftedError as error:
        raise NotCompiledError(str(error)) from None
    except (TypeError, ValueError) as error:  # it holds what has no hash, or nothing yet
        raise NotCompiledError(f"what it holds cannot be compared: {error}") from None
    if found is None:
        found = _KERNELS[shape] = _made(function)
    if isinstance(found, str):
        raise NotCompiledError(found)
    return found, (numbers,) if numbers else ()


def refuse(function: Any, why: str) -> None:
    """The kernel of this function is not used any more."""
    _KERNELS[held(function)[0]] = why


def _made(function: Any) -> Kernel | str:
    """The kernel of a function; or why there is none."""
    try:
        return _loaded(function)
    except NotLiftedError as error:
        return str(error)
    except Exception as error:  # a full disk, a Numba that does not start: Python flies all the same
        return f"no kernel can be made: {type(error).__name__}: {error}"


def _loaded(function: Any) -> Kernel:
    """The function of a module that is written, if there is none with this text, and imported."""
    import llvmlite
    import numba

    body, name, told = module_of(function)
    arithmetic = content_hash((Path(__file__).parent / "arithmetic.py").read_bytes())
    versions = f"{sys.version_info[:3]}, {numba.__version__}, {llvmlite.__version__}, {processor()}, {arithmetic}"
    text = f"{_HEADER.format(versions=versions)}{body}\n{name} = {_LOOP}({name}.py_func)\n"
    file = folder() / f"kernel_{content_hash(text.encode())}.py"
    if not file.exists():
        with replacing(file) as partial:
            partial.write_text(text, encoding="utf-8")
            os.utime(partial, (0, 0))  # the same in every process: Numba compiles anew what has another time
        _clear(file.parent)
    return Kernel(getattr(_imported(file), name), told)


def _imported(file: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"standoff_harness_{file.stem}", file)
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[module.__name__] = module
    earlier, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        spec.loader.exec_module(module)
    finally:
        sys.dont_write_bytecode = earlier
    return module


@cache
def folder() -> Path:
    """The folder of the kernels: the user's cache, or one of this user's own among the temporary files."""
    caches = os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()
    path = Path(os.environ.get(FOLDER) or Path(caches) / "standoff-harness" / "kernels")
    with suppress(OSError):
        path.mkdir(parents=True, exist_ok=True)
        if os.access(path, os.W_OK):
            return path
    path = Path(tempfile.gettempdir()) / f"standoff-harness-{os.getuid()}"
    path.mkdir(mode=0o700, exist_ok=True)
    if path.stat().st_uid != os.getuid():
        raise NotCompiledError(f"{path} is somebody else's: name a folder in {FOLDER}")
    return path


def _clear(folder: Path) -> None:
    """Keeps the modules that were read last, and all of the last hour, with what Numba made of them."""
    used = {}
    for file in folder.glob("kernel_*.py"):
        with suppress(FileNotFoundError):  # another process clears as well
            used[file] = max(file.stat().st_atime, file.stat().st_ctime)
    for old in sorted(used, key=used.__getitem__)[:-_KEPT]:
        if used[old] < time.time() - _YOUNG:
            for file in [old, *(folder / "__pycache__").glob(f"{old.stem}.*")]:
                file.unlink(missing_ok=True)
