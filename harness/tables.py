"""The cells of a table of flights: which metrics, under which heading, with three digits."""

from collections.abc import Mapping
from types import MappingProxyType

METRICS: Mapping[str, tuple[str, str, float]] = MappingProxyType(
    {  # heading, unit, how many of them make the metric's own unit
        "convergence_time_s": ("settles", "s", 1.0),
        "range_error_rms_m": ("error", "m rms", 1.0),
        "range_error_peak_m": ("error", "m peak", 1.0),
        "overshoot_m": ("overshoot", "m", 1.0),
        "saturation_fraction": ("saturated", "%", 100.0),
        "command_activity_deg_s2": ("activity", "deg/s2", 1.0),
        "bank_peak_deg": ("bank", "deg peak", 1.0),
        "sideslip_peak_deg": ("sideslip", "deg peak", 1.0),
    }
)


def number(value: float | None, scale: float = 1.0) -> str:
    """So many times the value with three significant digits, or a dash for none."""
    if value is None:
        return "-"
    value *= scale
    return f"{value:.3g}" if abs(value) >= 0.0005 else "0"
