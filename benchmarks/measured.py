"""A block of a page that a benchmark writes: between `<!-- measured by NAME -->` and `<!-- /measured -->`."""

import os
import re
from pathlib import Path

from harness.files import write_text


def busy() -> str:
    """How much the machine does beside the benchmark: to be asked before it begins."""
    return f"load {os.getloadavg()[0]:.1f} by other processes"


def keep(page: Path, name: str, block: str) -> None:
    """Puts the block into the page in place of the one that the benchmark wrote before."""
    pattern = re.compile(rf"(<!-- measured by {re.escape(name)} -->\n).*?(<!-- /measured -->)", re.DOTALL)
    text, found = pattern.subn(lambda marks: f"{marks[1]}{block}{marks[2]}", page.read_text(encoding="utf-8"))
    assert found == 1, f"{page} has {found} blocks of {name}"
    write_text(page, text)
