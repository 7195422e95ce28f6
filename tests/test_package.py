"""What is installed: the wheel, the names it takes, and the lock file that everything rests on."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import venv
import zipfile
from importlib.metadata import distributions
from pathlib import Path

from benchmarks.installation import build
from tests.builders import ROOT

PACKAGES = {"harness", "autopilot", "aircraft"}


def test_the_wheel_holds_every_file_of_the_three_packages_and_nothing_else(tmp_path: Path) -> None:
    names = zipfile.ZipFile(build(tmp_path)).namelist()
    held = {name for name in names if ".dist-info/" not in name}
    sources = {
        path.relative_to(ROOT).as_posix()
        for package in PACKAGES
        for path in (ROOT / package).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert held == sources
    assert {name.partition("/licenses/")[2] for name in names if "/licenses/" in name} == {"LICENSE", "NOTICE"}


def test_the_wheel_works_without_the_source_tree_from_another_folder_and_writes_nothing_where_it_lies(
    tmp_path: Path,
) -> None:
    """Installed in an environment of its own, with links to the libraries of this one."""
    wheel, there, elsewhere = build(tmp_path), tmp_path / "environment", tmp_path / "elsewhere"
    venv.create(there, symlinks=True)
    packages = Path(sysconfig.get_path("purelib", vars={"base": str(there), "platbase": str(there)}))
    pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", "--python", str(there / "bin/python")]
    subprocess.run([*pip, "install", "--no-deps", "--no-index", str(wheel)], check=True)
    for library in Path(sysconfig.get_path("purelib")).iterdir():
        if library.suffix != ".pth" and not library.name.startswith(("standoff_harness", "__pycache__")):
            (packages / library.name).symlink_to(library)
    for path in (packages, *packages.rglob("*")):
        if not path.is_symlink():
            path.chmod(path.stat().st_mode & ~0o222)
    before = listing(packages)
    elsewhere.mkdir()
    shutil.copy(ROOT / "experiments" / "stationary.toml", elsewhere / "one.toml")
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    for words in (
        "fly one.toml --rrd one.rrd",
        'run one.toml --out out --set plant=["kinematic","sixdof"] --set duration_s=20',
        "report out",
        "demo --out demo",
        "view out --flight KEY --save two.rrd",
        "doctor",
    ):
        (key, *_) = [path.stem for path in elsewhere.glob("out/flights/*.rrd")] or [""]
        called = [str(there / "bin/harness"), *words.replace("KEY", key).split()]
        done = subprocess.run(called, cwd=elsewhere, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, (words, done.stdout, done.stderr)
    assert {"one.rrd", "out", "demo", "two.rrd"} <= {path.name for path in elsewhere.iterdir()}
    assert (elsewhere / "out" / "report.html").is_file()
    assert listing(packages) == before


def listing(folder: Path) -> dict[Path, tuple[int, int]]:
    return {path: (path.lstat().st_mtime_ns, path.lstat().st_size) for path in folder.rglob("*")}


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
