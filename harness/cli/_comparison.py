"""What `compare` and `report` share: the flights of a directory, their origin, and the margins that judge them."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from harness.cli._input import BadInput

if TYPE_CHECKING:
    from harness.margins import Assess
    from harness.verdict.comparison import Comparison
    from harness.verdict.report import Origin


def read_comparison(folder: Path, baseline: str, overrides: tuple[str, ...]) -> tuple[Comparison, Origin]:
    """The comparison of a run's directory. BadInput when it holds none, with what is missing."""
    from harness.runs.results import load_results, mixed_versions
    from harness.runs.store import StoreError, last_run
    from harness.verdict.comparison import compare
    from harness.verdict.pairs import CompareError
    from harness.verdict.report import origin_of

    try:
        run = last_run(folder)
        assess = _assess(folder, run["settings"], run["file"], [*_given(run["command"]), *overrides])
        mixed = mixed_versions(folder)
        if mixed:
            raise BadInput(
                f"{folder}: its flights are of different versions, which a comparison must not mix: "
                f"{'; '.join(mixed)}. Fly them again into another directory"
            )
        return compare(load_results(folder), assess, baseline), origin_of(str(folder), run)
    except (StoreError, CompareError) as error:
        text = str(error)
        raise BadInput(text if text.startswith(str(folder)) else f"{folder}: {text}") from None


def _assess(folder: Path, settings: str, file: str, overrides: list[str]) -> Assess:
    """The margins in the text of the run's settings, and those given on the command line."""
    from harness.settings import SettingsError, settings_from_text

    for override in overrides:
        if not override.strip().startswith("assess."):
            raise BadInput(f"--set {override}: only margins can be set here, as in assess.sideslip_deg=3")
    try:
        return settings_from_text(settings, Path(f"{folder} (its copy of {file})"), overrides).assess()
    except SettingsError as error:
        raise BadInput(str(error)) from None


def _given(command: str) -> Iterator[str]:
    """The margins that the run's own command line set."""
    words = shlex.split(command)
    for i, word in enumerate(words):
        text = word.removeprefix("--set=") if word.startswith("--set=") else words[i + 1] if word == "--set" else ""
        if text.strip().startswith("assess."):
            yield text
