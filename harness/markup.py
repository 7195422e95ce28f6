"""Text as a part of a LaTeX or Markdown document: every character stands for itself."""

import re

_LATEX = {
    "\\": r"\textbackslash{}", "_": r"\_", "%": r"\%", "&": r"\&", "#": r"\#", "$": r"\$", "{": r"\{", "}": r"\}",
    "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"\textless{}", ">": r"\textgreater{}",
    "|": r"\textbar{}",
}  # fmt: skip
_ANYWHERE = re.compile(r"([\\`*{}\[\]<>#|~^$&]|(?<![^\W_])_|_(?![^\W_]))")  # `_` is plain within a word
_AT_THE_BEGINNING = re.compile(r"^(\d*)([-+=.)])")  # a list, a rule, a heading


def latex(text: str) -> str:
    """One line of the text in LaTeX."""
    return "".join(_LATEX.get(letter, letter) for letter in _line(text))


def markdown(text: str) -> str:
    """One line of the text in Markdown."""
    return _AT_THE_BEGINNING.sub(r"\1\\\2", _ANYWHERE.sub(r"\\\1", _line(text)))


def code(text: str) -> str:
    """One line of code in Markdown, between as many backticks as it needs."""
    line = _line(text)
    ticks = _ticks(line, 1)
    space = " " if line.startswith("`") or line.endswith("`") else ""
    return f"{ticks}{space}{line}{space}{ticks}"


def block(text: str) -> str:
    """A block of plain text in Markdown, as it is."""
    ticks = _ticks(text, 3)
    return f"{ticks}text\n{text}\n{ticks}"


def _ticks(text: str, fewest: int) -> str:
    """Backticks, more than stand side by side in the text."""
    return "`" * max(fewest, 1 + max(map(len, re.findall("`+", text)), default=0))


def _line(text: str) -> str:
    return " ".join(text.split())
