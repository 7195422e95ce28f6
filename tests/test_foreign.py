"""What somebody else wrote: a journal or an airframe's folder runs nothing and writes nothing that nobody asked for."""

import json
import os
import shutil
import sqlite3
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsbsim
import pytest

import harness
from harness.files import content_hash
from harness.runs.journal import JOURNAL
from tests import builders
from tests.builders import FLIGHT, HERE, WORKERS, copied_airframe, fly_matrix, write
from tests.confined import Confined, Ended

TEMPORARY = "standoff-harness-"  # begins the name of what a command removes when its process ends

SIXDOF = """\
title = "A title"
question = "A question?"
[flight]
plant = "sixdof"
duration_s = 1.0
[flight.law]
name = "nftsm"
[matrix]
plant = ["kinematic", "sixdof"]
seed = [0, 1]
"""


@pytest.fixture(scope="module")
def confined(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Confined]:
    with Confined(tmp_path_factory.mktemp("confined")) as process:
        yield process


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with a 6-DOF flight."""
    folder = tmp_path_factory.mktemp("flown")
    fly_matrix(write(folder / "matrix.toml", SIXDOF), folder / "run")
    return folder / "run"


def foreign(
    flown: Path,
    folder: Path,
    settings: Callable[[dict[str, Any]], object] = lambda settings: None,
    model: str = "",
) -> str:
    """A copy of the run as `folder`/run, with one 6-DOF row changed; `model` ends its airframe's model. Its key."""
    (folder / "run").mkdir(parents=True)
    shutil.copy(flown / JOURNAL, folder / "run")
    journal = sqlite3.connect(folder / "run" / JOURNAL)
    (key, text, version) = journal.execute(
        "SELECT key, settings, version FROM flights WHERE json_extract(settings, '$.plant') = 'sixdof'"
    ).fetchone()
    row = json.loads(text)
    settings(row)
    journal.execute("UPDATE flights SET settings = ? WHERE key = ?", (json.dumps(row), key))
    if model:
        (decides,) = journal.execute("SELECT decides FROM versions WHERE id = ?", (version,)).fetchone()
        content = json.loads(decides)["content"]
        (before,) = journal.execute("SELECT content FROM files WHERE hash = ?", (content["aircraft/model"],)).fetchone()
        changed = before.replace(b"</fdm_config>", f"{model}</fdm_config>".encode())
        decides = decides.replace(content["aircraft/model"], content_hash(changed))
        journal.execute("INSERT INTO files VALUES (?, ?)", (content_hash(changed), changed))
        journal.execute("UPDATE versions SET decides = ? WHERE id = ?", (decides, version))
    journal.commit()
    journal.close()
    return str(key)


def every_command(confined: Confined, key: str, folder: Path) -> dict[str, Ended]:
    """How each command that reads a journal ends, by its name; none writes elsewhere than to `out` and the journal."""
    (folder / "out").mkdir()
    calls = {
        "fly": f"fly run:{key} --rrd out/fly.rrd",
        "show": f"show run:{key}",
        "show all": "show run",
        "view": f"view run:{key} --save out/view.rrd",
        "plot": f"plot run:{key} --what track --save out/track.svg",
        "compare": "compare run",
        "report": "report run --out out/report.html",
        "export": f"export run:{key} --to csv --out out/flight.csv",
        "export all": "export run --to csv --out out/table.csv",
    }
    ended = {}
    for name, words in calls.items():
        ended[name] = confined.run(words.split(), folder)
        assert "Traceback" not in ended[name].stderr, (name, ended[name].stderr)
        assert ended[name].code in (0, 1, 2), (name, ended[name])
    assert {path.name for path in folder.iterdir() if not path.name.startswith(TEMPORARY)} == {"run", "out"}
    return ended


def told(ended: Ended) -> str:
    """The one line that a command refused with."""
    assert ended.code == 2, ended
    (line,) = ended.stderr.splitlines()
    return line


@pytest.mark.parametrize(
    ("section", "name"),
    [
        ('<output name="{folder}/written.csv" type="CSV" rate="10"><position>ON</position></output>', "output"),
        ('<output name="127.0.0.1" type="SOCKET" port="9" rate="10"><position>ON</position></output>', "output"),
        ('<output file="{folder}/output.xml"/>', "output"),
        ('<input port="0"/>', "input"),
        ('<input type="QTJSBSIM" port="0"/>', "input"),
        ('<child name="ultra_stick_25e"/>', "child"),
        ('<system file="{folder}/system.xml"/>', 'system file="{folder}/system.xml"'),
        ('<propulsion><engine file="/dev/zero"/></propulsion>', 'engine file="/dev/zero"'),
    ],
)
def test_a_model_that_would_write_or_read_another_file_or_open_a_socket_is_refused(
    flown: Path, tmp_path: Path, confined: Confined, section: str, name: str
) -> None:
    section, name = (text.replace("{folder}", str(tmp_path / "elsewhere")) for text in (section, name))
    key = foreign(flown, tmp_path / "here", model=section)
    ended = confined.run(["fly", f"run:{key}"], tmp_path / "here")
    assert f"<{name}> is not read, only " in told(ended)
    assert not (tmp_path / "elsewhere").exists()


def test_no_command_runs_a_model_that_would_write_a_file(flown: Path, tmp_path: Path, confined: Confined) -> None:
    file = tmp_path / "written.csv"
    key = foreign(flown, tmp_path / "here", model=f'<output name="{file}" type="CSV" rate="10"/>')
    ended = every_command(confined, key, tmp_path / "here")
    for command in ("fly", "view", "plot", "export"):
        assert "<output> is not read, only " in told(ended[command])
    for command in ("show", "show all", "compare", "report", "export all"):
        assert ended[command].code == 0
    assert not file.exists()


@pytest.mark.parametrize("how", ["device", "pipe"])
def test_a_track_that_is_no_file_is_refused(how: str, flown: Path, tmp_path: Path, confined: Confined) -> None:
    track = Path("/dev/zero")
    if how == "pipe":
        os.mkfifo(track := tmp_path / "pipe")
    key = foreign(flown, tmp_path / "here", lambda row: row["target"].update(track=str(track)))
    ended = every_command(confined, key, tmp_path / "here")
    for command in ("fly", "view", "plot", "export"):
        assert f"{track}: is a pipe or a device, must be a file" in told(ended[command])
    for command in ("show", "show all", "compare", "report", "export all"):
        assert ended[command].code == 0
    file = write(tmp_path / "one.toml", SIXDOF.partition("[matrix]")[0])
    for words in (["fly"], ["check"], ["run", "--out", "out"]):
        refused = told(confined.run([*words, str(file), "--set", f"target.track={track}"], tmp_path))
        assert f"{track}: is a pipe or a device, must be a file" in refused


@pytest.mark.parametrize("name", ["airframe.toml", "inner_loop.toml", "identified.toml", "mine.xml"])
def test_a_file_of_an_airframe_that_is_a_pipe_is_refused(name: str, tmp_path: Path, confined: Confined) -> None:
    airframe = copied_airframe("aerosonde", tmp_path / "mine")
    (airframe / name).unlink()
    os.mkfifo(airframe / name)
    text = SIXDOF.partition("[matrix]")[0].replace("[flight]", '[flight]\naircraft = "mine"')
    plant = "lagged" if name == "identified.toml" else "sixdof"
    assert "mine" in told(
        confined.run(["fly", str(write(tmp_path / "one.toml", text)), "--set", f"plant={plant}"], tmp_path)
    )


@pytest.mark.parametrize(
    "words",
    [
        "fly",
        "check",
        "run --out out",
        "show",
        "compare",
        "plot --save out/a.svg",
        "view --save out/a.rrd",
        "export --to csv --out out/a",
    ],
)
def test_a_device_is_no_settings_file_and_no_recording(words: str, tmp_path: Path, confined: Confined) -> None:
    (tmp_path / "out").mkdir()
    command, *more = words.split()
    assert told(confined.run([command, "/dev/zero", *more], tmp_path)).startswith("/dev/zero: ")


def test_a_table_of_results_that_is_a_pipe_is_not_read(flown: Path, tmp_path: Path, confined: Confined) -> None:
    key = foreign(flown, tmp_path)
    os.mkfifo(tmp_path / "run" / "flights.parquet")
    assert {ended.code for ended in every_command(confined, key, tmp_path).values()} == {0}


def test_a_row_whose_law_is_code_of_somebody_else_is_shown_and_never_run(
    flown: Path, tmp_path: Path, confined: Confined
) -> None:
    law = write(tmp_path / "law.py", f"open({str(tmp_path / 'ran')!r}, 'w')")
    key = foreign(flown, tmp_path / "here", lambda row: row["law"].update(name=f"{law}:Law"))
    ended = every_command(confined, key, tmp_path / "here")
    for command in ("fly", "view", "plot", "export"):
        assert "flight.law.name: " in told(ended[command])
    for command in ("show", "show all", "compare", "report", "export all"):
        assert ended[command].code == 0
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize("name", ["unknown", "os:system"])
def test_a_row_with_a_law_that_is_not_here_is_shown(name: str, flown: Path, tmp_path: Path, confined: Confined) -> None:
    key = foreign(flown, tmp_path, lambda row: row["law"].update(name=name))
    assert "flight.law.name: " in told(confined.run(["fly", f"run:{key}"], tmp_path))
    assert f"law {name} with gains fitted, on plant sixdof" in confined.run(["show", f"run:{key}"], tmp_path).stdout


@pytest.mark.parametrize("name", ["..", "", ".", "/", "x/..", "a\0b", "a" * 300])
def test_an_airframe_whose_name_no_folder_can_have_is_refused(
    name: str, flown: Path, tmp_path: Path, confined: Confined
) -> None:
    key = foreign(flown, tmp_path, lambda row: row.update(aircraft=name))
    assert told(confined.run(["fly", f"run:{key}"], tmp_path)).startswith("run: a flight has aircraft = ")


def test_rows_without_what_every_flight_has_are_told(flown: Path, tmp_path: Path, confined: Confined) -> None:
    changes: dict[str, Callable[[dict[str, Any]], object]] = {
        "plant": lambda row: row.update(plant="unknown"),
        "law.name": lambda row: row.pop("law"),
        "aircraft": lambda row: row.pop("aircraft"),
    }
    for name, change in changes.items():
        key = foreign(flown, tmp_path / name, change)
        ended = every_command(confined, key, tmp_path / name)
        for command in ("show", "show all", "compare", "report"):
            assert f"{JOURNAL}: " in told(ended[command])
            assert name in told(ended[command])


def test_an_inner_loop_in_the_folder_of_an_airframe_is_refused(tmp_path: Path, confined: Confined) -> None:
    airframe = copied_airframe("aerosonde", tmp_path / "mine")
    loop = Path(harness.__file__).parents[1] / "autopilot" / "inner_loop.xml"
    file = write(
        tmp_path / "one.toml", SIXDOF.partition("[matrix]")[0].replace("[flight]", '[flight]\naircraft="mine"')
    )
    assert confined.run(["fly", str(file)], tmp_path).code == 0
    shutil.copy(loop, airframe)
    assert "JSBSim would read it instead of the inner loop of the harness" in told(
        confined.run(["fly", str(file)], tmp_path)
    )


# Functions of JSBSim that end the process: each reads the other, and a division of whole numbers by 0 after 2 s.
ENDLESS = """<system name="endless"><function name="a/c"><sum><property>a/d</property><value>1</value></sum></function>
<function name="a/d"><sum><property>a/c</property><value>1</value></sum></function></system>"""
BY_ZERO = """<system name="by zero"><channel name="c"><fcs_function name="a/b"><function><mod><value>7</value>
<difference><value>3</value><floor><property>simulation/sim-time-sec</property></floor></difference></mod></function>
</fcs_function></channel></system>"""
ROOT_OF_MINUS = """<system name="root"><channel name="c"><fcs_function name="a/b"><function><sqrt><difference>
<value>2</value><property>simulation/sim-time-sec</property></difference></sqrt></function>
<output>fcs/rudder-pos-rad</output></fcs_function></channel></system>"""
NO_BODY = """<pointmass name="none"><weight unit="KG"> -20 </weight>
<location unit="M"> <x> 0 </x> <y> 0 </y> <z> 0 </z> </location></pointmass></mass_balance>"""


def with_model(folder: Path, text: str, before: str = "</fdm_config>", of: str = "aerosonde") -> Path:
    """An airframe of somebody else as `folder`, whose model has this text too."""
    airframe = copied_airframe(of, folder)
    model = airframe / f"{airframe.name}.xml"
    write(model, model.read_text(encoding="utf-8").replace(before, text if before in text else f"{text}{before}"))
    return airframe


def test_a_model_that_ends_the_process_at_its_start_is_one_line_of_every_command(tmp_path: Path) -> None:
    with_model(tmp_path / "endless", ENDLESS)
    file = write(tmp_path / "one.toml", SIXDOF.replace("[flight]", '[flight]\naircraft = "endless"'))
    for ended in (builders.command("check", file), builders.command("run", file, "--out", tmp_path / "out")):
        assert (ended.returncode, ended.stdout) == (2, "")
        (line,) = ended.stderr.splitlines()
        assert line.endswith("flight.aircraft: the start of the model: the process was ended by SIGSEGV")


def test_a_model_that_ends_the_process_in_flight_is_a_row_with_the_reason(tmp_path: Path) -> None:
    with_model(tmp_path / "late", BY_ZERO)
    text = SIXDOF.replace("duration_s = 1.0", "duration_s = 4.0\nstart.airspeed_mps = 25.0")
    text = text.replace('plant = ["kinematic", "sixdof"]', 'aircraft = ["aerosonde", "late"]')
    file = write(tmp_path / "two.toml", text)
    fly_matrix(file, tmp_path / "run", options=WORKERS)
    rows = harness.load_results(tmp_path / "run")
    assert rows["outcome"].tolist() == ["completed", "completed", "worker_died", "worker_died"]
    assert rows["reason"].tolist()[2:] == ["its worker was ended by SIGFPE"] * 2
    fly_matrix(file, tmp_path / "here", options=HERE)  # without workers
    here = harness.load_results(tmp_path / "here")
    assert here["outcome"].tolist() == rows["outcome"].tolist()
    assert here["digest"].tolist() == rows["digest"].tolist()
    one = write(tmp_path / "one.toml", text.partition("[matrix]")[0])
    alone = builders.command("fly", one, "--set", "aircraft=late")
    assert alone.returncode == 1
    assert "outcome: worker_died: the flight: the process was ended by SIGFPE" in alone.stdout


def test_a_flight_of_which_any_number_is_not_finite_ends(tmp_path: Path) -> None:
    """A flying wing's rudder moves nothing, so nothing else tells of it."""
    airframe = with_model(tmp_path / "wing", ROOT_OF_MINUS, of="skywalker_x8")
    log = harness.simulate(replace(FLIGHT, plant="sixdof", aircraft=str(airframe), duration=5.0))
    assert (log.outcome, log.reason) == ("invalid", "a number of the simulated aircraft is not finite")
    assert 1.9 < log["time"][-1] < 2.1


def test_a_model_that_is_no_body_is_refused_once_it_is_loaded(tmp_path: Path) -> None:
    with_model(tmp_path / "light", NO_BODY, before="</mass_balance>")
    file = write(tmp_path / "one.toml", SIXDOF.replace("[flight]", '[flight]\naircraft = "light"'))
    ended = builders.command("check", file)
    assert "the mass of the model is -" in ended.stderr
    assert "kg, must be above 0" in ended.stderr
    assert ended.returncode == 2


MODELS = Path(jsbsim.get_default_root_dir()) / "aircraft"


@pytest.mark.parametrize(
    ("words", "why"),
    [
        ("there/c172p/c172p.xml --out there", "there/c172p holds the model itself, which would be overwritten"),
        ("c172p --out there", "there/c172p is there, and is no adopted model"),
        ("c172p --airspeed nan", "--airspeed: nan, must be a finite number"),
        ("c172p --bandwidth nan", "--bandwidth: nan, must be a finite number"),
        ("c172p --controls pipe", "--controls: pipe: is a pipe or a device"),
        ("c172p --controls reset.toml", "elevator: writes simulation/reset: a model may read"),
        ("c172p --controls output.toml", "is no name of a property, which is like fcs/elevator-cmd-norm"),
        ("c172p --controls null.toml", "is no name of a property"),
        ("pipe --out out", "guard: pipe: must be a file"),
        ("/dev/zero --out out", "guard: /dev/zero: must be a file"),
        ('there/c172p/a"b.xml --out out', "is to be a folder's name: letters, digits"),
        ("there/c172p/...xml --out out", "is to be a folder's name: letters, digits"),
    ],
)
def test_an_adoption_that_would_overwrite_hang_or_write_elsewhere_is_one_line(
    words: str, why: str, tmp_path: Path, confined: Confined
) -> None:
    (tmp_path / "there").mkdir()
    theirs = Path(shutil.copytree(MODELS / "c172p", tmp_path / "there" / "c172p"))
    for name in ('a"b.xml', "...xml"):
        shutil.copy(theirs / "c172p.xml", theirs / name)
    os.mkfifo(tmp_path / "pipe")
    write(tmp_path / "reset.toml", 'elevator = "simulation/reset"')
    more = "</output></fcs_function></channel></system><output name='out.csv'/>"
    write(tmp_path / "output.toml", f'elevator = "a/b{more}"')
    write(tmp_path / "null.toml", 'throttle = ["fcs/throttle-cmd-norm\\u0000"]')
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*") if path.is_file()}
    assert why in told(confined.run(["adopt", *words.split()], tmp_path))
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*") if path.is_file()} == before


@pytest.mark.parametrize("text", [ENDLESS, BY_ZERO], ids=["at its load", "in flight"])
def test_a_model_that_ends_the_process_is_not_adopted_and_leaves_nothing(text: str, tmp_path: Path) -> None:
    theirs = Path(shutil.copytree(MODELS / "c172p", tmp_path / "c172p"))
    model = (theirs / "c172p.xml").read_text(encoding="utf-8")
    write(theirs / "c172p.xml", model.replace("</fdm_config>", f"{text}</fdm_config>"))
    ended = builders.command("adopt", theirs / "c172p.xml", "--out", tmp_path / "out")
    assert ended.returncode == 1
    assert "the process was ended by SIG" in ended.stderr
    assert list((tmp_path / "out").iterdir()) == []
