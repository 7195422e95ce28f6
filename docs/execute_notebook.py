"""Executes a notebook in a new kernel, a warning being an error: `make notebook`.

The kernel runs in an empty folder, so that a notebook depends on nothing but the installed packages. Without `--out`
the notebook itself gets the new outputs.
"""

import argparse
import os
import tempfile
from pathlib import Path

import nbformat
from nbclient import NotebookClient

WARNINGS = "error,ignore:::ipykernel.kernelbase"  # the kernel's own warnings are not the notebook's


def execute(notebook: nbformat.NotebookNode, folder: Path) -> None:
    """Fills in the outputs. Raises nbclient's CellExecutionError at the first cell that fails."""
    client = NotebookClient(
        notebook,
        timeout=300,
        kernel_name="python3",
        record_timing=False,
        extra_arguments=["--log-level=CRITICAL"],  # of the kernel, which warns of its own connection
        resources={"metadata": {"path": str(folder)}},
    )
    client.execute(env={**os.environ, "PYTHONWARNINGS": WARNINGS})


def main() -> None:
    """`python docs/execute_notebook.py NOTEBOOK [--out FILE]`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("notebook", type=Path)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    notebook = nbformat.read(given.notebook, as_version=4)
    with tempfile.TemporaryDirectory() as folder:
        execute(notebook, Path(folder))
    notebook.metadata["language_info"] = {"name": "python"}  # which Python it was says nothing
    nbformat.validate(notebook)
    nbformat.write(notebook, given.out or given.notebook)


if __name__ == "__main__":
    main()
