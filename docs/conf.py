"""The site's settings, for Sphinx: `make docs` builds it offline, and a warning, such as a broken link, is an error."""

from importlib.metadata import version as version_of

project = "standoff-harness"
author = "The standoff-harness authors"
copyright = f"2026, {author}"  # noqa: A001 (the name that Sphinx reads)
version = release = version_of("standoff-harness")

extensions = ["myst_nb", "sphinx.ext.autodoc"]
myst_heading_anchors = 3
myst_enable_extensions = ["colon_fence"]  # no dollarmath: a page with formulas would load MathJax from the network
nb_execution_mode = "off"  # the notebook holds its outputs; a test executes it anew

default_role = "code"  # docstrings are plain text with `names`
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True

html_theme = "furo"
html_title = "standoff-harness"
html_show_sphinx = False
html_theme_options = {"navigation_with_keys": True, "footer_icons": []}
