"""The site's settings, for Sphinx: `make docs` builds it offline, and a warning, such as a broken link, is an error."""

import re
from importlib.metadata import version as version_of

from sphinx.application import Sphinx

project = "standoff-harness"
author = "The standoff-harness authors"
copyright = f"2026, {author}"  # noqa: A001 (the name that Sphinx reads)
version = release = version_of("standoff-harness")

extensions = ["myst_nb", "sphinx.ext.autodoc"]
myst_heading_anchors = 3
myst_enable_extensions = ["deflist"]  # no dollarmath: a page with formulas would load MathJax from the network
nb_execution_mode = "off"  # the notebook holds its outputs; a test executes it anew

default_role = "code"  # docstrings are plain text with `names`
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True

html_theme = "furo"
html_title = "standoff-harness"
html_show_sphinx = False
html_theme_options = {"navigation_with_keys": True, "footer_icons": []}


def bullets(app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Makes a list of a docstring's lines `name: meaning` with their indented continuations, as reST wants it."""
    item, made = False, list[str]()
    for line, following in zip(lines, [*lines[1:], ""], strict=True):
        starts = re.match(r"`?\w[\w`, ]*(?: and `\w+`)?: ", line) and (item or not following or following[0] in " `")
        if starts and not item and made and made[-1]:
            made.append("")
        if item and line and not starts and not line.startswith(" "):
            made.append("")
            item = False
        item = bool(starts) or (item and bool(line))
        made.append(f"* {line}" if starts else f"  {line.strip()}" if item else line)
    lines[:] = made


def setup(app: Sphinx) -> None:
    """What Sphinx calls when it has read this file."""
    app.connect("autodoc-process-docstring", bullets)
