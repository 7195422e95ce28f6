"""The flights of a run that may be compared, and the margins that judge them."""

import shlex
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from harness.margins import Assess
from harness.runs.results import load_results, mixed_versions
from harness.runs.store import StoreError, last_run
from harness.settings import settings_from_text

if TYPE_CHECKING:
    import pandas as pd


def flights_and_margins(folder: Path, overrides: Sequence[str] = ()) -> "tuple[pd.DataFrame, Assess]":
    """The flights of a run, and the margins that its settings and command line say; `overrides`: assess.KEY=VALUE.

    Raises `SettingsError`; `StoreError` without results, or when the flights are of different versions.
    """
    of = last_run(folder)
    where = Path(f"{folder} (its copy of {of['file']})")
    assess = settings_from_text(of["settings"], where, [*_given(of["command"]), *overrides]).assess()
    if mixed := mixed_versions(folder):
        raise StoreError(
            f"{folder}: its flights are of different versions, which a comparison must not mix: {'; '.join(mixed)}. "
            "Fly them again into another directory"
        )
    return load_results(folder), assess


def _given(command: str) -> Iterator[str]:
    """The margins that a command line set."""
    words = shlex.split(command)
    for i, word in enumerate(words):
        text = word.removeprefix("--set=") if word.startswith("--set=") else words[i + 1] if word == "--set" else ""
        if text.strip().startswith("assess."):
            yield text
