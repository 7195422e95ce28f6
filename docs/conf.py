"""The site's settings, for Sphinx: `make docs` builds it offline, and a warning, such as a broken link, is an error."""

from dataclasses import MISSING, Field, fields, is_dataclass
from importlib.metadata import version as version_of
from typing import Any, get_type_hints

from sphinx.application import Sphinx

from autopilot.quantities import About, Unit
from harness.settings.number import in_file
from harness.settings.table import schema_of

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


_SI = {"deg": "rad", "deg_s": "rad/s", "deg_s2": "rad/s²", "mps": "m/s", "mps2": "m/s²", "mps_per_m": "(m/s)/m"}
_SI |= {"m2": "m²", "rad2": "rad²", "m2_s2": "m²/s²"}  # of a file's unit inside; what is not here is the same


def signature(app: Sphinx, what: str, name: str, part: object, *others: object) -> tuple[str, None] | None:
    """A part of a flight by its fields' names: `list_fields` says the rest of the declaration, which is long."""
    declared = _declared(part)
    return (f"(*, {', '.join(field.name for field in declared)})", None) if declared else None


def list_fields(app: Sphinx, what: str, name: str, part: type, options: object, lines: list[str]) -> None:
    """Adds a part's fields to its docstring, each with its meaning, unit and default as they are declared."""
    declared = _declared(part)
    if not declared:
        return
    settings = {setting.name: setting for setting in schema_of(part).settings.values()}
    hints = get_type_hints(part, include_extras=True)
    for field in declared:
        unit = settings[field.name].unit
        about = [mark.text for mark in getattr(hints[field.name], "__metadata__", ()) if isinstance(mark, About)]
        about = about or [f"see `{hints[field.name].__name__}`"]
        units = [_SI.get(unit.suffix, unit.suffix)] if unit.suffix else []
        default = [] if field.default is MISSING else [f"default `{_default(field.default, unit)}`"]
        lines.append(f"* `{field.name}`: {'; '.join([*about, *units, *default])}.".replace("|", "\\|"))
    lines.append("")


def _default(value: object, unit: Unit) -> str:
    if unit.suffix.startswith("deg") and isinstance(value, float) and value:
        return f"math.radians({in_file(value, unit):g})"
    return repr(value)


def skip(app: Sphinx, what: str, name: str, value: object, is_skipped: bool, options: object) -> bool | None:
    """Leaves out what Python itself says of the field of a named tuple."""
    return True if (getattr(value, "__doc__", None) or "").startswith("Alias for field number") else None


def _declared(part: object) -> tuple[Field[Any], ...]:
    """The fields of a part of a flight; none of anything else."""
    if not isinstance(part, type) or not is_dataclass(part):
        return ()
    hints = get_type_hints(part, include_extras=True)
    marks = [mark for hint in hints.values() for mark in getattr(hint, "__metadata__", ())]
    return fields(part) if any(isinstance(mark, About) for mark in marks) else ()


def setup(app: Sphinx) -> None:
    """What Sphinx calls when it has read this file."""
    app.connect("autodoc-process-signature", signature)
    app.connect("autodoc-process-docstring", list_fields)
    app.connect("autodoc-skip-member", skip)
