"""The whole command line with input that nobody meant: a command ends in a result, or in a sentence that says why not.

`make fuzz` tries 2000 inputs at random, the suite the same 200 each time. A new command joins with an entry in `CALLS`,
a new kind of file with an entry in `THINGS`.
"""

import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, event, given, settings
from hypothesis import strategies as st

import harness
from harness.cli.main import COMMANDS
from harness.runs.journal import JOURNAL
from harness.settings import document, load_flight
from tests import mutations, recorded_logs
from tests.builders import EXPERIMENTS, copied_airframe, invoke, write
from tests.confined import Confined, Ended

CASES = int(os.environ.get("FUZZ", "200"))

# Files, from which a case takes a copy, unchanged or changed

MANY = """\
title = "Many"
question = "Does it?"
[flight]
duration_s = 1.0
guidance_period_s = 0.05
[flight.law]
name = "nftsm"
[flight.wind]
turbulence = "light"
[[flight.target.segments]]
from_s = 0.1
to_s = 0.5
turn_rate_deg_s = 5.0
[flight.estimator]
kind = "ekf"
[matrix]
plant = ["kinematic", "lagged"]
seed = { start = 0, count = 3 }
"law.standoff_m, law.direction" = [[200.0, "paper"], ["15 s", "mirrored"]]
"start.heading_deg" = { normal = [0.0, 30.0] }
"wind.steady_mps" = { speed_mps = [0, 2.0], towards_deg = { uniform = [0, 360] } }
[[exclude]]
seed = 1
[[include]]
plant = "coordinated"
seed = 7
[assess]
sideslip_deg = 3.0
"""


def _settings(folder: Path) -> None:
    shutil.copy(EXPERIMENTS / "stationary.toml", folder)
    write(folder / "one.toml", MANY.partition("[matrix]")[0].replace("[flight]", '[flight]\nplant = "lagged"', 1))


def _matrices(folder: Path) -> None:
    write(folder / "many.toml", MANY)


def _tracks(folder: Path) -> None:
    rows = "".join(f"{t},{10 * t + 100},{t * t}\n" for t in range(-1, 6))
    write(folder / "track.csv", f"time_s,north_m,east_m\n{rows}")


def _runs(folder: Path) -> None:
    file = write(folder.parent / "run.toml", MANY)
    assert invoke("run", file, "--out", folder / "run", "--workers", 0, "--limit", 6, "--log", "all").exit_code == 0
    (folder / "bare").mkdir()  # without what is derived, which commands read instead where it is there
    shutil.copy(folder / "run" / JOURNAL, folder / "bare")


def _recordings(folder: Path) -> None:
    file = EXPERIMENTS / "stationary.toml"
    short = ("--set", "duration_s=0.3")
    assert invoke("fly", file, *short, "--rrd", folder / "one.rrd").exit_code == 0
    sealed = (folder / "one.rrd").read_bytes()
    (folder / "unsealed.rrd").write_bytes(sealed.replace(b"CHECKSUM:", b"checksum:"))


def _airframes(folder: Path) -> None:
    copied_airframe("aerosonde", folder / "mine")


def _laws(folder: Path) -> None:
    assert invoke("init", "--law", folder / "mine.py").exit_code == 0


def _logs(folder: Path) -> None:
    recorded_logs.write_ulog(folder / "a.ulg", recorded_logs.TOPICS)
    recorded_logs.write_dataflash(folder / "a.bin", recorded_logs.MESSAGES)
    recorded_logs.write_csv(folder / "a.csv", recorded_logs.COLUMNS)


def _maps(folder: Path) -> None:
    write(folder / "map.toml", recorded_logs.MAP)


THINGS: Mapping[str, Callable[[Path], None]] = {
    "FILE": _settings, "MATRIX": _matrices, "TRACK": _tracks, "RUN": _runs, "RRD": _recordings, "AIRFRAME": _airframes,
    "LAW": _laws, "LOG": _logs, "MAP": _maps,
}  # fmt: skip

# Calls, in which words in capitals stand for something

SHORT = "--set duration_s=0.3"
TRACKED = "--set target.segments=[] --set target.track=TRACK"
CALLS: Mapping[str, Sequence[str]] = {
    "fly": [
        f"FILE {SHORT} --set SET", f"FILE {SHORT} {TRACKED} --json",
        f"FILE {SHORT} --set aircraft=AIRFRAME --rrd OUT/a", f"FILE {SHORT} --against RUN:KEY",
        f"RUN:KEY {SHORT} --set SET", "RUN:KEY", "WORD", f"FILE {SHORT} --set law.name=LAW:MyLaw --set law.gains=firm",
    ],
    "check": [
        "FILE", "FILE --set SET", "MATRIX --set SET", f"FILE {TRACKED}", "FILE --set aircraft=AIRFRAME", "WORD",
        "LAW", "LAW:MyLaw", "LAW:WORD",
    ],
    "predict": ["FILE --set SET", "FILE --set aircraft=AIRFRAME", "FILE --set WORD"],
    "view": [
        "RRD --flight sixdof --save OUT/a", "RRD --flight WORD --save OUT/a", "RUN:KEY --save OUT/a",
        "RUN --flight KEY --flight WORD --save OUT/a", "RUN --pair KEY --save OUT/a",
    ],
    "plot": [
        "RRD --what track --save OUT/a.svg", "RUN:KEY --what rate --save OUT/a.svg", "RUN:WORD --save WORD",
        "RUN --what map --save OUT/a.svg --metric WORD", "RUN --what map --save OUT/a.svg --where SET",
    ],
    "export": [
        "RRD --to csv --out OUT/a", "RRD --to parquet --out OUT/a --flight WORD", "RUN:KEY --to csv --out OUT/a",
        "RUN --to csv --out OUT/a", "RUN --to parquet --out OUT/a",
    ],
    "assess": [
        "LOG", "LOG --map MAP", "LOG --from WORD", "LOG --json --from 1 --to 2", "LOG --rrd OUT/a --out OUT/b",
        "LOG --out OUT/WORD", "LOG --fit OUT/a", "LOG --map WORD", "WORD --map MAP",
    ],
    "validate": [
        "AIRFRAME --with LOG --map MAP", "aerosonde --with LOG", "WORD --with LOG",
        "aerosonde --with LOG --save OUT/WORD",
    ],
    "init": ["OUT/a.toml", "FILE", "OUT/WORD", "--law OUT/a.py", "--law LAW"],
    "run": [
        "MATRIX --dry-run", "FILE --dry-run --set SET", f"MATRIX --out OUT {SHORT} --limit 2 --workers 0 --set SET",
        f"MATRIX --out OUT {SHORT} --limit 2 --workers 0 {TRACKED}",
        f"MATRIX --out OUT {SHORT} --limit 2 --workers 0 --set aircraft=AIRFRAME",
        "MATRIX --out RUN --limit 8 --workers 0 --log none", "MATRIX --dry-run --limit WORD",
        "MATRIX --dry-run --shard WORD",
        "MATRIX --out OUT --engine WORD", f"MATRIX --out OUT {SHORT} --limit 2 --workers 0 --shard 2/3",
        "MATRIX --out OUT --dask WORD", "FILE --out OUT --limit 1 --dask OUT/WORD.json",
    ],
    "falsify": [
        f"FILE --out OUT {SHORT} --workers 0 --flights 2 --over law.k2=1:9 --requirement WORD",
        f"FILE --out OUT {SHORT} --workers 0 --flights 2 --over law.k2=1:9 --requirement range_error_peak_m<5 --json",
        "MATRIX --out OUT --over WORD --requirement laps>1 --guide WORD",
        "FILE --out OUT --over law.k2=1:9 --requirement outcome=WORD",
        "FILE --out OUT --over law.k2=1:9 --requirement laps>1 --dask OUT/WORD.json",
    ],
    "merge": ["RUN RUN --out OUT/c", "RUN WORD --out OUT/c", "RUN --out OUT", "WORD --out WORD"],
    "map": [
        f"FILE --out OUT {SHORT} --workers 0 --x law.k2=1:9 --y start.heading_deg=0:90 --resolution 10 --flights 130",
        "MATRIX --out OUT --x WORD --y law.k3=0:1", "FILE --out OUT --x law.k2=1:9 --y law.k3=0:1 --of WORD",
        "FILE --out OUT --x law.k2=1:9 --y law.k3=0:1 --dask WORD",
    ],
    "tune": [
        f"FILE --out OUT {SHORT} --workers 0 --flights 2 --over law.k2=1:9 --minimise range_error_peak_m",
        "MATRIX --out OUT --over WORD --minimise laps", "FILE --out OUT --over law.k2=1:9 --minimise WORD",
        "FILE --out OUT --over law.k2=1:9 --minimise laps --subject-to WORD",
        "FILE --out OUT --over law.k2=1:9 --minimise laps --dask WORD",
    ],
    "show": ["RUN", "RUN:KEY", "RUN --where SET --sort WORD", "RUN --columns WORD --csv", "WORD", "RUN:WORD"],
    "compare": [
        "RUN", "RUN --json --set SET", "RUN --by WORD --baseline WORD", "RUN --where SET", "RUN --by seed --latex",
        "RUN --where WORD --csv", "RUN --variance-reduction --where SET",
    ],
    "report": [
        "RUN --out OUT/a.html", "RUN --markdown OUT/a.md --set SET", "RUN --out OUT/a.html --by WORD",
        "RUN --markdown OUT/a.md --variance-reduction --where SET",
    ],
    "demo": ["--out /dev/null"],
    "reproduce": ["--out /dev/null --workers WORD"],
    "list": ["WORD"],
    "adopt": ["WORD --out OUT", "AIRFRAME --controls WORD --out OUT", "WORD --max-bank 900"],
    "identify": ["AIRFRAME --airspeed 900 --out OUT", "AIRFRAME --airspeed WORD --out /dev/null", "WORD"],
    "doctor": ["WORD"],
}  # fmt: skip
KINDS = [*THINGS, "SET", "WORD"]


def test_every_command_is_fuzzed() -> None:
    assert set(CALLS) == {name for commands in COMMANDS.values() for name in commands}


class Corpus:
    """Copies of things, and where they are."""

    def __init__(self, folder: Path) -> None:
        for name, make in THINGS.items():
            (folder / name).mkdir(parents=True)
            make(folder / name)
        self.things = {name: sorted((folder / name).iterdir()) for name in THINGS}
        self.key = str(harness.load_results(folder / "RUN" / "run")["key"][0])
        flight = document(load_flight(EXPERIMENTS / "stationary.toml"))
        tables = {name: table for name, table in flight.items() if isinstance(table, dict)}
        self.keys = [
            "assess.sideslip_deg",
            *flight,
            *(f"{name}.{key}" for name, keys in tables.items() for key in keys),
        ]

    def settings(self) -> st.SearchStrategy[str]:
        """Texts KEY=VALUE."""
        keys = st.sampled_from(self.keys)
        values = st.sampled_from(mutations.NASTY)
        return st.builds("{}={}".format, keys, values | mutations.words()) | mutations.words()

    def copied(self, draw: mutations.Draw, name: str, folder: Path, changed: bool) -> str:
        """The name of a copy of one of these things in the folder, with one file changed or gone."""
        thing: Path = draw(st.sampled_from(self.things[name]))
        copy = folder / thing.name
        if copy.exists():
            return thing.name
        if thing.is_dir():
            shutil.copytree(thing, copy)
        else:
            shutil.copy(thing, copy)
        if changed:
            file = draw(st.sampled_from(sorted(path for path in (copy, *copy.rglob("*")) if path.is_file())))
            if thing.is_dir() and not draw(st.integers(0, 15)):
                file.unlink()
            elif file.suffix == ".sqlite":
                file.write_bytes(draw(mutations.databases(file)))
            else:
                file.write_bytes(draw(mutations.contents(file.read_bytes())))
        return thing.name


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory) -> Corpus:
    return Corpus(tmp_path_factory.mktemp("corpus"))


@pytest.fixture(scope="module")
def confined(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Confined]:
    with Confined(tmp_path_factory.mktemp("confined")) as process:
        yield process


def _words(draw: mutations.Draw, corpus: Corpus, kind: str, folder: Path) -> list[str]:
    """A command line that uses a changed thing of this kind."""
    calls = [f"{command} {call}" for command, calls in CALLS.items() for call in calls if kind in _capitals(call)]
    found = {"OUT": "out", "KEY": corpus.key}
    words = []
    for word in draw(st.sampled_from(calls)).split():
        for name in _capitals(word):
            if name in THINGS:
                found.setdefault(name, corpus.copied(draw, name, folder, name == kind))
            elif name == "SET":
                found[name] = draw(corpus.settings())
            elif name == "WORD":
                found[name] = draw(mutations.words())
        for name in _capitals(word):
            word = word.replace(name, found[name])
        words.append(word)
    return words


def _capitals(call: str) -> list[str]:
    return [name for name in (*THINGS, "OUT", "KEY", "SET", "WORD") if name in call]


def _listing(folder: Path, *apart: str) -> dict[str, tuple[int, int]]:
    """Size and time of change of each file but for those in the folders `apart`."""
    files = ((path, path.lstat()) for path in folder.rglob("*"))
    listing = {str(path.relative_to(folder)): (state.st_size, state.st_mtime_ns) for path, state in files}
    return {name: of for name, of in listing.items() if name.split("/")[0] not in apart}


@pytest.mark.parametrize("kind", KINDS)
@settings(
    max_examples=max(1, CASES // len(KINDS)), deadline=None, derandomize="FUZZ" not in os.environ,
    suppress_health_check=list(HealthCheck), phases=[Phase.generate, Phase.shrink],
)  # fmt: skip
@given(data=st.data())
def test_a_command_ends_in_a_result_or_says_why_not(
    kind: str, corpus: Corpus, confined: Confined, data: st.DataObject
) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "out").mkdir()
        words = _words(data.draw, corpus, kind, folder)
        before = _listing(folder)
        ended = confined.run(words, folder)
        event(f"{words[0]}: {ended.code}")
        assert _fault(ended) == "", f"{words}: {ended.code}\n{ended.stderr}"
        apart = ("out", "run", "bare") if words[0] == "run" else ("out",)
        assert _listing(folder, *apart) == {k: v for k, v in before.items() if k.split("/")[0] not in apart}


def _fault(ended: Ended) -> str:
    """What is wrong with how a command ended; empty for none."""
    if ended.code not in (0, 1, 2):
        return f"exit code {ended.code} after {ended.seconds:.1f} s"
    if "Traceback" in ended.stderr:
        return ended.stderr.splitlines()[-1]
    if ended.code == 2 and not ended.stderr.strip():
        return "nothing is said"
    return ""
