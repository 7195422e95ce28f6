"""What `compare` and `report` share: the flights of a directory, their origin, and the margins that judge them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from harness.cli._input import BadInput

if TYPE_CHECKING:
    from harness.verdict.comparison import Comparison
    from harness.verdict.report import Origin


def read_comparison(folder: Path, baseline: str, overrides: tuple[str, ...]) -> tuple[Comparison, Origin]:
    """The comparison of a run's directory. BadInput when it holds none, with what is missing."""
    from harness.comparison import flights_and_margins
    from harness.error import SettingsError
    from harness.runs.store import StoreError, last_run
    from harness.verdict.comparison import compare_flights
    from harness.verdict.pairs import CompareError
    from harness.verdict.report import origin_of

    for override in overrides:
        if not override.strip().startswith("assess."):
            raise BadInput(f"--set {override}: only margins can be set here, as in assess.sideslip_deg=3")
    try:
        flights, assess = flights_and_margins(folder, overrides)
        run = last_run(folder)
        comparison = compare_flights(flights, assess, baseline=baseline, question=str(run["question"] or ""))
        return comparison, origin_of(str(folder), run)
    except SettingsError as error:
        raise BadInput(str(error)) from None
    except (StoreError, CompareError) as error:
        text = str(error)
        raise BadInput(text if text.startswith(str(folder)) else f"{folder}: {text}") from None
