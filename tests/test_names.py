"""Names of files, folders and texts: whatever characters they are made of, and whatever else has the same name."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from markdown_it import MarkdownIt
from markdown_it.token import Token

from harness.markup import code, latex, markdown
from harness.plants.model import ModelError, load
from harness.settings import load_flight
from tests.builders import copied_airframe, invoke, write

ONE = """\
title = "a_b *c* #1 <d> ~e^ {f} | `g`"
question = "# Does it?"
[flight]
duration_s = 1.0
[flight.law]
name = "smc"
[matrix]
plant = ["kinematic", "lagged"]
"""
IN_TURN = """
import sys
from pathlib import Path
from harness.cli.main import main
out, *words = sys.argv[1:]
for call in "\\n".join(words).split("\\nthen\\n"):
    for flight in Path(out).glob("flights/*"):
        call = call.replace("KEY", flight.stem)
    sys.argv[1:] = call.split("\\n")
    try:
        main()
    except SystemExit as end:
        if end.code:
            sys.exit(f"{sys.argv} ended with {end.code}")
"""
ASCII = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}


@pytest.mark.parametrize("package", ["aircraft", "autopilot"])
def test_a_users_file_with_the_name_of_a_package_of_the_harness_is_told(tmp_path: Path, package: str) -> None:
    own = write(tmp_path / f"{package}.py", "mine = 1\n")
    script = write(tmp_path / "script.py", "import harness\nharness.law('smc')\n")
    told = f"{own}: stands in the way of the harness's own package {package}: rename it, or start in another folder"
    for words, last in ((["-m", "harness", "list", "laws"], told), ([str(script)], f"ImportError: {told}")):
        done = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=False, cwd=tmp_path)
        assert done.stderr.splitlines()[-1] == last
        assert (done.returncode == 2) == (last == told)


@pytest.mark.parametrize(("name", "locale"), [(b"run:1", {}), (b"a \xff\xfe", {}), ("ünï".encode(), ASCII)])
def test_a_run_may_have_any_name(tmp_path: Path, name: bytes, locale: dict[str, str]) -> None:
    out = os.fsdecode(name)
    file = write(tmp_path / f"of {out}", ONE).name
    calls = (
        ["run", file, "--out", out, "--workers", "0"], ["show", out], ["show", f"{out}:KEY"], ["compare", out],
        ["report", out], ["report", out, "--markdown", f"{out}/{out}"], ["fly", f"{out}:KEY", "--rrd", f"{out}.rrd"],
        ["export", f"{out}.rrd", "--to", "csv", "--out", f"{out}/1:1"], ["export", f"{out}:KEY", "--to", "parquet"],
        ["view", f"{out}:KEY", "--save", f"{out}.rrd"],
    )  # fmt: skip
    words = [word for call in calls for word in ("then", *call)][1:]
    done = subprocess.run(
        [sys.executable, "-c", IN_TURN, out, *words],
        capture_output=True, check=False, cwd=tmp_path, env={**os.environ, **locale},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert b"results in " + name in done.stdout
    assert {"report.html", out, "1:1"} < {path.name for path in (tmp_path / out).iterdir()}


def test_jsbsim_needs_an_airframe_whose_name_is_text(tmp_path: Path) -> None:
    folder = tmp_path / os.fsdecode(b"\xff")
    folder.mkdir()
    with pytest.raises(ModelError, match="not text in UTF-8, which JSBSim needs"):
        load(copied_airframe("aerosonde", folder / "mine"), step=0.005)


def test_an_airframe_beside_the_file_has_its_own_airspeed_wherever_the_command_is_started(tmp_path: Path) -> None:
    copied_airframe("aerosonde", tmp_path / "mine")
    text = '[flight]\nplant = "kinematic"\naircraft = "mine"\n[flight.law]\nname = "smc"\n'
    assert load_flight(write(tmp_path / "a.toml", text)).start.airspeed == 25.0


@pytest.mark.parametrize(
    "words",
    [["run", "a.toml", "--out", ""], ["compare", ""], ["show", ""], ["fly", ""], ["identify", "x", "--out", ""]],
)
def test_an_empty_name_is_refused(words: list[str]) -> None:
    done = invoke(*words)
    assert done.exit_code == 2
    assert "is empty, must name a file or a folder" in done.stderr


def test_a_link_that_leads_nowhere_is_told(tmp_path: Path) -> None:
    file, link = write(tmp_path / "a.toml", ONE), tmp_path / "link"
    link.symlink_to("nowhere")
    for out in (link, link / "inside"):
        done = invoke("run", file, "--out", out, "--workers", 0)
        assert done.exit_code == 2
        assert done.stderr == f"{out}: cannot be written to: the link {link} leads to nowhere, which does not exist\n"


# Text in documents

TEXT = st.text("ab 12_*`[](){}<>#~^|\\$&-+=.!:\"'ä\n", min_size=1).filter(str.strip)


def shown(document: str) -> str:
    """What Markdown shows of a document of one paragraph."""
    tokens = MarkdownIt("gfm-like", {"linkify": False}).parse(document)
    assert [token.type for token in tokens] == ["paragraph_open", "inline", "paragraph_close"]
    return "".join(map(_content, tokens[1].children or []))


def _content(token: Token) -> str:
    assert token.type in ("text", "text_special", "code_inline")
    return token.content


@given(TEXT)
def test_markdown_shows_a_text_as_it_is(text: str) -> None:
    assert shown(markdown(text)) == shown(code(text)) == " ".join(text.split())


def test_latex_shows_a_text_as_it_is() -> None:
    escapes = {r"\textbackslash{}": "\\", r"\textasciitilde{}": "~", r"\textasciicircum{}": "^", r"\textless{}": "<",
               r"\textgreater{}": ">", r"\textbar{}": "|", **{f"\\{mark}": mark for mark in "_%&#${}"}}  # fmt: skip
    text = "".join(map(chr, range(32, 127)))
    escaped = latex(text)
    assert "".join(latex(mark) for mark in text) == escaped.replace(" ", "")
    assert {latex(mark): mark for mark in text if latex(mark) != mark and mark != " "} == escapes


def test_a_report_shows_title_question_and_paths_as_they_are(tmp_path: Path) -> None:
    airframe = copied_airframe("aerosonde", tmp_path / "my_#1 ~^ {x} <b> | c")
    named = write(tmp_path / "a.toml", ONE.replace("[flight]", f'[flight]\naircraft = "{airframe}"'))
    assert invoke("run", named, "--out", tmp_path / "out", "--workers", 0, "--log", "none").exit_code == 0
    path = tmp_path / "report.md"
    assert invoke("report", tmp_path / "out", "--markdown", path).exit_code == 0
    title, question, *_ = path.read_text().split("\n\n")
    assert shown(title.removeprefix("# ")) == "a_b *c* #1 <d> ~e^ {f} | `g`"
    assert shown(question) == "# Does it?"
    assert f"| {markdown(str(airframe))} |" in path.read_text()
    shutil.rmtree(airframe)
    assert latex(f"{airframe}, plant = lagged") in invoke("compare", tmp_path / "out", "--latex").stdout
