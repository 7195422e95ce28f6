"""Other fixed-wing simulators beside bare JSBSim and this harness: `python -m benchmarks.peers --install`.

Each flies in a process of its own, which sees its packages alone: `--install` lets pip put them into temporary folders,
`--site NAME=FOLDER` says where pip has put them (`pip install --target FOLDER …`); without either, those that this
Python can import are flown. Writes docs/answers/other_simulators.md, with the reason for each that was not measured.
"""

import argparse
import json
import math
import os
import platform
import re
import statistics
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import Any, NamedTuple, Self

from benchmarks.peer_flights import SIMULATORS
from harness.files import write_text
from harness.tables import markdown
from harness.threads import use_one_thread

PAGE = Path("docs/answers/other_simulators.md")
ROOT = Path(__file__).parent.parent
LEFT_OUT: Mapping[str, str] = MappingProxyType(
    {
        "flybots 2.0.0": "asks for Python 3.12; this Python is 3.11",
        "gym-jsbsim 0.6.7": "installs, but cannot read the list of properties of JSBSim 1.3.3",
        "gym-pybullet-drones": "is not on the package index",
        "last-letter 2.103.0": "comes as C++ source, whose build fetches more sources from the network",
        "pyf16 0.1.1": "its package has no aerodynamic model to load",
        "uniflight 1.0.4": "an engine for equations of motion, without an aircraft",
    }
)


class Process:
    """A simulator, ready to fly."""

    def __init__(self, name: str, seconds: float, site: Path | None, folder: Path) -> None:
        self._name = name
        paths = [str(path) for path in (site, ROOT) if path]
        self._process = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.peer_flights", name, str(seconds)],
            cwd=folder,  # some write a file where they fly
            env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        said = self._answer()
        self.version: str = said.get("version", "")
        self.lacks: str = said.get("lacks", "")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.communicate()  # closes its input, at which it ends

    def seconds(self) -> float:
        """The processor time of one more flight."""
        assert self._process.stdin
        print(file=self._process.stdin, flush=True)
        taken = self._answer()
        if not isinstance(taken, float):
            raise RuntimeError(f"{self._name}: {taken['lacks']}")
        return taken

    def _answer(self) -> Any:
        assert self._process.stdout
        line = self._process.stdout.readline()
        return json.loads(line) if line else {"lacks": f"its process ended with {self._process.wait()}"}


class Timed(NamedTuple):
    """Processor times of a simulator and of the bare loop that flew right before it, s."""

    version: str
    flown: list[float]
    bare: list[float]


def plain(reason: str) -> str:
    """The first line of a reason, without places of this machine or of a network."""
    return re.sub(r"\w+://\S+|(/[\w.+~-]+)+/", "", (reason.strip() or "no reason given").splitlines()[0])


def installed(requirements: Sequence[str], folder: Path) -> str:
    """Lets pip put them into the folder; the reason if it does not."""
    words = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--target", str(folder), *requirements]
    done = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=False)
    errors = [line.removeprefix("ERROR: ") for line in done.stderr.splitlines() if line.startswith("ERROR: ")]
    return "" if done.returncode == 0 else plain(errors[-1] if errors else f"pip ended with {done.returncode}")


def measured(
    names: Sequence[str], rounds: int, seconds: float, sites: Mapping[str, Path], missing: Mapping[str, str]
) -> tuple[dict[str, Timed], dict[str, str]]:
    """The times of those that fly, each right after its bare loop; and why the others do not."""
    why, found = dict(missing), {}
    with ExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory(prefix="harness-")))
        ready: dict[str, Process] = {}
        for name in names:
            if SIMULATORS[name].package in why:
                continue
            process = stack.enter_context(Process(name, seconds, sites.get(SIMULATORS[name].package), folder))
            if process.lacks:
                why[SIMULATORS[name].package] = plain(process.lacks)
            else:
                ready[name], found[name] = process, Timed(process.version, [], [])
        for _ in range(rounds):
            for name, process in ready.items():
                bare = ready[SIMULATORS[name].reference]
                found[name].bare.append(bare.seconds())
                found[name].flown.append(process.seconds() / SIMULATORS[name].flights)
    return found, why


def shown(values: Sequence[float]) -> str:
    """Median and range, to three digits at least."""
    median = statistics.median(values)
    digits = max(0, 2 - math.floor(math.log10(median)))
    return f"{median:.{digits}f} ({min(values):.{digits}f} to {max(values):.{digits}f})"


def page(seconds: float, rounds: int, found: Mapping[str, Timed], missing: Mapping[str, str]) -> Iterator[str]:
    """The page, in Markdown."""
    yield "# Other simulators"
    yield "\nHow fast do other open fixed-wing simulators fly, and what does each do for it?\n"
    yield "`python -m benchmarks.peers --install` writes this page (ten minutes); pip puts each simulator with what it"
    yield "needs into a temporary folder of its own, and each flies in a process of its own with one thread."
    yield (
        f"Flights of {seconds:g} s with their start, without imports; processor time; medians and ranges of {rounds} "
        "rounds."
    )
    yield f"Machine: {os.cpu_count()} processors, {platform.machine()}, Python {platform.python_version()}."
    yield "\nThe work is not equal: aircraft, steps and commands differ, as the columns say, and so does what a flight"
    yield "does for it, which stands [beneath](#what-each-does)."
    yield "The rows of the c172p have the aircraft, the steps and the commands in common."
    yield "*Times bare JSBSim*: the time over that of `fdm.run()` alone, flown right before it: of the same model in as"
    yield "many steps where a simulator is built on JSBSim, and of `ultra_stick_25e` elsewhere; less is faster."
    yield "All are flights in six degrees of freedom; the harness flies its simpler plants"
    yield "[faster](../guide/many_flights.md#compiled-flights).\n"
    rows = []
    for name, each in found.items():
        of = SIMULATORS[name]
        ratios = [a / b for a, b in zip(each.flown, each.bare, strict=True)]
        rows.append(
            (
                name,
                of.flies,
                of.step_ms,
                of.command_ms,
                shown([seconds / x for x in each.flown]),
                f"{1.0 / statistics.median(each.flown):.3g}",
                "1" if of.reference == name else shown(ratios),
            )
        )
    times = ("times real time", "flights a second", "times bare JSBSim")
    yield from markdown(("simulator", "flies", "step, ms", "command, ms", *times), rows, "llr")
    yield "\n## What each does\n"
    for name, each in found.items():
        yield f"- {name} ({each.version}): {SIMULATORS[name].does}."
    yield "\n## Not measured\n"
    for name, reason in sorted({**LEFT_OUT, **missing}.items(), key=lambda pair: pair[0].lower()):
        yield f"- {name}: {reason}."


def main(
    rounds: int = 9,
    seconds: float = 100.0,
    *,
    names: Sequence[str] = tuple(SIMULATORS),
    sites: Mapping[str, Path] = MappingProxyType({}),
    install: bool = False,
    path: Path = PAGE,
) -> None:
    """Measures, and writes the page."""
    use_one_thread()
    with TemporaryDirectory(prefix="harness-") as folder:
        found_at, missing = dict(sites), dict[str, str]()
        for of in SIMULATORS.values() if install else ():
            if of.requires and of.package not in {*found_at, *missing}:
                found_at[of.package] = Path(folder) / of.package
                if reason := installed(of.requires, found_at[of.package]):
                    missing[of.package] = reason
                print(f"{of.package}: {reason or 'installed'}", flush=True)
        found, missing = measured(names, rounds, seconds, found_at, missing)
    lines = list(page(seconds, rounds, found, missing))
    write_text(path, "\n".join(lines) + "\n")
    print("\n".join(line for line in lines if line.startswith(("|", "-"))))


def _site(text: str) -> tuple[str, Path]:
    """`NAME=FOLDER`."""
    name, _, folder = text.partition("=")
    known = sorted({of.package for of in SIMULATORS.values() if of.requires})
    if name not in known:
        raise argparse.ArgumentTypeError(f"{text!r}: NAME=FOLDER is asked for, with a name of {', '.join(known)}")
    if not Path(folder).is_dir():
        raise argparse.ArgumentTypeError(f"{text!r}: {folder!r} is no folder")
    return name, Path(folder).resolve()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--seconds", type=float, default=100.0, help="of a flight")
    parser.add_argument("--site", type=_site, action="append", default=[], metavar="NAME=FOLDER")
    parser.add_argument("--install", action="store_true")
    asked = parser.parse_args()
    main(asked.rounds, asked.seconds, sites=dict(asked.site), install=asked.install)
