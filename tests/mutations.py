"""Changes to files and texts that might trip up who reads them, as Hypothesis strategies."""

import re
import sqlite3
from collections.abc import Callable
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

from hypothesis import strategies as st

Draw = Callable[[st.SearchStrategy[Any]], Any]

NUMBERS = [
    "0", "1", "-1", "2", "0.5", "-0.0", "0.0", "1e-9", "1e-320", "1e6", "1e9", "1e308", "1e999", "1_000", "0x10", "nan",
    "inf", "-inf", "99999999999999999999", "9" * 5000,
]  # fmt: skip
NASTY = [
    *NUMBERS, "true", '""', '"x"', "'", '"', "[]", "[1]", "[[0.0, 0.0]]", "{}", "{ uniform = [0, 1] }",
    "{ start = 0, count = 3 }", "{ from = 1, to = 2, step = 0.5 }", "[1, [2, [3]]]", "[" * 99, "{a=" * 99, "a." * 99,
    "2020-01-01", "07:32:00", "null", "NaN", "None", "é", "日本", "\u202e", "\x1b[31m", "=", ",", "#", "\n", "\r", "\t",
    ":", "%s", "{0}", "<b>", "&amp;", "..", "/", "~", ".", "-", "--", "*", "a" * 5000, "15.4 s", "nan s", "1e400 s",
    "kinematic", "sixdof", "aerosonde", "nftsm", "custom", "plant", "law.k2", "settled_error_rms_m",
]  # fmt: skip
_BYTES = [*(text.encode() for text in NASTY), b"\0", b"\xff", b"\xff\xfe", b"\xef\xbb\xbf", b"\xc3", b""]
_TOKEN = re.compile(rb"[A-Za-z_][\w.-]*|[-+]?\d[\d.eE+-]*|\"[^\"\n]*\"|[ \t]+|.", re.DOTALL)
_NUMBER = re.compile(rb"[-+]?\d.*")
_VALUE = re.compile(rb"[-+]?\d.*|\".*|true|false")


@st.composite
def words(draw: Draw) -> str:
    """A word of a command line; no null, which the system forbids."""
    own = st.text(st.characters(exclude_characters="\0"), max_size=8)
    return str(draw(own if not draw(st.integers(0, 5)) else st.sampled_from(NASTY)))


@st.composite
def contents(draw: Draw, content: bytes) -> bytes:
    """The content of a file, changed in a few places: by tokens where it is text."""
    is_text = b"\0" not in content
    for _ in range(draw(st.sampled_from([1, 1, 1, 2, 4]))):
        way = draw(st.sampled_from([_value_changed, _value_changed, _in_tokens, _in_bytes])) if is_text else _in_bytes
        content = draw(way(content))
    return content


@st.composite
def _value_changed(draw: Draw, content: bytes) -> bytes:
    """A number or a string is another, so that the text stays well formed."""
    tokens = _TOKEN.findall(content)
    values = [i for i, token in enumerate(tokens) if _VALUE.fullmatch(token)]
    if not values:
        return bytes(draw(_in_tokens(content)))
    at = draw(st.sampled_from(values))
    others = st.sampled_from([tokens[i] for i in values])
    if _NUMBER.fullmatch(tokens[at]):
        others |= st.sampled_from([number.encode() for number in NUMBERS])
    return b"".join([*tokens[:at], draw(others), *tokens[at + 1 :]])


@st.composite
def _in_tokens(draw: Draw, content: bytes) -> bytes:
    tokens = _TOKEN.findall(content) or [b""]
    first = draw(st.integers(0, len(tokens) - 1))
    last = first + draw(st.sampled_from([0, 1, 1, 2, 5, 30]))
    new = draw(st.sampled_from(_BYTES) | st.sampled_from(tokens) | st.just(2 * b"".join(tokens[first:last])))
    return b"".join([*tokens[:first], new, *tokens[last:]])


@st.composite
def _in_bytes(draw: Draw, content: bytes) -> bytes:
    first = draw(st.integers(0, max(0, len(content) - 1)))
    last = first + draw(st.sampled_from([1, 4, 100, 5000, len(content)]))
    part = content[first:last]
    flipped = bytes([part[0] ^ 1 << draw(st.integers(0, 7))]) + part[1:] if part else b""
    new: bytes = draw(st.sampled_from([flipped, b"", 2 * part, bytes(len(part))]))
    return content[:first] + new + content[last:]


@st.composite
def databases(draw: Draw, path: Path) -> bytes:
    """The content of an SQLite database: as a file of any kind, or with one cell changed."""
    if not draw(st.integers(0, 4)):
        changed: bytes = draw(_in_bytes(path.read_bytes()))
        return changed
    with closing(sqlite3.connect(path, isolation_level=None)) as database:
        tables = [name for (name,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
        table = draw(st.sampled_from(tables))
        column = draw(st.sampled_from([column[1] for column in database.execute(f"PRAGMA table_info({table})")]))
        rows = database.execute(f"SELECT {column} FROM {table}").fetchall()
        if rows:
            ((value),) = rows[draw(st.integers(0, len(rows) - 1))]
            new = draw(
                st.sampled_from([None, 0, -1, 1e308, 2**62, b"\xff", b"", ""])
                | contents(value if isinstance(value, bytes) else str(value).encode()).map(_as_text)
            )
            with suppress(sqlite3.IntegrityError):  # such a cell cannot be
                database.execute(f"UPDATE {table} SET {column} = ? WHERE {column} IS ?", (new, value))
        return database.serialize()


def _as_text(content: bytes) -> str | bytes:
    try:
        return content.decode()
    except UnicodeDecodeError:
        return content
