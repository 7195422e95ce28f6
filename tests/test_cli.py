"""The command line as a user meets it: real processes, real files, exit codes."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

FILE = """\
[flight]
plant = "kinematic"
duration_s = 40.0
[flight.law]
name = "nftsm"
gains = "paper_1"
[flight.wind]
steady_mps = [0.0, 0.0]
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "flight.toml"
    path.write_text(FILE, encoding="utf-8")
    return path


def harness(*words: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "harness", *map(str, words)], capture_output=True, text=True, check=False
    )


def test_a_flight_is_told_in_lines(file: Path) -> None:
    done = harness("fly", file)
    assert done.returncode == 0
    first, *_, outcome, key = done.stdout.splitlines()
    assert first.startswith("circle feasible: holding it takes up to 3.72 deg/s")
    assert "convergence_time_s" in done.stdout
    assert outcome == "completed"
    assert key.startswith("key ")
    assert "Eq. (28)" in done.stderr  # the set breaks the paper's condition, flies and says so


def test_json_is_one_object_with_the_contracts_keys(file: Path) -> None:
    done = harness("fly", file, "--json", "--set", "law.name=smc", "--set", "law.gains=paper")
    answer = json.loads(done.stdout)
    assert {"key", "outcome", "digest", "flight", "metrics", "feasibility_margin_deg_s"} <= set(answer)
    assert answer["flight"]["law"]["c1"] == 0.2
    assert answer["metrics"]["sideslip_rms_deg"] is None
    assert answer["feasibility_margin_deg_s"] == pytest.approx(5.0 - 3.724, abs=1e-3)


def test_without_a_limit_json_still_has_no_infinity(file: Path) -> None:
    done = harness("fly", file, "--json", "--set", "law.max_heading_rate_deg_s=inf")
    assert json.loads(done.stdout)["feasibility_margin_deg_s"] is None


def test_another_setting_is_another_key_and_the_same_one_is_not(file: Path) -> None:
    keys = [
        json.loads(harness("fly", file, "--json", "--set", f"start.heading_deg={heading}").stdout)["key"]
        for heading in (30, 30.0, 31)
    ]
    assert keys[0] == keys[1] != keys[2]


BAD = [
    ("plant=sixdoff", "flight.plant", "sixdof"),
    ("law.standof_m=3", "flight.law.standof_m", "did you mean 'standoff_m'"),
    ("law.gains=paper_2", "flight.law.gains", "paper_1"),
    ("law.name=nftms", "flight.law.name", "did you mean 'nftsm'"),
    ("duration_s=-5", "flight.duration_s", "> 0"),
    ('duration_s="5"', "flight.duration_s", "a number"),
    ("guidance_period_s=0.052", "flight.guidance_period_s", "no whole multiple of step_s, 0.005 s"),
    ("wind.steady_mps=[13.0, 0.0]", "flight.wind.steady_mps", "below the airspeed, 13 m/s"),
    ("aircraft=cessna", "flight.aircraft", "skywalker_x8"),
]


@pytest.mark.parametrize(("setting", "key", "hint"), BAD)
def test_a_bad_setting_is_one_line_and_exit_code_2(file: Path, setting: str, key: str, hint: str) -> None:
    done = harness("fly", file, "--set", setting)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"--set {setting}: {key}: ")
    assert hint in line


def test_a_mistake_in_the_file_is_told_with_its_line(file: Path) -> None:
    file.write_text(FILE.replace('"paper_1"', '"papre"'), encoding="utf-8")
    done = harness("check", file)
    assert done.returncode == 2
    assert done.stderr.startswith(f"{file}:6: flight.law.gains: ")


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        (["start.airspeed_mps=7"], "flight.start.airspeed_mps: no level trim at 7 m/s"),
        (["start.altitude_m=12"], "flight.start.altitude_m: 12 m is not above 15 m"),
    ],
)
def test_what_the_airframe_cannot_do_is_one_line_and_exit_code_2(file: Path, settings: list[str], told: str) -> None:
    words = [word for setting in ["plant=sixdof", *settings] for word in ("--set", setting)]
    done = harness("fly", file, *words)
    assert done.returncode == 2
    assert told in done.stderr.splitlines()[-1]
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("where", ["nowhere/flight.rrd", "."])
def test_a_recording_that_cannot_be_written_is_refused_before_the_flight(
    file: Path, tmp_path: Path, where: str
) -> None:
    before = sorted(tmp_path.rglob("*"))
    done = harness("fly", file, "--rrd", tmp_path / where)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert done.stdout == ""
    assert sorted(tmp_path.rglob("*")) == before


def test_a_law_that_leaves_its_domain_is_flown_with_warnings(file: Path) -> None:
    done = harness(
        "fly",
        file,
        "--set",
        "wind.steady_mps=[8.0,0.0]",
        "--set",
        "target.speed_mps=7.0",
        "--set",
        "target.heading_deg=180",
    )
    assert done.returncode == 0
    assert "INFEASIBLE" in done.stdout
    assert "Remark 1" in done.stderr


def test_help_needs_none_of_the_heavy_libraries() -> None:
    code = (
        "import sys\n"
        "from harness.cli import harness\n"
        "harness.main(['--help'], standalone_mode=False)\n"
        "heavy = {'jsbsim', 'pandas', 'rerun', 'scipy', 'matplotlib', 'numpy', 'pydantic'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "Example" in done.stdout


@pytest.mark.parametrize("command", ["fly", "check", "list", "demo", "reproduce", "doctor"])
def test_every_command_shows_an_example(command: str) -> None:
    assert "Example" in harness(command, "--help").stdout


def test_a_mistyped_command_or_kind_is_exit_code_2() -> None:
    assert harness("fyl").returncode == 2
    assert harness("list", "planes").returncode == 2


def test_the_doctor_finds_this_installation_sound() -> None:
    done = harness("doctor")
    assert done.returncode == 0, done.stdout
    assert done.stdout.splitlines()[-1] == "sound"
    assert "BAD" not in done.stdout


@pytest.mark.parametrize("kind", ["laws", "aircraft", "plants", "metrics", "margins"])
def test_every_kind_is_listed(kind: str) -> None:
    done = harness("list", kind)
    assert done.returncode == 0
    assert len(done.stdout.splitlines()) >= 2
