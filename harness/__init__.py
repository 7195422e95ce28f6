"""Flies a guidance law on a kinematic and on a 6-DOF aircraft, and measures whether coordinated flight holds.

`load_flight(path)` reads a flight, `simulate(flight)` flies it, `read_flight(path)` reads a recording back;
`load_results(dir)` reads the results of `harness run`.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from harness.loop import simulate
    from harness.review.reading import read_recording as read_flight
    from harness.runs.results import load_results
    from harness.settings import load_flight

__all__ = ["load_flight", "load_results", "read_flight", "simulate"]

_HOME = {
    "load_flight": ("harness.settings", "load_flight"),
    "load_results": ("harness.runs.results", "load_results"),
    "read_flight": ("harness.review.reading", "read_recording"),
    "simulate": ("harness.loop", "simulate"),
}


def __getattr__(name: str) -> Any:
    """Loads a public name when it is first asked for: `harness --help` needs none of them."""
    if name not in _HOME:
        raise AttributeError(f"module 'harness' has no attribute {name!r}")
    module, attribute = _HOME[name]
    return getattr(import_module(module), attribute)
