"""The line of each key in a TOML text, which tomllib does not give."""

import json
import re
import tomllib
from bisect import bisect_left
from collections.abc import Mapping

from harness.toml_text import shortened

Key = tuple[str | int, ...]  # ("flight", "target", "segments", 0): tables by key, elements of arrays by index

_PART = r"""(?:[A-Za-z0-9_-]+|"(?:\\.|[^"\\\n])*"|'[^'\n]*')"""
_STATEMENT = re.compile(
    rf"""(?:[ \t\n]|\#[^\n]*)*+              # blank lines and comments before it
    (?P<header>\[\[?)?+ [ \t]*
    (?P<key>{_PART}(?:[ \t]*\.[ \t]*{_PART})*+) [ \t]*
    (?(header)\]\]?|=)""",
    re.VERBOSE,
)
_TOKEN = re.compile(
    r'''(?P<skipped>[ \t]+|\#[^\n]*)
    | """(?:\\.|[^\\])*?"{3,5}  | \'{3}.*?\'{3,5}    # multi-line strings may end in quotes of their own
    | "(?:\\.|[^"\\\n])*" | '[^'\n]*'
    | [\n,{}\[\]]
    | [^\s,"'\#{}\[\]]+''',
    re.VERBOSE | re.DOTALL,
)


def key_lines(text: str) -> dict[Key, int]:
    """The line, from 1, of each key, table and array element of a text that tomllib accepts.

    Keys and elements inside an inline table or a nested array have no entry: see `nearest_line`.
    """
    text = text.replace("\r\n", "\n")
    ends = [newline.start() for newline in re.finditer("\n", text)]
    lines: dict[Key, int] = {}
    lengths: dict[Key, int] = {}  # of the arrays of tables so far
    table: Key = ()
    position = 0
    while statement := _STATEMENT.match(text, position):
        line = bisect_left(ends, statement.start("key")) + 1
        position = statement.end()
        names = _names(statement["key"])
        key = table if statement["header"] is None else ()
        for name in names:
            if key in lengths:
                key += (lengths[key] - 1,)
            key += (name,)
            lines.setdefault(key, line)
        if statement["header"] == "[[":
            lengths[key] = lengths.get(key, 0) + 1
            key += (lengths[key] - 1,)
        lines[key] = line
        if statement["header"]:
            table = key
        else:
            starts, position = _value(text, position)
            for i, start in enumerate(starts):
                lines[*key, i] = bisect_left(ends, start) + 1
    return lines


def nearest_line(lines: Mapping[Key, int], key: Key) -> int:
    """The line of the key, or of the innermost table around it that has a line; 1 if none has."""
    for length in range(len(key), 0, -1):
        if key[:length] in lines:
            return lines[key[:length]]
    return 1


def dotted(key: Key) -> str:
    """The key as messages show it, with dots; parts that TOML would quote are quoted."""
    return ".".join(shortened(str(k) if re.fullmatch(r"[\w-]+", str(k), re.ASCII) else json.dumps(k)) for k in key)


def _names(key: str) -> list[str]:
    """The parts of a dotted key; tomllib reads its quotes and escapes."""
    names = []
    value = tomllib.loads(f"{key} = 0")
    while isinstance(value, dict):
        ((name, value),) = value.items()
        names.append(name)
    return names


def _value(text: str, position: int) -> tuple[list[int], int]:
    """For the value that starts at `position`: the starts of its elements if it is an array, and its end."""
    starts: list[int] = []
    opened = ""  # the open brackets around the token
    awaited = False  # whether the next token begins an element of the outermost array
    while token := _TOKEN.match(text, position):
        mark = token[0]
        if not opened and mark in ("\n", "]", "}"):
            break
        if awaited and mark not in ("\n", "]") and not token["skipped"]:
            starts.append(position)
            awaited = False
        if mark in ("[", "{"):
            opened += mark
        elif mark in ("]", "}"):
            opened = opened[:-1]
        if mark in ("[", ","):
            awaited = awaited or opened == "["
        position = token.end()
    return starts, position
