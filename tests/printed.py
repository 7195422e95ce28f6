"""What Chromium prints of a page: the texts on each sheet, read from its PDF."""

import re
import subprocess
import zlib
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tests.builders import chromium

_TOKEN = re.compile(r"<[0-9A-Fa-f]*>|\((?:\\.|[^\\)])*\)|[\[\]]|/?[^\s<>()\[\]]+")


class Text(NamedTuple):
    """A piece of text on a sheet."""

    at: float  # from the top of the sheet, as a share of its height
    size: float  # points


def sheets(page: Path, folder: Path) -> list[list[Text]]:
    """The texts of each printed sheet, from the top."""
    pdf = folder / "page.pdf"
    subprocess.run(
        [
            chromium(), "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={folder / 'profile'}",
            "--no-first-run", "--disable-background-networking", "--no-pdf-header-footer", f"--print-to-pdf={pdf}",
            page.as_uri(),
        ],
        capture_output=True, check=True, timeout=120,
    )  # fmt: skip
    objects = dict(re.findall(rb"(?:^|\n)(\d+) 0 obj\n(.*?)\nendobj", pdf.read_bytes(), re.DOTALL))
    found = []
    for body in objects.values():
        content = re.search(rb"/Type /Page\b.*/Contents (\d+) 0 R", body, re.DOTALL)
        box = re.search(rb"/MediaBox \[\S+ \S+ \S+ (\S+)\]", body)
        if content and box:
            stream = re.search(rb"stream\r?\n(.*)\nendstream", objects[content[1]], re.DOTALL)
            assert stream
            found.append(sorted(_texts(zlib.decompress(stream[1]).decode("latin-1"), float(box[1]))))
    return found


def _texts(stream: str, height: float) -> list[Text]:
    """The texts of a content stream, by its operators q, Q, cm, Tf and Tm."""
    matrix, kept, numbers, size, texts = np.eye(3), [], [], 0.0, []
    for token in _TOKEN.findall(stream):
        if re.fullmatch(r"[-+.\d]+", token):
            numbers.append(float(token))
            continue
        if token == "q":
            kept.append(matrix)
        elif token == "Q":
            matrix = kept.pop()
        elif token == "cm":
            matrix = _matrix(numbers) @ matrix
        elif token == "Tf":
            size = numbers[-1]
        elif token == "Tm":
            placed = _matrix(numbers) @ matrix
            texts.append(Text(1.0 - placed[2, 1] / height, abs(placed[1, 1]) * size))
        if not token.startswith("/"):  # a name, such as that of the font before its size
            numbers = []
    return texts


def _matrix(numbers: list[float]) -> "np.ndarray[tuple[int, ...], np.dtype[np.float64]]":
    a, b, c, d, e, f = numbers[-6:]
    return np.array([(a, b, 0.0), (c, d, 0.0), (e, f, 1.0)])
