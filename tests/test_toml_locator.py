"""The lines of the keys of a TOML text."""

import json
import re
import tomllib
from collections.abc import Iterator
from typing import Any

from hypothesis import example, given
from hypothesis import strategies as st

from harness.settings.toml_locator import Key, key_lines, nearest_line

VALUES = (
    "1",
    '"[no] = header # nor comment"',
    "'C:\\'",
    '"""two\n[lines]\nk = 1"""""',
    "'''\nk = 'quoted'''''",
    "[]",
    '[ 1, # a comment ] }\n  [2, 3],\n  "]", ]',
    "{ k = [1, 2], 'j' = { i = '}' } }",
    "1979-05-27 07:32:00  # a date",
)
NAMES = st.one_of(st.from_regex(r"[a-z0-9_-]{1,3}", fullmatch=True), st.text("aé. \\\"'#[]=\n\t", max_size=3))
TABLES = st.recursive(
    st.dictionaries(NAMES, st.sampled_from(VALUES), max_size=3),
    lambda inner: st.dictionaries(NAMES, st.sampled_from(VALUES) | inner | st.lists(inner, min_size=1), max_size=3),
    max_leaves=6,
)
PIECES = (
    "a",
    "b",
    ".",
    "=",
    " = ",
    "1",
    "\n",
    "\r\n",
    "[",
    "]",
    "[[",
    "]]",
    "{",
    "}",
    ",",
    "#",
    '"',
    '"""',
    "'",
    "'''",
    "\\",
    " ",
)


Table = dict[str, Any]


def statements(table: Table, key: Key = (), dotted: str = "") -> Iterator[tuple[Key, str]]:
    """The keys of a table with the text of each, in the order of a TOML file: values first, then tables."""
    for name, value in table.items():
        if isinstance(value, str):
            yield (*key, name), f"{quoted(name)} = {value}"
    for name, value in table.items():
        inner = f"{dotted} . {quoted(name)}" if dotted else quoted(name)
        if isinstance(value, dict):
            yield (*key, name), f"\n[ {inner} ] # a table"
            yield from statements(value, (*key, name), inner)
        elif isinstance(value, list):
            for i, element in enumerate(value):
                yield (*key, name, i), f"[[{inner}]]"
                yield from statements(element, (*key, name, i), inner)


def quoted(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else json.dumps(name, ensure_ascii=False)


@given(TABLES)
def test_every_key_that_tomllib_reads_is_found_on_the_line_where_it_was_written(table: Table) -> None:
    text, written = "", {}
    for key, statement in statements(table):
        written[key] = text.count("\n") + 1 + statement.startswith("\n")
        text += f"{statement}\n"
    document, lines = tomllib.loads(text), key_lines(text)
    for key, line in written.items():
        value: Any = document
        for step in key:
            value = value[step]
        assert lines[key] == line


@given(st.lists(st.sampled_from(PIECES), max_size=12).map("".join))
@example("a=''''''''\nb=1")
@example('a="""\\""""""\nb.a=1')
def test_whatever_tomllib_accepts_is_located(text: str) -> None:
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return
    assert {key[0] for key in key_lines(text)} == set(document)


def test_elements_of_an_array_over_several_lines_have_lines_of_their_own() -> None:
    text = 'segments = [ # two\n  { from_s = 1, to_s = 2 },\n\n  { from_s = 3 },\n]\nnext = "x"'
    assert key_lines(text) == {("segments",): 1, ("segments", 0): 2, ("segments", 1): 4, ("next",): 6}


def test_dotted_keys_and_headers_locate_the_tables_they_imply() -> None:
    lines = key_lines("a.b.c = 1\n[x.y]\nz = 2\n[x]\nw = 3\n")
    assert lines[("a", "b")] == 1
    assert (lines[("x",)], lines[("x", "y")], lines[("x", "w")]) == (4, 2, 5)


def test_what_has_no_line_falls_back_to_what_is_around_it() -> None:
    lines = key_lines("\n\n[flight]\nstart = { heading_deg = 30 }\n")
    assert nearest_line(lines, ("flight", "start", "heading_deg")) == 4
    assert nearest_line(lines, ("flight", "law", "gains")) == 3
    assert nearest_line(lines, ("matrix",)) == 1


def test_windows_line_ends_count_once() -> None:
    assert key_lines("a = 1\r\n\r\nb = 2\r\n") == {("a",): 1, ("b",): 3}
