"""What a search leaves beside its flights: the best settings as files that `harness fly` takes, and all its trials."""

import csv
from pathlib import Path

from harness.files import replacing
from harness.search.tune import Attempt, Tuning
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
        with replacing(path) as partial:
            partial.write_text(_settings(tuning, attempt), encoding="utf-8")
        paths.append(path)
    return paths


def write_trials(tuning: Tuning, folder: Path) -> Path:
    """Writes one line for each trial: its settings, what it reached, what refused it, its flights. Raises OSError."""
    keys = [d.key for d in tuning.space.dimensions]
    path = folder / TRIALS
    with replacing(path) as partial, partial.open("w", encoding="utf-8", newline="") as text:
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(["trial", *keys, *tuning.goals, "refused_by", "flights"])
        for i, attempt in enumerate(tuning.attempts, start=1):
            reached = attempt.goals or [""] * len(tuning.goals)
            candidate = attempt.candidate
            settings = [candidate.values[key] for key in keys]
            writer.writerow([i, *settings, *reached, attempt.refused_by, " ".join(candidate.keys)])
    return path


def _settings(tuning: Tuning, attempt: Attempt) -> str:
    """The flight of the condition in which an attempt does worst, as a settings file."""
    values = ", ".join(f"{key} = {value!r}" for key, value in attempt.candidate.values.items())
    count = len(tuning.space.conditions)
    condition = f"# The condition in which it does worst, of {count}.\n" if count > 1 else ""
    return f"# Found by harness tune in {tuning.trials} trials: {values}\n{condition}\n" + toml(
        attempt.candidate.flights[tuning.decisive(attempt)]
    )
