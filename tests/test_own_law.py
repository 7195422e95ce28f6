"""A law of one's own, named by its file or module: flown, kept, and never run because somebody else's file names it."""

import json
import math
import os
import re
import sqlite3
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import harness
from harness.files import content_hash
from harness.key import files, flight_key
from harness.limit_cycle.margin import following
from harness.log.signals import at_limit
from harness.plants.plant import Outcome
from harness.runs.store import content
from harness.settings import SettingsError, document, flight_from_document
from harness.settings.law_source import entries
from tests.builders import EXPERIMENTS, command, fly_matrix, invoke, write

PLAIN = '''
from dataclasses import dataclass
from math import atan, atan2, hypot, pi

from autopilot.guidance import Context, Guidance, LawStep, Observation
from leaning import lean

open("was_run", "a").close()  # where the test looks whether this file was run


@dataclass(frozen=True)
class Field:
    """A vector field, filtered: it has memory, plain fields, and no base class."""

    standoff: float = 200.0
    max_heading_rate: float = 0.1
    k: float = 0.5
    command = "heading_rate"

    def start(self, context: Context) -> LawStep:
        share = context.period / (context.period + 0.3)
        filtered = 0.0

        def step(o: Observation) -> Guidance:
            nonlocal filtered
            x, y = o.north - o.target_north, o.east - o.target_east
            r, lam = hypot(x, y) - self.standoff, atan2(y, x) - pi / 2
            error = (o.heading - lam + lean(r) + pi) % (2 * pi) - pi
            wanted = -o.nominal_airspeed / self.standoff - self.k * error
            filtered += share * (wanted - filtered)
            limit = self.max_heading_rate
            return Guidance(max(-limit, min(limit, filtered)), r, 0.0, error, 0.0, wanted)

        return step

    def broken_conditions(self, speed_ratio: float) -> list[str]:
        return []
'''
LEANING = "from math import atan\n\n\ndef lean(r):\n    return atan(0.02 * r)\n"
MATRIX = """
[flight]
plant = "kinematic"
duration_s = 40.0
[flight.law]
name = "field.py:Field"
[matrix]
"law.k" = [0.4, 0.6]
"""


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The matrix of a folder with a law in two files, which is also the working folder."""
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "field.py", PLAIN)
    write(tmp_path / "leaning.py", LEANING)
    return write(tmp_path / "own.toml", MATRIX)


def law_in(folder: Path, body: str) -> Path:
    """A file with one law, `Own`, of this body."""
    head = "from dataclasses import dataclass\nfrom autopilot.guidance import *\nfrom autopilot.standoff import *\n\n\n"
    return write(folder / "own.py", f"{head}@dataclass(frozen=True, kw_only=True)\nclass Own(StandoffLaw):\n{body}")


WHOLE = """
    k: float = 0.5
    def start(self, context): return lambda o: Guidance(*({answer}, 0.0, 0.0, 0.0, 0.0, 0.0)[:6])
    def broken_conditions(self, speed_ratio): return []
"""


def test_workers_fly_it_its_file_is_kept_and_an_edited_law_is_flown_anew(own: Path) -> None:
    run = ("run", own, "--out", own.parent / "out", "--log", "none", "--workers")
    first = invoke(*run, 1)
    assert "2 flown, 0 earlier, 0 failed" in first.output
    assert content(own.parent / "out", content_hash(LEANING.encode())) == LEANING.encode()
    assert "0 flown, 2 earlier" in invoke(*run, 1).output
    write(own.parent / "leaning.py", LEANING.replace("0.02", "0.03"))
    assert "2 flown, 0 earlier, 0 failed" in invoke(*run, 1).output
    assert len(set(harness.load_results(own.parent / "out")["digest"])) == 4
    write(own.parent / "leaning.py", LEANING)
    assert "0 flown, 2 earlier" in invoke(*run, 0).output


def test_the_key_does_not_depend_on_the_folder(own: Path, tmp_path: Path) -> None:
    there = tmp_path / "elsewhere"
    there.mkdir()
    for name in ("field.py", "leaning.py"):
        (there / name).write_bytes((own.parent / name).read_bytes())
    overrides = ["plant=kinematic", "law.gains=custom"]
    here, moved = (
        harness.load_flight(EXPERIMENTS / "stationary.toml", [*overrides, f"law.name={folder}/field.py:Field"])
        for folder in (own.parent, there)
    )
    assert flight_key(here) == flight_key(moved)
    assert {"law/field.py", "law/leaning.py"} <= set(files(here))
    assert flight_from_document(document(here)) == here
    write(there / "leaning.py", LEANING.replace("0.02", "0.03"))
    changed = harness.load_flight(EXPERIMENTS / "stationary.toml", [*overrides, f"law.name={there}/field.py:Field"])
    assert flight_key(changed) != flight_key(here)
    assert harness.simulate(changed).digest != harness.simulate(here).digest  # each with its own helper


def test_plain_fields_are_si_but_what_all_laws_have_keeps_its_key(own: Path) -> None:
    law = {"name": "field.py:Field", "standoff_m": "10 s", "max_heading_rate_deg_s": 9.0, "k": 0.4}
    flight = flight_from_document({"plant": "kinematic", "law": law}, run=True)
    made = harness.law("field.py:Field", standoff=130.0, max_heading_rate=math.radians(9.0), k=0.4)
    assert flight.law == made


def test_a_row_is_not_flown_with_a_law_that_has_changed(own: Path) -> None:
    out, marker = own.parent / "out", own.parent / "was_run"
    fly_matrix(own, out)
    key = harness.load_results(out)["key"][0]
    assert invoke("fly", f"{out}:{key}").exit_code == 0
    write(own.parent / "leaning.py", LEANING + "# otherwise\n")
    marker.unlink()
    again = invoke("fly", f"{out}:{key}")
    assert again.exit_code == 2
    assert "field.py:Field: it has changed since" in again.output
    for words in (("show", out), ("show", f"{out}:{key}"), ("compare", out, "--by", "law.k"), ("export", out)):
        invoke(*words)
    (own.parent / "field.py").unlink()
    assert "there is no such file" in invoke("fly", f"{out}:{key}").output
    assert not marker.exists()


def test_a_recording_is_read_without_its_law(own: Path) -> None:
    one = write(own.parent / "one.toml", MATRIX.partition("[matrix]")[0])
    assert invoke("fly", one, "--rrd", "a.rrd").exit_code == 0
    marker = own.parent / "was_run"
    marker.unlink()
    write(own.parent / "leaning.py", LEANING + "# otherwise\n")
    assert invoke("view", "a.rrd", "--flight", "kinematic", "--save", "b.rrd").exit_code == 0
    assert invoke("plot", "a.rrd", "--save", "a.svg").exit_code == 0
    assert not marker.exists()


def test_a_module_and_an_entry_point_name_a_law(own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "site" / "fieldlaws"
    package.mkdir(parents=True)
    write(package / "__init__.py", "")
    write(package / "inner.py", PLAIN.replace("from leaning", "from .leaning"))
    write(package / "leaning.py", LEANING)
    info = tmp_path / "site" / "fieldlaws-1.dist-info"
    info.mkdir()
    write(info / "METADATA", "Metadata-Version: 2.1\nName: fieldlaws\nVersion: 1\n")
    write(info / "entry_points.txt", "[standoff_harness.laws]\nfilter_field = fieldlaws.inner:Field\n")
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    entries.cache_clear()
    try:
        by_module, by_entry = (
            flight_from_document({"plant": "kinematic", "law": {"name": name}}, run=True)
            for name in ("fieldlaws.inner:Field", "filter_field")
        )
        assert by_module == by_entry
        assert flight_key(by_module) == flight_key(by_entry)
        read = [name for name in files(by_module) if name.startswith("law/")]
        assert sorted(read) == ["law/fieldlaws/__init__.py", "law/fieldlaws/inner.py", "law/fieldlaws/leaning.py"]
        assert "filter_field" in invoke("list", "laws").output
    finally:
        entries.cache_clear()


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        ("1 / 0", "the law raised ZeroDivisionError"),
        ("float('nan')", "the law commanded nan"),
        ("'a'", "the law raised TypeError"),
        ("0.1, 'a'", "the law answered what is no number"),
    ],
)
def test_a_law_that_fails_in_flight_is_an_outcome(tmp_path: Path, answer: str, reason: str) -> None:
    file = law_in(tmp_path, WHOLE.format(answer=answer))
    log = harness.simulate(harness.Flight(plant="kinematic", law=harness.law(f"{file}:Own"), duration=1.0))
    assert log.outcome is Outcome.INVALID
    assert log.reason.startswith(reason)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("own.py", "must be own.py:CLASS"), ("own.py:", "must be one of nftsm"), ("nowhere.py:Own", "no such file"),
        ("own.py:Onw", "there is no class Onw, it has Own - did you mean 'Own'"), ("own:Own", "there is no module own"),
        ("json:Own", "Own"), ("sys:Own", "no file of Python"), ("bad.py:Own", "bad.py:2: is not valid Python"),
        ("raises.py:Own", "raises.py:2: cannot be loaded: KeyError: 'a'"),
        ("exits.py:Own", "exits.py:1: cannot be loaded: SystemExit"),
    ],
)  # fmt: skip
def test_a_law_that_cannot_be_named_so_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    law_in(tmp_path, WHOLE.format(answer="0.1"))
    write(tmp_path / "bad.py", "a = 1\nclass\n")
    write(tmp_path / "raises.py", "a = {}\na['a']\n")
    write(tmp_path / "exits.py", "raise SystemExit(3)\n")
    done = invoke("fly", EXPERIMENTS / "stationary.toml", "--set", f"law.name={name}", "--set", "law.gains=custom")
    assert done.exit_code == 2
    assert len(done.output.splitlines()) == 1
    assert done.output.startswith(f"--set law.name={name}: flight.law.name: ")
    assert said in done.output


def test_one_error_lists_everything_that_a_law_lacks(tmp_path: Path) -> None:
    write(tmp_path / "own.py", "class Own:\n    k: float = 1.0\n    gain_sets = {'a': {'x': 1}}\n")
    with pytest.raises(SettingsError) as error:
        flight_from_document({"plant": "kinematic", "law": {"name": "own.py:Own"}}, tmp_path, run=True)
    (line,) = error.value.lines
    for lacking in ("dataclass", "start(", "command", "broken_conditions(", "standoff", "max_heading_rate", "sets x"):
        assert lacking in line


def test_fields_that_no_file_can_hold_and_laws_that_refuse_are_told(tmp_path: Path) -> None:
    law_in(tmp_path, "    matrix: list[float]\n    name: str = ''\n" + WHOLE.format(answer="0.1"))
    with pytest.raises(SettingsError, match=r"the field matrix must be a float.*cannot be called name"):
        flight_from_document({"plant": "kinematic", "law": {"name": "own.py:Own"}}, tmp_path, run=True)
    refuses = "    def __post_init__(self):\n        if self.k > 1: raise ValueError('k is too high')\n"
    law_in(tmp_path, WHOLE.format(answer="0.1") + refuses)
    with pytest.raises(SettingsError, match=r"^flight\.law: k is too high$"):
        flight_from_document({"plant": "kinematic", "law": {"name": "own.py:Own", "k": 2.0}}, tmp_path, run=True)


def test_a_named_set_gives_the_gains_and_single_ones_override_it(tmp_path: Path) -> None:
    sets = "    gain_sets = {'soft': {'k': 0.2}, 'hard': {'k': 2.0}}\n"
    file = law_in(tmp_path, sets + WHOLE.format(answer="0.1"))
    settings = {"plant": "kinematic", "law": {"name": f"{file}:Own"}}
    chosen = [{}, {"gains": "hard"}, {"gains": "hard", "k": 1.0}]
    flights = [flight_from_document({**settings, "law": {**settings["law"], **law}}, run=True) for law in chosen]  # type: ignore[dict-item]
    assert [document(flight)["law"]["k"] for flight in flights] == [0.2, 2.0, 1.0]
    assert harness.law(f"{file}:Own", "hard") == flights[1].law
    with pytest.raises(SettingsError, match='is "hrad", must be one of "soft", "hard", "custom" - did you mean'):
        flight_from_document({**settings, "law": {**settings["law"], "gains": "hrad"}}, run=True)  # type: ignore[dict-item]


def test_a_law_has_channels_of_its_own_in_the_log_and_in_a_recording(tmp_path: Path) -> None:
    assert invoke("init", "--law", tmp_path / "mine.py").exit_code == 0
    for direction in ("paper", "mirrored"):
        law = harness.law(f"{tmp_path}/mine.py:MyLaw", direction=direction)
        log = harness.simulate(harness.Flight(plant="kinematic", law=law, duration=10.0))
        assert log["law_leaning"] == pytest.approx(np.arctan(0.02 * log["range_error"]))
        assert log.frame()["law_leaning"].tolist() == log["law_leaning"].tolist()
    harness.record(log, tmp_path / "a.rrd")
    pd.testing.assert_frame_equal(harness.read_flight(tmp_path / "a.rrd"), log.frame())


def test_the_law_that_init_writes_passes_its_check_and_is_kept(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    assert invoke("init", "--law", file).exit_code == 0
    checked = invoke("check", file)
    assert checked.exit_code == 0, checked.output
    assert checked.output.endswith(f"{file}: ok\n")
    assert "WRONG" not in checked.output
    assert invoke("init", "--law", file).exit_code == 2


def test_the_check_finds_what_is_wrong_with_a_law(tmp_path: Path) -> None:
    file = law_in(
        tmp_path,
        """
    def start(self, context):
        def step(o):
            asked.append(o)
            return Guidance(1e-3 * len(asked), 0.0, 0.0, 0.0, 0.0, 0.0)
        return step
    def broken_conditions(self, speed_ratio): return []

asked = []
""",
    )
    checked = invoke("check", file)
    assert checked.exit_code == 2
    for question in ("limited", "deterministic", "no global state", "mirrored"):
        assert f"{file}: Own: {question}: " in checked.output


def test_a_law_that_is_slow_is_a_warning_and_one_that_hangs_ends_the_flight(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = law_in(
        tmp_path,
        """
    def start(self, context):
        def step(o):
            time.sleep(0.002)
            while o.time > 0.2 and self.standoff == 190.0: pass
            return Guidance(0.05, 0.0, 0.0, 0.0, 0.0, 0.0)
        return step
    def broken_conditions(self, speed_ratio): return []

import time
""",
    )
    for name in ("ANSWERS_WITHIN", "TRIED_WITHIN"):
        monkeypatch.setattr(f"harness.settings.tried.{name}", 0.4)
    words = ("fly", EXPERIMENTS / "stationary.toml", "--set", f"law.name={file}:Own", "--set", "law.gains=custom",
             "--set", "duration_s=0.5", "--set", "plant=kinematic", "--set")  # fmt: skip
    slow = invoke(*words, "law.standoff_m=180")
    assert slow.exit_code == 0
    said = re.search(r"warning: the law takes ([\d.]+) ms", slow.output)
    assert said
    assert float(said[1]) > 2.0  # more on a busy machine
    hangs = invoke(*words, "law.standoff_m=190")
    assert hangs.exit_code == 1
    assert "outcome: timeout: the law gave no answer in 0.4 s" in hangs.output


def test_a_filtered_command_is_saturated_only_at_its_limit(own: Path) -> None:
    law = harness.law("field.py:Field", max_heading_rate=0.0651)
    log = harness.simulate(harness.Flight(plant="kinematic", law=law, duration=60.0))
    below = np.abs(log["heading_rate_command"]) < np.abs(log["unlimited_command"])
    assert at_limit(log).tolist() == (np.abs(log["heading_rate_command"]) == 0.0651).tolist()
    assert at_limit(log).sum() < below.sum()


@pytest.mark.parametrize("name", ["nftsm", "npfg", "nftsm_lead"])
def test_of_the_laws_of_the_package_the_same_rows_are_at_the_limit_as_ever(name: str) -> None:
    law = harness.law(name, max_heading_rate=math.radians(3.8))
    log = harness.simulate(harness.Flight(plant="lagged", law=law, duration=60.0))
    below = np.abs(log["heading_rate_command"]) < np.abs(log["unlimited_command"])
    assert below.any()
    assert at_limit(log).tolist() == below.tolist()


def test_a_law_that_circles_the_other_way_has_the_same_prediction(tmp_path: Path) -> None:
    clockwise = PLAIN.replace("from leaning import lean", "lean = lambda r: atan(0.02 * r)").replace(
        "filtered += share * (wanted - filtered)", "filtered = wanted"
    )
    turned = clockwise.replace("return step\n", "return mirrored(step)\n").replace(
        "from math", "from autopilot.standoff import mirrored\nfrom math", 1
    )
    margins = []
    for name, text in (("one.py", clockwise), ("other.py", turned)):
        write(tmp_path / name, text.replace('open("was_run", "a").close()', ""))
        law = harness.law(f"{tmp_path / name}:Field", k=8.0)
        margins.append(following(harness.Flight(plant="lagged", law=law)).margin)
    assert margins[0] == pytest.approx(margins[1])
    assert margins[0] is not None


def test_laws_of_one_file_name_in_two_folders_are_told_apart_and_compared(own: Path) -> None:
    other = own.parent / "other"
    other.mkdir()
    write(other / "field.py", PLAIN.replace("k: float = 0.5", "k: float = 0.7"))
    write(other / "leaning.py", LEANING.replace("0.02", "0.03"))
    both = MATRIX.replace('"law.k" = [0.4, 0.6]', '"law.name" = ["field.py:Field", "other/field.py:Field"]')
    file = write(own.parent / "both.toml", both)
    ran = invoke("run", file, "--out", "out", "--workers", 0, "--log", "none")
    assert "2 flown, 0 earlier, 0 failed" in ran.output
    assert ran.output.count("/field.py:Field ") == 2
    compared = invoke("compare", "out")
    assert compared.exit_code == 0, compared.output
    assert f"law.name = {other}/field.py:Field beside {own.parent}/field.py:Field" in compared.output


def test_every_command_flies_a_law_of_ones_own(tmp_path: Path) -> None:
    """On the real command line: each command is a process of its own, that knows the law by its file alone."""
    law = ("--set", f"law.name={tmp_path / 'mine.py'}:MyLaw", "--set", "law.gains=firm", "--set", "duration_s=40")
    file, out = EXPERIMENTS / "stationary.toml", tmp_path / "out"

    def told(*words: object) -> str:
        done = command(*words)
        assert done.returncode == 0, done.stderr
        return done.stdout

    told("init", "--law", tmp_path / "mine.py")
    assert "law mine.py:MyLaw with gains firm" in told("fly", file, *law)
    matrix = write(
        tmp_path / "m.toml",
        '[flight]\nduration_s = 40.0\nlaw.name = "mine.py:MyLaw"\n[matrix]\nplant = ["kinematic", "lagged"]\n'
        '"law.gains" = ["gentle", "firm"]\n',
    )
    assert "4 flown, 0 earlier, 0 failed" in told("run", matrix, "--out", out, "--workers", 2, "--log", "none")
    assert "margin to the limit cycle" in told("compare", out)
    key = harness.load_results(out)["key"][0]
    told("view", f"{out}:{key}", "--save", tmp_path / "a.rrd")
    told("view", out, "--pair", key, "--save", tmp_path / "pair.rrd")
    assert not re.search(r"(limit cycle|gain margin) +unknown", told("predict", file, *law))
    searched = ("--over", "law.k=0.2:4", "--minimise", "convergence_time_s", "--flights", 4, "--workers", 1)
    told("tune", file, *law, "--set", "plant=kinematic", *searched, "--out", tmp_path / "tuned")
    assert "law mine.py:MyLaw" in told("fly", tmp_path / "tuned" / "best.toml")


@pytest.mark.parametrize(
    ("start", "outcome", "reason"),
    [
        ("1 / 0", "the law cannot start: ZeroDivisionError", "the law raised ZeroDivisionError"),
        ("lambda o: Guidance(o.time * float('nan'), 0, 0, 0, 0, 0)", "the law commanded nan", "not finite"),
    ],
)
def test_a_law_that_fails_is_told_by_fly_run_and_predict(tmp_path: Path, start: str, outcome: str, reason: str) -> None:
    body = f"\n    def start(self, context): return {start}\n    def broken_conditions(self, ratio): return []\n"
    words = (
        EXPERIMENTS / "stationary.toml",
        "--set",
        f"law.name={law_in(tmp_path, body)}:Own",
        "--set",
        "law.gains=custom",
    )
    flown = invoke("fly", *words)
    assert flown.exit_code == 1
    assert f"outcome: invalid: {outcome}" in flown.output
    ran = invoke("run", *words, "--out", tmp_path / "out", "--workers", 0, "--log", "all")
    assert "1 flown, 0 earlier, 1 failed" in ran.output
    assert outcome in harness.load_results(tmp_path / "out")["reason"][0]
    assert reason in invoke("predict", *words).output


def test_a_file_is_read_again_when_it_has_changed(tmp_path: Path) -> None:
    law = f"{law_in(tmp_path, WHOLE.format(answer='0.1'))}:Own"
    before = time.time_ns() - 10**9
    os.utime(tmp_path / "own.py", ns=(before, before))
    assert harness.law(law) == harness.law(law)
    law_in(tmp_path, WHOLE.format(answer="0.2"))  # of the same size
    flight = harness.Flight(plant="kinematic", law=harness.law(law), duration=1.0)
    assert harness.simulate(flight)["heading_rate_command"][0] == 0.2


def test_an_import_in_a_function_is_the_laws_own_and_one_for_scripts_is_not_run(own: Path) -> None:
    text = PLAIN.replace("from leaning import lean\n", "").replace(
        "        share =", "        from leaning import lean\n\n        share ="
    )
    script = "if __name__ == '__main__':\n    import script\n"
    write(own.parent / "script.py", "raise RuntimeError('it is run')\n")
    write(own.parent / "field.py", f"from __future__ import annotations\n{text}\n{script}")
    flight = harness.Flight(plant="kinematic", law=harness.law("field.py:Field"), duration=30.0)
    assert "law/leaning.py" in files(flight)
    assert "law/script.py" not in files(flight)
    before = harness.simulate(flight)
    assert before.outcome is Outcome.COMPLETED
    write(own.parent / "leaning.py", LEANING.replace("0.02", "0.05"))
    edited = replace(flight, law=harness.law("field.py:Field"))
    assert harness.simulate(edited).digest != before.digest


def test_a_worker_whose_law_hangs_or_exits_costs_that_flight_alone(tmp_path: Path) -> None:
    file = law_in(
        tmp_path,
        """
    does: int = 0
    def start(self, context):
        def step(o):
            while self.does == 1 and o.time > 0.2: pass
            if self.does == 2: raise SystemExit(5)
            return Guidance(0.05, 0.0, 0.0, 0.0, 0.0, 0.0)
        return step
    def broken_conditions(self, speed_ratio): return []
""",
    )
    flight = f'[flight]\nplant = "kinematic"\nduration_s = 1.0\nlaw.name = "{file}:Own"\n'
    matrix = write(tmp_path / "m.toml", f'{flight}[matrix]\n"law.does" = [0, 1, 2]\n')
    results = harness.run(matrix, tmp_path / "out", workers=1, log="none", timeout=1.0)
    assert list(results["outcome"]) == ["completed", "timeout", "invalid"]
    assert results["reason"][2] == "the law raised SystemExit: 5"


@pytest.mark.parametrize("has_its_hash", [True, False])
def test_a_foreign_journal_runs_no_file_by_naming_it(own: Path, has_its_hash: bool) -> None:
    """Not even one that is here, and whose hash it knows: what defines no such class is no law."""
    fly_matrix(own, Path("out"))
    script = write(own.parent / "cleanup.py", PLAIN.partition("@dataclass")[0])
    key, marker = harness.load_results("out")["key"][0], own.parent / "was_run"
    hashes = {"law/cleanup.py": content_hash(script.read_bytes()), "law/leaning.py": content_hash(LEANING.encode())}
    with sqlite3.connect("out/journal.sqlite") as journal:
        name = "json_set(settings, '$.law.name', ?)"
        journal.execute(
            f"UPDATE flights SET settings = {name}", (f"{script}:Field" if has_its_hash else "cleanup:Field",)
        )
        ((decides,),) = journal.execute("SELECT decides FROM versions").fetchall()
        version = json.loads(decides)
        kept = {file: digest for file, digest in version["content"].items() if not file.startswith("law/")}
        version["content"] = {**kept, **(hashes if has_its_hash else {})}
        journal.execute("UPDATE versions SET decides = ?", (json.dumps(version),))
    journal.close()
    marker.unlink()
    assert invoke("fly", f"out:{key}").exit_code == 2
    for words in (("show", "out"), ("show", f"out:{key}"), ("compare", "out", "--by", "law.k"), ("view", f"out:{key}")):
        invoke(*words, *(("--save", "a.rrd") if words[0] == "view" else ()))
    invoke("run", own, "--out", "out", "--workers", 0, "--set", "law.name=nftsm", "--set", "law.k=[]")
    assert not marker.exists()
