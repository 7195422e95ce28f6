"""What decides a flight beside its settings: files by their content, whose change makes another flight and is told."""

import json
import os
import shutil
import sqlite3
import subprocess
from contextlib import closing
from pathlib import Path

import pandas as pd
import pytest

import harness
from harness.files import content_hash
from harness.runs.journal import JOURNAL
from harness.runs.results import versions
from tests.builders import (
    MATRIX,
    ROOT,
    command,
    copied_airframe,
    digests,
    fly_matrix,
    invoke,
    words_of,
    write,
)

JOURNALS = Path(__file__).parent / "journals"  # as earlier versions wrote them


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return write(tmp_path / "matrix.toml", MATRIX)


def test_a_moved_or_linked_project_with_its_own_airframe_keeps_its_keys(tmp_path: Path) -> None:
    project, moved, link = tmp_path / "project", tmp_path / "moved", tmp_path / "link"
    project.mkdir()
    copied_airframe("aerosonde", project / "mine")
    text = MATRIX.replace("duration_s", 'aircraft = "mine"\nduration_s').replace("count = 5", "count = 1")
    write(project / "matrix.toml", text)
    fly_matrix(project / "matrix.toml", project / "out")
    before = digests(project / "out")
    link.symlink_to(project)
    assert fly_matrix(link / "matrix.toml", project / "out").earlier == len(before) == 2
    link.unlink()
    project.rename(moved)
    assert fly_matrix(moved / "matrix.toml", moved / "out").earlier == 2
    assert digests(moved / "out") == before
    data = moved / "mine" / "airframe.toml"
    data.write_text(data.read_text() + "\n# changed\n")
    assert fly_matrix(moved / "matrix.toml", moved / "out").done == 2


def test_the_journal_has_the_content_of_every_file_that_a_flight_read(tmp_path: Path) -> None:
    copied_airframe("aerosonde", tmp_path / "mine")
    text = MATRIX.replace("duration_s", 'aircraft = "mine"\nduration_s').replace("count = 5", "count = 1")
    fly_matrix(write(tmp_path / "matrix.toml", text.replace('"kinematic", ', '"lagged", ')), tmp_path / "out")
    shutil.rmtree(tmp_path / "mine")
    with closing(sqlite3.connect(tmp_path / "out" / JOURNAL)) as journal:
        files = dict(journal.execute("SELECT hash, content FROM files"))
        decides = [json.loads(text)["content"] for (text,) in journal.execute("SELECT decides FROM versions")]
    for name in ("identified.toml", "model", "airframe.toml", "inner_loop.toml"):
        assert {f"aircraft/{name}" in each for each in decides} >= {True}, name
    for content in decides:
        assert {digest: content_hash(files[digest]) for digest in content.values()} == {d: d for d in content.values()}


def test_rows_of_another_version_are_marked(file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "out"
    fly_matrix(file, out, "seed=0")
    assert "*" not in invoke("show", out).stdout
    monkeypatch.setattr("harness.key.PHYSICS_VERSION", 99)
    fly_matrix(file, out, "seed=1")
    lines = invoke("show", out).stdout.splitlines()
    results = harness.load_results(out)
    for key, seed in zip(results["key"], results["seed"], strict=True):
        assert any(line.startswith(f"{key[:8]}{'*' if seed == 0 else ' '}") for line in lines)
    assert lines[-1].startswith("* flown by another version: physics ")
    assert lines[-1].endswith(" (here 99); the same command flies it anew")


@pytest.mark.parametrize(("form", "metrics"), [(1, 2), (2, 5)])
def test_a_journal_of_an_earlier_format_is_read_compared_flown_and_run_on(
    form: int, metrics: int, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    with closing(sqlite3.connect(out / JOURNAL)) as journal:
        journal.executescript((JOURNALS / f"format_{form}.sql").read_text(encoding="utf-8"))
    before = (out / JOURNAL).read_bytes()
    keys = digests(out)
    assert len(keys) == 2
    shown = invoke("show", out)
    assert shown.exit_code == 0
    assert "* flown by another version: " in shown.stdout
    for key in keys:
        assert invoke("show", f"{out}:{key}").exit_code == 0
    for words in (["compare", out], ["report", out, "--out", tmp_path / "report.html"]):
        with (
            pytest.warns(UserWarning, match="flown with version 3 of the physics, of which this harness has"),
            pytest.warns(UserWarning, match=f"flown with version {metrics} of the metrics, of which this harness has"),
        ):
            assert invoke(*words).exit_code == 0
    table = tmp_path / "table.csv"
    assert invoke("export", out, "--to", "csv", "--out", table).exit_code == 0
    assert len(pd.read_csv(table)) == 2
    for key, plant in zip(keys, ("kinematic", "sixdof"), strict=True):
        if plant == "kinematic" or form == 1:  # the other journal came without the files of its airframe
            assert invoke("fly", f"{out}:{key}", "--json").exit_code == 0
    assert (out / JOURNAL).read_bytes() == before
    with closing(sqlite3.connect(out / JOURNAL)) as journal:
        ((settings,),) = journal.execute("SELECT settings FROM runs").fetchall()
    progress = fly_matrix(write(tmp_path / "m.toml", settings), out, "seed=0")
    assert progress.done == 2
    assert keys.items() <= digests(out).items()


def append(path: Path, text: str) -> None:
    path.write_text(path.read_text(encoding="utf-8") + text, encoding="utf-8")


@pytest.fixture
def own_copy(tmp_path: Path) -> Path:
    """A folder with copies of the packages, in which files may be edited: a Python started there uses them."""
    for package in ("harness", "autopilot", "aircraft"):
        shutil.copytree(ROOT / package, tmp_path / "copy" / package, ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path / "copy"


def in_copy(copy: Path, *words: object) -> str:
    """The command, of the copy: of `run` what it flew, else its last line."""
    done = subprocess.run(
        words_of(*words),
        cwd=copy, env={**os.environ, "PYTHONPATH": str(copy)}, capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()[-2] if words[0] == "run" else done.stderr.splitlines()[-1]


def test_an_edited_law_inner_loop_airframe_or_track_is_a_new_flight_and_a_mix_is_told(
    own_copy: Path, tmp_path: Path
) -> None:
    track = own_copy / "track.csv"
    track.write_text("time_s,north_m,east_m\n" + "".join(f"{t},{t},0\n" for t in range(5)))
    file, out = own_copy / "m.toml", tmp_path / "out"
    file.write_text(
        '[flight]\nduration_s = 1.0\n[flight.law]\nname = "smc"\n[flight.target]\ntrack = "track.csv"\n'
        '[matrix]\nplant = ["kinematic", "sixdof"]\n'
    )
    run_it = ("run", file, "--out", out, "--workers", 0, "--log", "none")
    assert in_copy(own_copy, *run_it).startswith("2 flown, 0 earlier")
    edits = [  # a file, what is added to it, how many of the flights are new
        (own_copy / "autopilot" / "smc.py", "\n# another law\n", 2),
        (own_copy / "autopilot" / "inner_loop.xml", "<!-- another loop -->\n", 1),
        (own_copy / "aircraft" / "ultra_stick_25e" / "ultra_stick_25e.xml", "<!-- another airframe -->\n", 1),
        (track, "5,9,0\n", 2),
    ]
    assert {len(counts) for counts in versions(out).values()} == {1}
    for path, text, new in edits:
        append(path, text)
        assert in_copy(own_copy, *run_it).startswith(f"{new} flown, {2 - new} earlier"), path
        assert in_copy(own_copy, *run_it).startswith("0 flown, 2 earlier"), path
    mixed = {what: counts for what, counts in versions(out).items() if len(counts) > 1}
    assert list(mixed) == [
        "autopilot/smc.py",
        f"the track {track}",
        "autopilot/inner_loop.xml",
        "aircraft/model of ultra_stick_25e",
    ]
    assert list(mixed["autopilot/smc.py"].values()) == [2, 6]
    refused = command("compare", out)
    assert refused.returncode == 2
    (line,) = refused.stderr.splitlines()
    assert "of different versions, which a comparison must not mix: autopilot/smc.py has 2 versions, of 2 and" in line


def test_a_row_of_another_version_is_flown_with_a_warning_that_has_the_largest_deviation(
    own_copy: Path, tmp_path: Path
) -> None:
    file, out = own_copy / "m.toml", tmp_path / "out"
    file.write_text('[flight]\nplant = "kinematic"\nduration_s = 10.0\n[flight.law]\nname = "smc"\n')
    in_copy(own_copy, "run", file, "--out", out, "--workers", 0)
    (key,) = harness.load_results(out)["key"]
    law = own_copy / "autopilot" / "smc.py"
    again = ("fly", f"{out}:{key[:5]}", "--json")
    assert in_copy(own_copy, *again).endswith("to the last bit")
    append(law, "\n# another text of the same law\n")
    assert in_copy(own_copy, *again).endswith("to the last bit")
    law.write_text(law.read_text().replace("c1 * atan(", "1.001 * c1 * atan("))
    told = in_copy(own_copy, *again)
    assert told.startswith("warning: differs from the stored flight (changed since: autopilot/smc.py): ")
    assert "at the end differs by" in told
