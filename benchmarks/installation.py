"""The wheel installed by pip, without the source tree: `python -m benchmarks.installation [PYTHON]`.

Sizes of the wheel and of the environment, and the time of a first flight whose files are in no memory: as installed,
and without the byte code that pip made; written into the guide. Needs the package registry; takes a minute or two.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from benchmarks.help_speed import seconds
from benchmarks.measured import keep

ROOT = Path(__file__).parents[1]
FLIGHT = ROOT / "experiments" / "stationary.toml"
GUIDE = ROOT / "docs" / "guide" / "first_flight.md"
LARGEST = 3  # packages named


def build(folder: Path) -> Path:
    """The wheel of the source tree."""
    command = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(folder)]
    subprocess.run(command, check=True, cwd=ROOT, capture_output=True)
    (wheel,) = folder.glob("*.whl")
    return wheel


def size(path: Path) -> float:
    """Of all files below, MB."""
    return sum(file.stat().st_size for file in path.rglob("*") if file.is_file() and not file.is_symlink()) / 1e6


def forget(folder: Path) -> None:
    """Takes the files out of the system's memory, as after a start of the machine. On Linux alone."""
    for file in filter(Path.is_file, folder.rglob("*")):
        opened = os.open(file, os.O_RDONLY)
        os.fsync(opened)
        os.posix_fadvise(opened, 0, 0, os.POSIX_FADV_DONTNEED)
        os.close(opened)


def lines(python: str) -> Iterator[str]:
    """The sizes and the times, as lines of a list."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        wheel, there = build(folder), folder / "environment"
        subprocess.run([python, "-m", "venv", str(there)], check=True)
        pip = [str(there / "bin" / "pip"), "--quiet", "--disable-pip-version-check", "install", str(wheel)]
        subprocess.run(pip, check=True, cwd=folder)
        (packages,) = there.glob("lib/python*/site-packages")
        version = packages.parent.name.replace("python", "Python ")
        yield f"{version}: the wheel has {wheel.stat().st_size / 1e3:.0f} kB, the environment {size(there):.0f} MB."
        largest = sorted(filter(Path.is_dir, packages.iterdir()), key=size)[: -LARGEST - 1 : -1]
        yield f"The largest packages: {', '.join(f'`{path.name}` {size(path):.0f} MB' for path in largest)}."
        fly = [str(there / "bin" / "harness"), "fly", str(FLIGHT)]
        for how, before in (("as installed", []), ("without byte code", list(packages.rglob("*.pyc")))):
            for file in before:
                file.unlink()
            forget(there)
            yield f"A first flight from a cold disk, {how}: {seconds(fly):.2f} s; the next {seconds(fly):.2f} s."


def main(python: str = sys.executable) -> None:
    """Write the sizes and the times into the guide, and print them."""
    block = "".join(f"- {line}\n" for line in lines(python))
    keep(GUIDE, "benchmarks.installation", block)
    print(block, end="")


if __name__ == "__main__":
    main(*sys.argv[1:2])
