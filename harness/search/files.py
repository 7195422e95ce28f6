"""The files of a search: its results as settings files for `harness fly`, and a table of all trials."""

import csv
from collections.abc import Sequence
from pathlib import Path

from harness.files import replacing
from harness.search.falsify import Falsification
from harness.search.flown import Candidate
from harness.search.space import Space
from harness.search.tune import Tuning
from harness.settings.written import toml

TRIALS = "trials.csv"


def write_best(tuning: Tuning, folder: Path) -> list[Path]:
    """Writes best.toml, of several goals best_1.toml and so on, in place of an earlier search's. Raises OSError."""
    for earlier in (*folder.glob("best.toml"), *folder.glob("best_*.toml")):
        earlier.unlink()
    front = tuning.front
    paths = []
    for i, attempt in enumerate(front, start=1):
        path = folder / ("best.toml" if len(tuning.goals) == 1 else f"best_{i}.toml")
        what = f"Found by harness tune in {tuning.trials} trials"
        _write_flight(path, what, attempt.candidate, tuning.space, tuning.decisive(attempt))
        paths.append(path)
    return paths


def write_trials(tuning: Tuning, folder: Path) -> Path:
    """Writes one line for each trial: its settings, what it reached, what refused it, its flights. Raises OSError."""
    rows = [
        (attempt.candidate, [*(attempt.goals or [""] * len(tuning.goals)), attempt.refused_by])
        for attempt in tuning.attempts
    ]
    return _write_table(folder, tuning.space, [*tuning.goals, "refused_by"], rows)


def write_counterexample(search: Falsification, folder: Path) -> Path | None:
    """Writes the flight that breaks the requirement most, in place of an earlier search's. Raises OSError."""
    path = folder / "counterexample.toml"
    path.unlink(missing_ok=True)
    if not search.broken:
        return None
    trial = search.broken[0]
    what = f"Found by harness falsify in {len(search.trials)} trials to break {search.requirement}"
    _write_flight(path, what, trial.candidate, search.space, trial.decisive)
    return path


def write_probes(search: Falsification, folder: Path) -> Path:
    """Writes one line for each trial: its settings, how robust it is, whether it is uniform. Raises OSError."""
    rows = [
        (trial.candidate, ["" if trial.robustness is None else trial.robustness, trial.broken, trial.uniform])
        for trial in search.trials
    ]
    return _write_table(folder, search.space, ["robustness", "broken", "uniform"], rows)


def _write_table(
    folder: Path, space: Space, heads: Sequence[str], rows: Sequence[tuple[Candidate, Sequence[object]]]
) -> Path:
    keys = [d.key for d in space.dimensions]
    path = folder / TRIALS
    with replacing(path) as partial, partial.open("w", encoding="utf-8", newline="") as text:
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(["trial", *keys, *heads, "flights"])
        for i, (candidate, cells) in enumerate(rows, start=1):
            writer.writerow([i, *(candidate.values[key] for key in keys), *cells, " ".join(candidate.keys)])
    return path


def _write_flight(path: Path, what: str, candidate: Candidate, space: Space, decisive: int) -> None:
    """The flight of the condition in which a trial does worst, as a settings file."""
    values = ", ".join(f"{key} = {value!r}" for key, value in candidate.values.items())
    count = len(space.conditions)
    condition = f"# The condition in which it does worst, of {count}.\n" if count > 1 else ""
    with replacing(path) as partial:
        partial.write_text(f"# {what}: {values}\n{condition}\n" + toml(candidate.flights[decisive]), encoding="utf-8")
