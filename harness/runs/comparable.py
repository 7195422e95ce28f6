"""The flights of one run, or of several, that may be compared, and the margins that judge them."""

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from harness import key
from harness.margins import Assess
from harness.runs.journal import StoreError
from harness.runs.recall import load_laws
from harness.runs.results import load_results, versions
from harness.runs.store import last_run, overrides_of
from harness.settings import settings_from_text
from harness.settings.columns import DIRECTORY, DRAWN

if TYPE_CHECKING:
    import pandas as pd


class Comparable(NamedTuple):
    """The input of a comparison."""

    flights: "pd.DataFrame"
    assess: Assess  # of the first directory
    question: str  # of the first directory
    changed: tuple[str, ...] = ()  # what the versions of the directories differ in


def comparable(folders: Sequence[Path], by: str | None = None, overrides: Sequence[str] = ()) -> Comparable:
    """The flights of these directories; `overrides`: assess.KEY=VALUE.

    With `by` = `DIRECTORY` a flight may be in each of them, and their versions may differ. Raises `SettingsError`;
    `StoreError` without results, or when flights of different versions would be mixed. Flights of earlier physics or
    metrics are a warning.
    """
    import pandas as pd

    question, assess = _asked(folders[0], overrides)
    for folder in folders:
        load_laws(folder)
    known = [versions(folder) for folder in folders]
    for folder, of in zip(folders, known, strict=True):
        _warn_of_earlier(folder, of)
    if len(folders) == 1:
        _refuse_mixed(known[0], str(folders[0]))
        return Comparable(load_results(folders[0]), assess, question)
    names = list(map(str, folders))
    if len(set(names)) < len(names):
        raise StoreError(f"{names[0]}: is named twice")
    parts = [load_results(folder).assign(**{DIRECTORY: name}) for folder, name in zip(folders, names, strict=True)]
    flights = pd.concat(parts, ignore_index=True)
    flights.attrs[DRAWN] = any(part.attrs[DRAWN] for part in parts)
    if by == DIRECTORY:
        for of, name in zip(known, names, strict=True):
            _refuse_mixed(of, name)
        every = dict.fromkeys(what for of in known for what in of)
        changed = tuple(what for what in every if len({tuple(of.get(what, ())) for of in known}) > 1)
        return Comparable(flights, assess, question, changed)
    pooled: dict[str, dict[str, int]] = {}
    for of in known:
        for what, counts in of.items():
            for which, count in counts.items():
                pooled.setdefault(what, {}).setdefault(which, 0)
                pooled[what][which] += count
    _refuse_mixed(pooled, " and ".join(names))
    return Comparable(flights.drop_duplicates("key").reset_index(drop=True), assess, question)


def _asked(folder: Path, overrides: Sequence[str]) -> tuple[str, Assess]:
    """The question and the margins that the settings and the command line of the last run say."""
    of = last_run(folder)
    where = Path(f"{folder} (its copy of {of['file']})")
    given = [text for text in overrides_of(of["words"]) if text.startswith("assess.")]
    assess = settings_from_text(of["settings"], where, [*given, *overrides]).assess()
    return str(of["question"] or ""), assess


def _refuse_mixed(of: dict[str, dict[str, int]], place: str) -> None:
    mixed = [
        f"{what} has {len(counts)} versions, of {' and '.join(map(str, counts.values()))} flights"
        for what, counts in of.items()
        if len(counts) > 1
    ]
    if mixed:
        raise StoreError(
            f"{place}: its flights are of different versions, which a comparison must not mix: {'; '.join(mixed)}. "
            "Fly them again into another directory"
        )


def _warn_of_earlier(folder: Path, of: Mapping[str, Mapping[str, int]]) -> None:
    for what, now in (("physics", key.PHYSICS_VERSION), ("metrics", key.METRICS_VERSION)):
        if then := [version for version in of.get(what, ()) if version != str(now)]:
            warnings.warn(
                f"{folder}: flown with version {' and '.join(then)} of the {what}, of which this harness has version "
                f"{now}: values have moved; the same command flies them anew: {last_run(folder)['command']}",
                UserWarning,
                stacklevel=3,
            )
