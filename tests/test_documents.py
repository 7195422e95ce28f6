"""The documents: the site builds, pages written from the code are current, and every command in README and guide runs.

A fenced block of a page is tested by its language. `sh`: a script that must succeed. `console`: the same with `$`
before each command; the lines between are output that must appear, `...` stands for any. `python`: run with the page's
earlier ones before it. `diff`: applied. `toml`: must parse. `text`: not run. A comment right before a block changes
this for the test alone: `save as: PATH` writes the block to a file, `tested as: COMMAND` runs that instead.
"""

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import NamedTuple

import pytest

from docs.write_reference import FOLDER, pages
from harness import __all__ as public_names
from harness.cli.main import harness, load
from harness.log import COLUMNS

ROOT = Path(__file__).parent.parent
RUN = [ROOT / "README.md", *sorted((ROOT / "docs" / "guide").glob("*.md"))]
ALL = sorted({*RUN, ROOT / "CONTRIBUTING.md", *(ROOT / "docs").rglob("*.md")})
BLOCK = re.compile(
    r"(?:<!-- (?P<how>tested as|save as): (?P<what>.*?) -->\n+)?^```(?P<language>[\w{}]*)\n(?P<text>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)


IN_ONE_PROCESS = 'harness() { [ "$1" != run ] || set -- "$@" --workers 0; command harness "$@"; }\n'  # no pool to start


class Block(NamedTuple):
    """A fenced block."""

    language: str
    text: str
    how: str | None  # the comment before it, and what it says
    what: str


def blocks(page: Path) -> list[Block]:
    text = page.read_text(encoding="utf-8")
    assert text.count("\n```") == 2 * len(list(BLOCK.finditer(text))), f"{page}: a fence without its partner"
    return [Block(m["language"], m["text"], m["how"], m["what"] or "") for m in BLOCK.finditer(text)]


def name(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, as `make docs` builds it."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "--quiet", "--fail-on-warning", "--keep-going"]
    built = subprocess.run(
        [*command, "--doctree-dir", folder / "doctrees", "docs", folder / "html"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert built.returncode == 0, built.stderr
    return folder / "html"


def test_the_site_builds_without_a_warning_and_loads_nothing_from_the_network(site: Path) -> None:
    pages_built = list(site.rglob("*.html"))
    assert len(pages_built) > 20
    loaded = re.compile(
        r"<(?:script|img|iframe|source)[^>]*\ssrc=\"(?:https?:)?//|<link[^>]*rel=\"stylesheet\"[^>]*href=\"(?:https?:)?//"
    )
    assert [page.name for page in pages_built if loaded.search(page.read_text(encoding="utf-8"))] == []
    styles = "".join(path.read_text(encoding="utf-8") for path in site.rglob("*.css"))
    assert not re.search(r"@import|url\([\"']?https?:", styles)


@pytest.mark.parametrize("page", sorted(pages()))
def test_pages_written_from_the_code_are_current(page: str) -> None:
    assert (FOLDER / page).read_text(encoding="utf-8") == pages()[page], "run `python -m docs.write_reference`"


@pytest.mark.parametrize("page", RUN, ids=name)
def test_every_command_of_the_page_runs(page: Path, tmp_path: Path) -> None:
    for part in ("autopilot", "aircraft", "harness", "experiments", "Makefile", "pyproject.toml", "requirements.lock"):
        if (ROOT / part).is_dir():
            shutil.copytree(ROOT / part, tmp_path / part)
        else:
            shutil.copy(ROOT / part, tmp_path / part)
    programs = []
    for block in blocks(page):
        if block.how == "save as":
            path = tmp_path / block.what
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(block.text, encoding="utf-8")
        elif block.how == "tested as":
            run(block.what, tmp_path)
        elif block.language == "sh":
            run(block.text, tmp_path)
        elif block.language == "console":
            follow(block.text, tmp_path)
        elif block.language == "python":
            programs.append(block.text)
            run(f"{sys.executable} - <<'PROGRAM'\n{''.join(programs)}\nPROGRAM", tmp_path)
        elif block.language == "diff":
            (tmp_path / "change.diff").write_text(block.text, encoding="utf-8")
            run("git apply --recount change.diff", tmp_path)
        elif block.language == "toml":
            tomllib.loads(block.text)
        else:
            assert block.language in ("text", "{toctree}"), f"{page}: a block without a language"


def run(script: str, folder: Path) -> str:
    """Runs a script as a reader would who has activated the environment; gives its output."""
    environment = {
        **os.environ,
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(folder),
        "COLUMNS": "120",
        "CI": "1",
    }
    ran = subprocess.run(
        ["bash", "-euc", IN_ONE_PROCESS + script],
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, f"{script}\n{ran.stdout}"
    return ran.stdout


def follow(session: str, folder: Path) -> None:
    """Runs the commands of a session, and looks for the lines shown after each in what it prints."""
    for step in re.split(r"^\$ ", session, flags=re.M)[1:]:
        command, *shown = step.splitlines()
        printed = [" ".join(line.split()) for line in run(command, folder).splitlines()]
        for line in shown:
            if line and line.strip() != "...":
                assert " ".join(line.split()) in printed, f"$ {command}\n{line}\nis not in\n" + "\n".join(printed)


@pytest.mark.parametrize("page", ALL, ids=name)
def test_every_command_and_option_that_a_page_names_exists(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    for called in re.findall(r"(?:`|^\$ |^|/)harness ([a-z]+)\b([^`\n]*)", text, flags=re.M):
        assert called[0] in harness.commands, f"{page}: there is no `harness {called[0]}`"
        options = {option for parameter in load(called[0]).params for option in parameter.opts} | {"--help"}
        assert set(re.findall(r"(?<!\S)--[a-z-]+", called[1].partition("#")[0])) <= options, f"{page}: harness {called}"


def test_every_column_of_a_log_is_explained() -> None:
    explained = set(re.findall(r"`(\w+)`", (FOLDER / "files.md").read_text(encoding="utf-8")))
    assert set(COLUMNS) <= explained


def test_every_public_name_is_in_the_python_reference() -> None:
    named = re.findall(r"auto\w+:: (\w+)$", (FOLDER / "python.md").read_text(encoding="utf-8"), re.M)
    assert sorted(named) == sorted(["harness", *public_names])


def test_the_layers_in_the_text_are_those_that_the_linter_holds() -> None:
    rows = re.findall(r"^\| (\d+) \| ([^|]*) \|", (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8"), re.M)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    (layers,) = (c["layers"] for c in project["tool"]["importlinter"]["contracts"] if c["type"] == "layers")
    assert [int(floor) for floor, _ in rows] == list(range(len(layers), 0, -1))
    assert [re.findall(r"`(\w+)`", rooms) for _, rooms in rows] == [re.findall(r"\w+", layer) for layer in layers]


def test_readme_fits_two_screens() -> None:
    lines = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()
    assert len(lines) <= 90
    assert max(len(line) for line in lines if "](" not in line) <= 120
