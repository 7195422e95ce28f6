"""Settings: the border between a TOML file (keys with unit suffixes, degrees) and a flight (SI, radians)."""

from harness.error import SettingsError
from harness.settings.experiment import Experiment
from harness.settings.file import (
    SettingsFile,
    flight_from_document,
    load_flight,
    overridden,
    read_settings,
    settings_from_text,
)
from harness.settings.former_names import without_former_names
from harness.settings.keys import file_key, put
from harness.settings.written import document

__all__ = [
    "Experiment",
    "SettingsError",
    "SettingsFile",
    "document",
    "file_key",
    "flight_from_document",
    "load_flight",
    "overridden",
    "put",
    "read_settings",
    "settings_from_text",
    "without_former_names",
]
