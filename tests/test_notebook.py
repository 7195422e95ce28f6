"""The notebook of the guide: executed in a new kernel, a warning being an error, it says what it says in the file."""

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.builders import DOCS, ROOT

NOTEBOOK = DOCS / "guide" / "notebook.ipynb"


def code_cells(path: Path) -> Iterator[tuple[str, list[dict[str, Any]]]]:
    """The source and the outputs of each cell of code."""
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        if cell["cell_type"] == "code":
            yield "".join(cell["source"]), cell["outputs"]


def texts(path: Path) -> list[tuple[str, str]]:
    """What each cell printed and returned, as text, beside its source; a picture by its size in pixels."""
    return [
        (source, "".join("".join(o["text"] if "text" in o else o["data"]["text/plain"]) for o in outputs))
        for source, outputs in code_cells(path)
    ]


@pytest.fixture(scope="module")
def executed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("notebook") / "notebook.ipynb"
    command = [sys.executable, str(DOCS / "execute_notebook.py"), str(NOTEBOOK), "--out", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return out


def test_the_stored_outputs_are_those_of_a_new_execution(executed: Path) -> None:
    assert texts(executed) == texts(NOTEBOOK), "execute it anew: make notebook"


def test_it_flies_compares_plots_and_shows_a_digest() -> None:
    sources, shown = zip(*texts(NOTEBOOK), strict=True)
    for name in ("Flight", "law", "simulate", "run", "compare", "record", "read_flight"):
        assert f"harness.{name}(" in "\n".join(sources)
    assert len(re.findall(r"^[0-9a-f]{32}$", "\n".join(shown), re.MULTILINE)) == 1
    kinds = {kind for _, outputs in code_cells(NOTEBOOK) for output in outputs for kind in output.get("data", {})}
    assert kinds == {"image/png", "text/html", "text/plain"}


def test_it_is_small_and_shows_neither_an_error_nor_a_warning() -> None:
    assert NOTEBOOK.stat().st_size < 400_000
    outputs = [output for _, several in code_cells(NOTEBOOK) for output in several]
    assert {output["output_type"] for output in outputs} == {"execute_result", "stream"}
    assert {output.get("name", "stdout") for output in outputs} == {"stdout"}  # nothing on standard error
