"""What tests are built from: flights, logs, tables of results, matrix files, copied airframes, the command line."""

import itertools
import math
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner, Result
from numpy.typing import ArrayLike

import aircraft
import harness
from autopilot.guidance import Context, Guidance, LawStep
from autopilot.laws import law
from harness.cli.main import harness as command_line
from harness.flight import Flight
from harness.log import COLUMNS, FlightLog
from harness.log.metric import METRICS
from harness.plants.plant import Outcome
from harness.runs.matrix import read_matrix
from harness.runs.run import Options, Progress, run
from harness.settings import read_settings

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
EXPERIMENTS = ROOT / "experiments"

DRIVERS = [*Path("/usr/share/vulkan/icd.d").glob("*.json"), *Path("/etc/vulkan/icd.d").glob("*.json")]
drawing = pytest.mark.skipif(
    not DRIVERS and os.environ.get("CI") != "true",  # .ci/run installs one: without it the test fails there
    reason="no Vulkan driver to draw with: apt-get install --no-install-recommends mesa-vulkan-drivers",
)

FLIGHT = Flight(plant="kinematic", law=law("nftsm", "paper_1"), duration=20.0)  # tests fly replace(FLIGHT, ...)
SIXDOF = replace(FLIGHT, plant="sixdof")


MATRIX = """\
title = "A title"
question = "A question?"
[flight]
plant = "kinematic"
duration_s = 2.0
[flight.law]
name = "nftsm"
gains = "paper_1"
[matrix]
plant = ["kinematic", "sixdof"]
"start.heading_deg" = { uniform = [0.0, 90.0] }
seed = { start = 0, count = 5 }
"""


@dataclass(frozen=True)
class OwnLaw:
    """A law of a test's own: `make` starts it."""

    make: Callable[[], LawStep]
    standoff: float = 200.0
    max_heading_rate: float = math.radians(5.0)
    command: Literal["heading_rate", "course_rate"] = "heading_rate"

    def start(self, context: Context) -> LawStep:
        return self.make()

    def broken_conditions(self, speed_ratio: float) -> list[str]:
        return []


def turning(rate: float) -> Guidance:
    """An answer of a law that commands this heading rate, rad/s, and tells nothing else."""
    return Guidance(rate, 0.0, 0.0, 0.0, 0.0, rate)


HERE = Options(workers=0, log="none")  # in the test's own process
WORKERS = Options(workers=2, log="none")


def words_of(*words: object) -> list[str]:
    """The command line that runs `harness` with these words in a process of its own."""
    return [sys.executable, "-m", "harness", *map(str, words)]


def command(*words: object) -> subprocess.CompletedProcess[str]:
    """`harness` in a process of its own, as a user runs it."""
    return subprocess.run(words_of(*words), capture_output=True, text=True, check=False, timeout=300)


def invoke(*words: object) -> Result:
    """`harness` in this process: a process of its own would import pandas and SciPy each time."""
    return CliRunner().invoke(command_line, [str(word) for word in words])


def python(code: str) -> subprocess.CompletedProcess[str]:
    """A new Python process that runs `code`: what it imports is its own."""
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, cwd=ROOT)


def write(path: Path, text: str) -> Path:
    """The file with this text."""
    path.write_text(text, encoding="utf-8")
    return path


def fly_matrix(file: Path, out: Path, *overrides: str, options: Options = HERE) -> Progress:
    """Flies the file's matrix into the directory and returns the last progress."""
    *_, progress = run(read_matrix(read_settings(file, overrides)), out, options)
    return progress


def digests(out: Path) -> dict[str, str]:
    """The digest of each flight of a run by its key; no key may stand there twice."""
    results = harness.load_results(out)
    assert results["key"].is_unique
    return dict(zip(results["key"], results["digest"], strict=True))


def copied_airframe(name: str, folder: Path) -> Path:
    """A copy of a shipped airframe as `folder`, whose model is named after it."""
    shutil.copytree(aircraft.folder(name), folder)
    (folder / f"{name}.xml").rename(folder / f"{folder.name}.xml")
    return folder


def log_of(columns: Mapping[str, ArrayLike], duration: float = 100.0) -> FlightLog:
    """A log at 20 Hz, half a lap in 100 s at 13 m/s, with these columns; the others are 0, or NaN as of any plant."""
    time = np.arange(0.0, duration, 0.05)
    unknown = dict.fromkeys(("bank", "sideslip", "lateral_acceleration"), np.nan)
    table = np.zeros((len(time), len(COLUMNS)))
    angle = 0.5 * math.tau * time / 100.0
    circle = {"north": 200.0 * np.cos(angle), "east": 200.0 * np.sin(angle)}
    for name, values in {"time": time, "airspeed": 13.0, "altitude": 150.0, **circle, **unknown, **columns}.items():
        table[:, COLUMNS.index(name)] = values
    return FlightLog(replace(FLIGHT, duration=duration), Outcome.COMPLETED, "", table)


# Tables of results, as `harness.load_results` gives them, whose comparison is known

SEEDS = 12
SETTINGS: Mapping[str, object] = {
    "plant": "kinematic", "aircraft": "ultra_stick_25e", "seed": 0, "duration_s": 100.0, "guidance_period_s": 0.05,
    "law.name": "smc", "law.gains": "paper", "law.k2": math.nan, "law.max_heading_rate_deg_s": 5.0,
    "law.airspeed": "nominal", "law.standoff_m": 200.0, "start.airspeed_mps": 13.0,
    "wind.steady_mps": (0.0, 0.0), "wind.turbulence": "none", "estimator.kind": "truth",
}  # fmt: skip
QUIET: Mapping[str, float] = {
    **dict.fromkeys(METRICS, 0.0), "convergence_time_s": 40.0, "heading_rate_gain": 1.0, "turn_ratio": 1.0,
    "heading_rate_lag_s": 0.001, "bank_reserve_deg": 30.0, "laps": 1.0, "goes_round": 1.0,
}  # fmt: skip


def result(
    plant: str, seed: int = 0, metrics: Mapping[str, float] = QUIET, settings: Mapping[str, object] = {}
) -> dict[str, object]:
    """A row of results: a completed flight with these metrics, whose heading at the start is drawn from the seed."""
    chosen = {**SETTINGS, "start.heading_deg": 30.0 + seed, **settings, "plant": plant, "seed": seed}
    key = "-".join(map(str, chosen.values()))
    ended = {"outcome": "completed", "reason": "", "digest": key, "feasibility_margin_deg_s": 1.0, "seconds": 0.1}
    return {"key": key, **ended, **chosen, **metrics}


def results(rows: Iterable[Mapping[str, object]]) -> pd.DataFrame:
    """The table of these rows."""
    return pd.DataFrame(list(rows))


def result_matrix(axes: Mapping[str, Sequence[object]] = {}) -> pd.DataFrame:
    """All flights of these axes on two plants with all seeds, each with the metrics of `QUIET`."""
    return results(
        result(plant, seed, settings=dict(zip(axes, values, strict=True)))
        for plant, seed in itertools.product(("kinematic", "sixdof"), range(SEEDS))
        for values in itertools.product(*axes.values())
    )


def shifted(
    flights: pd.DataFrame, metric: str, by: float, scatter: float = 0.01, where: Mapping[str, object] = {}
) -> pd.DataFrame:
    """The table with this metric of the 6-DOF flights that are set so moved by `by`, and by each seed's own scatter."""
    flights = flights.copy()
    chosen = flights["plant"] == "sixdof"
    for key, value in where.items():
        chosen &= flights[key] == value
    seeds = flights["seed"][chosen]
    flights.loc[chosen, metric] += by + scatter * np.random.default_rng(3).normal(size=SEEDS)[seeds]
    return flights


def chromium() -> str:
    """Where Chromium is; without it the test is skipped, but for CI, where it has to be."""
    for name in ("chromium", "chromium-browser", "google-chrome"):
        if found := shutil.which(name):
            return found
    if os.environ.get("CI"):
        pytest.fail("no Chromium to open the page with")
    pytest.skip("no Chromium to open the page with")
