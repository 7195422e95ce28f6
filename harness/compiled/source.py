"""The source of a function: its place in the syntax tree of its file."""

import ast
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from types import CodeType

from harness.compiled.closure import NotLiftedError


def node_of(code: CodeType) -> ast.FunctionDef | ast.Lambda:
    """The function of this code in its file. Raises `NotLiftedError` where the file has changed since."""
    try:
        tree, codes = _read(code.co_filename, Path(code.co_filename).stat().st_mtime_ns)
    except (OSError, SyntaxError, ValueError) as error:
        raise NotLiftedError(f"{code.co_filename}: {error}") from None
    if code not in codes:
        raise NotLiftedError(f"{code.co_filename} has changed since it was loaded")
    begin = min((line, column) for line, _, column, _ in _positions(code))
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and node.name == code.co_name:
            if min(node.lineno, *(n.lineno for n in node.decorator_list), node.lineno) == code.co_firstlineno:
                return node
        elif isinstance(node, ast.Lambda) and code.co_name == "<lambda>":
            body = node.body
            if (body.lineno, body.col_offset) <= begin <= (body.end_lineno or 0, body.end_col_offset or 0):
                return node
    raise NotLiftedError(f"{code.co_name} is not found in {code.co_filename}")


def _positions(code: CodeType) -> Iterator[tuple[int, int, int, int]]:
    """Where the instructions of a code stand."""
    for line, end_line, column, end_column in code.co_positions():
        if line and end_line and column is not None and end_column:
            yield line, end_line, column, end_column


@lru_cache(maxsize=64)
def _read(file: str, changed: int) -> tuple[ast.Module, frozenset[CodeType]]:
    """A file as it is now: its tree, and all codes in it."""
    text = Path(file).read_bytes()
    return ast.parse(text, file), frozenset(_codes(compile(text, file, "exec")))


def _codes(code: CodeType) -> Iterator[CodeType]:
    yield code
    for inner in code.co_consts:
        if isinstance(inner, CodeType):
            yield from _codes(inner)
