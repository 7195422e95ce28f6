"""A model of somebody else is a program: it reads and writes nothing but itself, and takes no process with it."""

import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import jsbsim
import psutil
import pytest

from harness import fence
from harness.child import ChildError, in_child, limited
from harness.fence import FenceError, checked, fenced
from harness.plants.model import FT, SLUG
from tests.builders import ROOT, write

LIBRARY = Path(jsbsim.get_default_root_dir())
QUICK = 20.0  # s within which each hostile case is over

MODEL = """\
<fdm_config name="tiny" version="2.0">
  <metrics><wingarea unit="M2"> 1 </wingarea><wingspan unit="M"> 2 </wingspan><chord unit="M"> 0.5 </chord></metrics>
  <mass_balance>
    <ixx> 1 </ixx><iyy> 1 </iyy><izz> 1 </izz><emptywt> 10 </emptywt>
    <location name="CG"><x> 0 </x><y> 0 </y><z> 0 </z></location>
  </mass_balance>
  <ground_reactions/>
  <propulsion/>
  <flight_control name="FCS">
    <channel name="pitch">
      <pure_gain name="fcs/twice"><input> fcs/elevator-cmd-norm </input><gain> 2 </gain></pure_gain>
    </channel>
  </flight_control>
  <aerodynamics><axis name="LIFT"/></aerodynamics>
</fdm_config>
"""
GAIN = '<pure_gain name="fcs/twice">'


def tiny(folder: Path, change: Callable[[str], str] = lambda text: text) -> Path:
    """The folder of a model so changed."""
    folder.mkdir()
    write(folder / f"{folder.name}.xml", change(MODEL))
    return folder


def section(text: str) -> Callable[[str], str]:
    """The change of a model that adds this section."""
    return lambda model: model.replace("</fdm_config>", f"{text}</fdm_config>")


def gain(text: str) -> Callable[[str], str]:
    """The change of a model that gives its component this as well."""
    return lambda model: model.replace(GAIN, f"{GAIN}{text}")


def refused(model: Path) -> str:
    """The one line that the model is refused with, within the time."""
    begun = time.monotonic()
    with pytest.raises(FenceError) as error:
        fenced(model, LIBRARY)
    assert time.monotonic() - begun < QUICK
    (line,) = str(error.value).splitlines()
    return line


HOSTILE: dict[str, tuple[Callable[[str], str], str]] = {
    "reset": (gain("<output> simulation/reset </output>"), "writes simulation/reset"),
    "trim": (gain("<output>/fdm/jsbsim[0]/simulation[0]/do_simple_trim</output>"), "simulation/do_simple_trim"),
    "named reset": (lambda model: model.replace("fcs/twice", "simulation/reset"), "writes simulation/reset"),
    "declared": (section('<system><property value="1">simulation/write-state-file</property></system>'), "writes sim"),
    "upwards": (gain("<output> fcs/../simulation/reset </output>"), "writes fcs/../simulation/reset"),
    "second line": (gain("<output>\n \n simul<!-- -->ation/reset \n fcs/x </output>"), "writes simulation/reset"),
    "distributed": (
        section(
            '<system><channel><distributor><case><property value="1">simulation/reset</property></case></distributor>'
            "</channel></system>"
        ),
        "writes simulation/reset",
    ),
    "delay": (gain("<delay> 1e9 </delay>"), "<delay> is 1e9, must be a number from 0 to 60 s"),
    "frames": (gain('<delay type="frames"> -1 </delay>'), "<delay> is -1, must be a number from 0 to 60000 frames"),
    "delay of a property": (gain("<delay> fcs/large </delay>"), "<delay> is fcs/large, must be a number from 0"),
    "no mass": (lambda model: model.replace("<emptywt> 10", "<emptywt> 0"), "<emptywt> is 0, must be above 0"),
    "negative": (lambda model: model.replace("<iyy> 1", "<iyy> -1"), "<iyy> is -1, must be above 0"),
    "NaN": (lambda model: model.replace("<izz> 1", "<izz> NaN"), "<izz> has 'NaN': a number must be finite"),
    "infinite": (lambda model: model.replace("<gain> 2", "<gain> 1e999"), "a number must be finite"),
    "bomb": (
        lambda model: '<!DOCTYPE b [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;">]>\n' + model,
        "xml:1: a DOCTYPE is not read",
    ),
    "deep": (section("<system>" * 20_000 + "</system>" * 20_000), "elements stand more than 60 deep"),
    "many": (
        section("<system>" + "<a/>" * fence.MOST_ELEMENTS + "</system>"),
        "more than 60000 elements",
    ),
    "another model": (section('<child name="other"/>'), "<child> is another model, which is not read"),
    "above": (section('<system file="../other/secret"/>'), "a model includes files in its own folder only"),
    "absolute": (section('<system file="/etc/passwd"/>'), "a model includes files in its own folder only"),
    "missing": (section('<autopilot file="none"/>'), "there is no none.xml in"),
    "an engine that is none": (section('<aerodynamics file="tiny"/>'), "<fdm_config> stands where <aerodynamics> must"),
    "broken": (lambda model: model[:-20], "not valid XML"),
    "no model": (lambda model: "<planet/>", "<planet> is no JSBSim model"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_model_is_refused_with_its_file_and_line(name: str, tmp_path: Path) -> None:
    change, told = HOSTILE[name]
    model = tiny(tmp_path / "tiny", change)
    line = refused(model)
    assert told in line
    assert line.startswith(f"{model}/tiny.xml:")
    assert [path.name for path in model.iterdir()] == ["tiny.xml"]


@pytest.mark.parametrize("how", ["pipe", "device", "link", "folder", "linked folder", "large"])
def test_what_is_included_is_a_plain_file_of_the_folder(how: str, tmp_path: Path) -> None:
    model = tiny(tmp_path / "tiny", section('<system file="more"/>'))
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    secret = write(elsewhere / "more.xml", "<system/>")
    included = model / "more.xml"
    match how:
        case "pipe":
            os.mkfifo(included)
        case "device":
            included.symlink_to("/dev/zero")
        case "link":
            included.symlink_to(secret)
        case "folder":
            included.mkdir()
        case "linked folder":
            (model / "Systems").symlink_to(elsewhere)
        case "large":
            included.touch()
            os.truncate(included, 2 * fence.MOST_BYTES)
    told = {"device": "its own folder only", "link": "its own folder only", "linked folder": "its own folder only"}
    assert told.get(how, "must be a file" if how != "large" else "may have 20000000") in refused(model)


def test_output_and_input_are_left_out_but_for_those_of_a_component(tmp_path: Path) -> None:
    def change(model: str) -> str:
        model = section(f'<output name="{tmp_path}/out.csv" type="CSV" rate="9"/><input port="0"/><planet/>')(model)
        return gain("<output> fcs/four </output><output> simulation/integrator/rate/rotational </output>")(model)

    model = tiny(tmp_path / "tiny", change)
    (tmp_path / "copy").mkdir()
    made = fence.fence(model, tmp_path / "copy", LIBRARY)
    assert [line.rpartition(": ")[2] for line in made.left_out] == [
        "<output>", "<input>", "<planet>", "<output> simulation/integrator/rate/rotational",
    ]  # fmt: skip
    assert all(line.startswith(f"{model}/tiny.xml:") for line in made.left_out)
    root = checked(tmp_path / "copy" / "copy.xml")
    assert [output.text for output in root.iter("output")] == [" fcs/four "]
    flown, _ = loaded(tmp_path / "copy")
    flown["fcs/elevator-cmd-norm"] = 0.5
    flown.run()
    assert flown["fcs/four"] == 1.0
    assert not (tmp_path / "out.csv").exists()


def loaded(folder: Path) -> tuple[jsbsim.FGFDMExec, list[str]]:
    """A model in flight at 60 m/s, and the names of all its properties."""
    fdm = jsbsim.FGFDMExec(None)
    engines, systems = str(LIBRARY / "engine"), str(LIBRARY / "systems")
    assert fdm.load_model_with_paths(folder.name, str(folder.parent), engines, systems, True)
    fdm.disable_output()
    fdm["ic/h-sl-ft"], fdm["ic/vt-fps"] = 1000.0 / FT, 60.0 / FT
    assert fdm.run_ic()
    fdm["propulsion/set-running"] = -1
    return fdm, [line.partition(" ")[0] for line in fdm.query_property_catalog("").splitlines()]


@pytest.mark.parametrize("name", ["c172x", "c310", "Short_S23"])  # systems with entities, an override of their numbers
def test_a_fenced_model_flies_as_the_model_does_and_is_one_file(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """10 s with the throttle open; Short_S23 has 13 files and declares [0] and [1] of one property."""
    monkeypatch.chdir(tmp_path)  # where the model as it is writes its <output>
    (copy := tmp_path / name).mkdir()
    fence.fence(LIBRARY / "aircraft" / name, copy, LIBRARY)
    assert [path.name for path in copy.iterdir()] == [f"{name}.xml"]
    (before, names), (after, names_after) = loaded(LIBRARY / "aircraft" / name), loaded(copy)
    assert set(names_after) <= set(names)  # the output that is left out makes some more
    for fdm in (before, after):
        fdm["fcs/throttle-cmd-norm"] = 0.7
        for _ in range(1200):
            assert fdm.run()
    moved = [each for each in names_after if before[each] != after[each] and before[each] == before[each]]
    assert [each for each in moved if "side_friction_coeff" not in each] == []  # which JSBSim does not initialise
    assert SLUG * after["inertia/mass-slugs"] > 500.0


def test_a_model_in_a_tree_laid_out_as_jsbsims_includes_its_engines(tmp_path: Path) -> None:
    engines = tmp_path / "engine"
    engines.mkdir()
    shutil.copy(LIBRARY / "engine" / "direct.xml", engines / "mine.xml")
    (tmp_path / "aircraft").mkdir()
    thruster = '<propulsion><engine><thruster file="mine"/></engine></propulsion>'
    model = tiny(tmp_path / "aircraft" / "tiny", lambda text: text.replace("<propulsion/>", thruster))
    made = fenced(model, LIBRARY)
    assert [element.tag for element in made.root.find("propulsion/engine/thruster") or ()] == ["direct"]
    assert list(made.sources) == [str(model / "tiny.xml"), str(engines / "mine.xml")]


# In a child


def kill(number: int) -> None:
    os.kill(os.getpid(), number)


def fail() -> None:
    raise ValueError("a fault")


def take(size: int) -> int:
    return len(bytearray(size))


def spin() -> None:
    while True:
        pass


def write_to(path: Path) -> None:
    path.write_text("text", encoding="utf-8")


def fly_unfenced(model: Path) -> None:
    """What JSBSim does to the process that flies the model."""
    fdm = jsbsim.FGFDMExec(None)
    fdm.load_model_with_paths(model.name, str(model.parent), "", "", True)
    fdm.run_ic()
    fdm.run()


def test_what_a_child_returns_or_raises_is_there_and_how_it_ended_is_told(tmp_path: Path) -> None:
    assert in_child("load", max, 2, 3) == 3
    with pytest.raises(ValueError, match="a fault"):
        in_child("load", fail)
    with pytest.raises(ChildError, match="load: the process was ended by SIGSEGV"):
        in_child("load", kill, signal.SIGSEGV)
    with pytest.raises(ChildError, match="trim: needs more memory than the 100 MB that it may have"):
        limited("trim", 20.0, 100 << 20, take, 1 << 30)
    with pytest.raises(ChildError, match=r"circle: was not done in 0\.3 s"):
        limited("circle", 0.3, 1 << 30, spin)
    with pytest.raises(OSError, match="too large"):
        in_child("load", write_to, tmp_path / "file")


def wait_for(file: Path) -> bool:
    while not file.exists():
        time.sleep(0.05)
    return True


def test_a_child_does_not_wait_for_that_of_another_thread(tmp_path: Path) -> None:
    with ThreadPoolExecutor(1) as other:
        waits = other.submit(limited, "wait", 30.0, 1 << 30, wait_for, tmp_path / "file")
        assert in_child("load", max, 2, 3) == 3
        (tmp_path / "file").touch()
        assert waits.result()


WAITING = """
import sys, time
from harness.child import in_child
if __name__ == "__main__":
    in_child("load", time.sleep, 30.0)
"""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_a_child_ends_with_its_parent_and_leaves_no_file(number: signal.Signals, tmp_path: Path) -> None:
    script = write(tmp_path / "script.py", WAITING)
    (tmp_path / "temporary").mkdir()
    environment = {**os.environ, "TMPDIR": str(tmp_path / "temporary"), "PYTHONPATH": str(ROOT)}
    with subprocess.Popen([sys.executable, script], env=environment, stderr=subprocess.DEVNULL) as parent:

        def below() -> list[psutil.Process]:
            return list(psutil.Process(parent.pid).children(recursive=True))

        until(lambda: any(each.parent() in below() for each in below()))  # the child of the server
        processes = below()
        parent.send_signal(number)
    until(lambda: not any(each.is_running() and each.status() != psutil.STATUS_ZOMBIE for each in processes))
    assert list((tmp_path / "temporary").iterdir()) == []


def until(true: Callable[[], bool]) -> None:
    end = time.monotonic() + QUICK
    while not true():
        assert time.monotonic() < end
        time.sleep(0.05)


@pytest.mark.parametrize("name", ["trim", "delay"])
def test_a_model_that_ends_the_process_ends_the_child_alone(name: str, tmp_path: Path) -> None:
    """These are the faults that the fence keeps out; here nothing does."""
    model = tiny(tmp_path / "tiny", HOSTILE[name][0])
    begun = time.monotonic()
    with pytest.raises((ChildError, RuntimeError), match=r"load: |Trim|bad|alloc|length"):
        limited("load", QUICK, 1 << 30, fly_unfenced, model)
    assert time.monotonic() - begun < QUICK


def test_a_model_that_listens_is_not_reachable_once_fenced(tmp_path: Path) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    model = tiny(tmp_path / "tiny", section(f'<input port="{port}"/>'))
    (copy := tmp_path / "copy").mkdir()
    fence.fence(model, copy, LIBRARY)
    _flying = loaded(copy)
    with socket.socket() as client:
        assert client.connect_ex(("127.0.0.1", port)) != 0
