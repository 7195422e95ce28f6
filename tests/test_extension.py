"""A law, plant, metric, margin, airframe, severity and estimator of a user's own, added as CONTRIBUTING.md says.

The three packages are copied, the one or two files of each extension are written, and the commands are run on the copy:
what is declared once is listed, flown, stored, compared and judged like all the others.
"""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from tests.builders import EXPERIMENTS, ROOT, write

LAW = '''
"""A law that flies straight on."""

from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated

from autopilot.guidance import Guidance, LawStep, Observation
from autopilot.quantities import About
from autopilot.standoff import StandoffLaw

GAIN_SETS = MappingProxyType({"usual": {"rate": 0.0}})


@dataclass(frozen=True, slots=True, kw_only=True)
class Straight(StandoffLaw):
    """Commands one heading rate for ever."""

    gains: Annotated[str, About("the named set the gains started from")] = "custom"
    rate: Annotated[float, About("rad/s: the heading rate that is commanded")]

    def start(self) -> LawStep:
        rate = self.rate

        def step(observation: Observation) -> Guidance:
            return Guidance(rate, 0.0, 0.0, 0.0, 0.0, rate)

        return step

    def broken_conditions(self, speed_ratio: float) -> list[str]:
        return []
'''
PLANT = '''
"""The plant `weak`: it turns at nine tenths of the commanded rate."""

from dataclasses import dataclass

from harness.plants.kinematic import Kinematic
from harness.plants.plant import Flying, Start
from harness.plants.state import State
from harness.world.air import Air


@dataclass(frozen=True, slots=True)
class Weak:
    """Eq. (1) with nine tenths of the heading rate."""

    def start(self, start: Start, air: Air) -> Flying:
        return _WeakFlying(Kinematic().start(start, air))


class _WeakFlying:
    def __init__(self, kinematic: Flying) -> None:
        self._kinematic = kinematic

    @property
    def state(self) -> State:
        return self._kinematic.state

    def advance(self, heading_rate: float, period: float) -> None:
        self._kinematic.advance(0.9 * heading_rate, period)
'''
FILES = {"autopilot/straight.py": LAW, "harness/plants/weak.py": PLANT}
ENTRIES = {  # file: what stands there, and what is written before it
    "autopilot/laws.py": (
        ("from autopilot import ", "from autopilot import straight\n"),
        ('        "smc": LawKind(', '        "straight": LawKind(straight.Straight, straight.GAIN_SETS, "usual"),\n'),
    ),
    "harness/plants/ladder.py": (
        ("from harness.plants.plant import", "from harness.plants.weak import Weak\n"),
        (
            '        "lagged": PlantKind(',
            '        "weak": PlantKind(about="It turns too slowly.", adds="weakness", make=lambda setup: Weak()),\n',
        ),
    ),
    "harness/log/metric.py": (
        (
            '    Metric(\n        name="turn_ratio"',
            "    Metric(\n"
            '        name="distance_flown_m", unit="m", meaning="over the ground", heading="distance flown",\n'
            "        measure=lambda signals: float(13.0 * signals.log['time'][-1]), in_short_tables=True,\n"
            "    ),\n"
            "    Metric(\n"
            '        name="ends_north", unit=YES_OR_NO, meaning="it ends north of the origin", heading="ends north",\n'
            "        measure=lambda signals: bool(signals.log['north'][-1] > 0.0), in_short_tables=True,\n"
            "    ),\n",
        ),
    ),
    "harness/margins.py": (
        ("    sideslip: Annotated[", '    shyness: Annotated[Degrees, Gt(0), About("Ours: an example")] = 0.1\n'),
    ),
    "harness/world/wind.py": (('"severe": 45.0', '"strong": 38.0 * KNOT, '),),
    "autopilot/estimator.py": (
        (
            "@dataclass(frozen=True, slots=True, kw_only=True)\nclass Estimator:",
            "class Raw:\n"
            '    """Every measurement is believed."""\n\n'
            "    def update(self, measured: Measurement) -> Measurement:\n"
            "        r, azimuth = measured\n"
            "        self.known = (r * math.cos(azimuth), r * math.sin(azimuth))\n"
            "        return Measurement(0.0, 0.0)\n\n"
            "    def miss(self) -> None:\n"
            "        pass\n\n"
            "    def ahead(self, known: Sequence[Any], age: Any) -> Estimate:\n"
            "        x, y = known\n"
            "        return Estimate(x, y, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0)\n\n\n",
        ),
        ('        "ekf": EstimatorKind(', '        "raw": EstimatorKind("as measured", lambda settings: Raw()),\n'),
    ),
}
MATRIX = """
[flight]
plant = "kinematic"
duration_s = 20.0
law = { name = "straight" }
[matrix]
plant = ["kinematic", "weak"]
"law.rate" = [0.02, 0.05]
[assess]
shyness_deg = 3.0
"""


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The packages with all extensions."""
    folder = tmp_path_factory.mktemp("extended")
    for package in ("autopilot", "aircraft", "harness"):
        shutil.copytree(ROOT / package, folder / package, ignore=shutil.ignore_patterns("__pycache__"))
    for name, text in FILES.items():
        write(folder / name, text.lstrip())
    for name, entries in ENTRIES.items():
        text = (folder / name).read_text(encoding="utf-8")
        for before, entry in entries:
            assert text.count(before) == 1, f"{name}: {before}"
            text = text.replace(before, entry + before)
        write(folder / name, text)
    shutil.copytree(folder / "aircraft" / "ultra_stick_25e", folder / "aircraft" / "my_plane")
    (folder / "aircraft" / "my_plane" / "ultra_stick_25e.xml").rename(folder / "aircraft" / "my_plane" / "my_plane.xml")
    write(folder / "matrix.toml", MATRIX)
    return folder


def harness(tree: Path, *words: object) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "harness", *map(str, words)], cwd=tree, env={**os.environ, "PYTHONPATH": str(tree)},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def flown(tree: Path, **settings: object) -> Mapping[str, Any]:
    words = [f"--set={key.replace('__', '.')}={value}" for key, value in {"duration_s": 10, **settings}.items()]
    answer: Mapping[str, Any] = json.loads(harness(tree, "fly", EXPERIMENTS / "stationary.toml", "--json", *words))
    assert answer["outcome"] == "completed"
    return answer


@pytest.mark.parametrize(
    ("kind", "name", "said"),
    [
        ("laws", "straight", "Commands one heading rate for ever."),
        ("plants", "weak", "It turns too slowly."),
        ("aircraft", "my_plane", "UMN UAV Lab"),
        ("metrics", "distance_flown_m", "over the ground"),
        ("margins", "assess.shyness_deg", "5.7295"),
    ],
)
def test_what_is_declared_is_listed(tree: Path, kind: str, name: str, said: str) -> None:
    assert [line for line in harness(tree, "list", kind).splitlines() if name in line and said in line]


def test_a_law_is_flown_with_its_default_gains(tree: Path) -> None:
    answer = flown(tree, law__name="straight", law__gains="usual", plant="kinematic")
    assert answer["flight"]["law"]["rate"] == 0.0
    assert answer["metrics"]["command_activity_deg_s2"] == 0.0


def test_a_plant_is_flown_and_is_another_rung(tree: Path) -> None:
    assert flown(tree, plant="weak")["digest"] != flown(tree, plant="kinematic")["digest"]


def test_a_metric_is_measured_whether_it_is_a_number_or_true(tree: Path) -> None:
    metrics = flown(tree, plant="kinematic")["metrics"]
    assert metrics["distance_flown_m"] == pytest.approx(130.0)
    assert metrics["ends_north"] in (True, False)


def test_an_airframe_is_flown_by_its_name(tree: Path) -> None:
    assert flown(tree, aircraft="my_plane")["flight"]["aircraft"] == "my_plane"


def test_a_severity_of_turbulence_is_flown(tree: Path) -> None:
    digests = {flown(tree, plant="kinematic", wind__turbulence=name)["digest"] for name in ("strong", "severe")}
    assert len(digests) == 2


def test_an_estimator_is_flown(tree: Path) -> None:
    flights = (flown(tree, plant="kinematic", estimator__kind=kind, duration_s=40) for kind in ("raw", "truth"))
    assert len({flight["digest"] for flight in flights}) == 2


def test_a_matrix_over_them_is_flown_kept_shown_and_compared(tree: Path) -> None:
    table = harness(tree, "run", "matrix.toml", "--out", "out", "--workers", "0", "--log", "none")
    assert "distance" in table
    assert "% yes" in table
    code = (
        "import harness; r = harness.load_results('out'); "
        "print(r['ends_north'].dtype, r['ends_north'].notna().all(), sorted(set(r['plant'])), r['key'][0])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tree, env={**os.environ, "PYTHONPATH": str(tree)}, capture_output=True,
        text=True, check=True,
    )  # fmt: skip
    assert done.stdout.startswith("boolean True ['kinematic', 'weak'] ")
    assert "ends_north" in harness(tree, "show", f"out:{done.stdout.split()[-1]}")
    compared = json.loads(harness(tree, "compare", "out", "--json"))
    assert compared["assess"]["shyness_deg"] == 3.0
    assert {row["value"] for row in compared["differences"]} == {"weak"}
    assert {"distance_flown_m", "ends_north"} <= {row["metric"] for row in compared["differences"]}
