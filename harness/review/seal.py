"""The checksum that a recording carries of itself, so that a damaged one is not read for what was written.

The recording is made with `TEXT` as one of its texts, which holds `PLACEHOLDER`. No compression touches that, because
no part of it occurs twice: neither in the hexadecimal names that Rerun draws, nor, thanks to what is around it, with
the zeros between two texts. The checksum takes its place, and is that of the whole file with the placeholder.
"""

import hashlib
from pathlib import Path

from harness.files import read

_MARK = b"CHECKSUM:"
_NONE = b"~!@#$%^&*+=|?<>{}[]()ZXQJVKWYGRP"  # as long as a checksum, and none
PLACEHOLDER = _MARK + _NONE
TEXT = f"(-: {PLACEHOLDER.decode()} :-)"


def sealed(content: bytes) -> bytes:
    """The recording with its checksum in place of the placeholder."""
    before, placeholder, after = content.partition(PLACEHOLDER)
    assert placeholder
    return before + _MARK + _checksum(content) + after


def is_sealed(path: Path) -> bool:
    """Whether the file has a seal, which recordings of earlier versions have not.

    Raises OSError when the file cannot be read, ValueError when it is not as it was sealed.
    """
    content = read(path)
    before, mark, after = content.partition(_MARK)
    if not mark:
        return False
    found, after = after[: len(_NONE)], after[len(_NONE) :]
    if _MARK in after:
        raise ValueError(f"{path}: is several recordings in one file, must be one")
    if found != _checksum(before + PLACEHOLDER + after):
        raise ValueError(f"{path}: is damaged, or was changed by another program: its checksum is another")
    return True


def _checksum(content: bytes) -> bytes:
    return hashlib.blake2b(content, digest_size=len(_NONE) // 2).hexdigest().encode()
