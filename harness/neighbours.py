"""The packages `autopilot` and `aircraft`, which lie beside this one; a user's own file may have one of these names."""

from importlib.util import find_spec
from pathlib import Path

_FOLDER = Path(__file__).resolve().parent.parent


def in_the_way() -> str:
    """The file that Python would take for one of the two, and what to do, in one line; empty if there is none."""
    for name in ("aircraft", "autopilot"):
        spec = find_spec(name)
        file = Path(spec.origin).resolve() if spec and spec.origin else None
        if file and file != _FOLDER / name / "__init__.py":
            return (
                f"{file}: stands in the way of the harness's own package {name}: rename it, or start in another folder"
            )
    return ""
