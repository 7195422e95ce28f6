"""Shared by `compare`, `report` and `show`: the selection of flights, their origin, and the margins."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from harness.cli._input import BadInput

if TYPE_CHECKING:
    from harness.verdict.comparison import Comparison
    from harness.verdict.control_variates import Reduced
    from harness.verdict.report import Origin


def read_comparison(
    folders: tuple[Path, ...],
    overrides: tuple[str, ...] = (),
    by: str | None = None,
    baseline: str | None = None,
    where: tuple[str, ...] = (),
) -> tuple[Comparison, Origin]:
    """The comparison of directories of runs. BadInput when it holds none, with what is missing."""
    from harness.comparison import compare_chosen
    from harness.error import SettingsError
    from harness.runs.comparable import comparable
    from harness.runs.journal import StoreError
    from harness.runs.store import last_run
    from harness.settings.columns import DIRECTORY
    from harness.verdict.pairs import CompareError
    from harness.verdict.report import origin_of

    for override in overrides:
        if not override.strip().startswith("assess."):
            raise BadInput(f"--set {override}: only margins can be set here, as in assess.sideslip_deg=3")
    place = " and ".join(map(str, folders))
    by = by or (DIRECTORY if len(folders) > 1 else None)
    try:
        given = comparable(folders, by, overrides)
        comparison = compare_chosen(given, by, _value(baseline), wanted(where))
        return comparison, origin_of(tuple(map(str, folders)), [last_run(folder) for folder in folders])
    except SettingsError as error:
        raise BadInput(str(error)) from None
    except (StoreError, CompareError) as error:
        text = str(error)
        raise BadInput(text if text.startswith(str(folders[0])) else f"{place}: {text}") from None


def reduced(comparison: Comparison, folders: tuple[Path, ...]) -> list[Reduced]:
    """The saving by a cheaper plant as a control variate: see `reductions`. BadInput if no flight can serve as one."""
    from harness.verdict.control_variates import reductions
    from harness.verdict.pairs import CompareError

    try:
        return reductions(comparison.table)
    except CompareError as error:
        raise BadInput(f"{' and '.join(map(str, folders))}: {error}") from None


def wanted(where: tuple[str, ...]) -> dict[str, object]:
    """KEY=VALUE texts as settings; a key that is given twice keeps all its values."""
    chosen: dict[str, object] = {}
    for text in where:
        key, equals, value = text.partition("=")
        if not equals:
            raise BadInput(f"--where {text}: must be KEY=VALUE, as in aircraft=aerosonde")
        known = chosen.get(key.strip())
        values = [*(known if isinstance(known, list) else []), _value(value)]
        chosen[key.strip()] = values
    return chosen


def _value(text: str | None) -> object:
    """A value as a settings file would have it: a number, a list or a word; None for none."""
    from harness.toml_text import value_of

    if text is None:
        return None
    value = value_of(text)
    if isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    return tuple(value) if isinstance(value, list) else value
