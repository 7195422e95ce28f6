"""What is installed: the wheel, the names it takes, and the lock file that everything rests on."""

import re
import subprocess
import sys
import tomllib
import zipfile
from importlib.metadata import distributions
from pathlib import Path

ROOT = Path(__file__).parent.parent
PACKAGES = {"harness", "autopilot", "aircraft"}


def test_the_wheel_holds_every_file_of_the_three_packages_and_nothing_else(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(tmp_path)]
    subprocess.run(command, check=True, cwd=ROOT, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    held = {name for name in names if ".dist-info/" not in name}
    sources = {
        path.relative_to(ROOT).as_posix()
        for package in PACKAGES
        for path in (ROOT / package).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert held == sources
    assert {name.partition("/licenses/")[2] for name in names if "/licenses/" in name} == {"LICENSE", "NOTICE"}


def test_the_notice_names_every_airframe_that_is_shipped() -> None:
    notice = (ROOT / "NOTICE").read_text(encoding="utf-8")
    for folder in (path.parent for path in ROOT.glob("aircraft/*/airframe.toml")):
        assert f"\n{folder.name}\n" in notice
        sources = tomllib.loads((folder / "airframe.toml").read_text(encoding="utf-8"))["sources"]
        commits = {commit for text in sources.values() for commit in re.findall(r"\(([0-9a-f]{7}),", text)}
        assert all(commit in notice for commit in commits), folder.name


def test_no_other_distribution_owns_the_names_of_the_packages() -> None:
    owners = {
        (installed.name, file.parts[0])
        for installed in distributions()
        for file in installed.files or ()
        if file.parts[0].removesuffix(".py") in PACKAGES
    }
    assert {name for name, _ in owners} <= {"standoff-harness"}


def test_the_lock_pins_everything_by_hash_and_names_no_address() -> None:
    text = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    assert not re.search(r"://|@ |--(extra-)?index|--find-links|file:", text)
    pinned = set()
    for block in re.split(r"\n(?=[A-Za-z0-9])", text)[1:]:
        name, pin, _ = block.partition("==")
        assert pin, block
        pinned.add(name)
        assert re.search(r"--hash=sha256:[0-9a-f]{64}", block), name
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = [*project["dependencies"], *project["optional-dependencies"]["dev"]]
    assert {re.split(r"[^\w.-]", requirement)[0] for requirement in wanted} <= pinned
