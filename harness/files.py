"""Reading files that have an end, writing them completely or not at all, their names as text, and a content's hash."""

import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from errno import EINVAL, ENOENT
from pathlib import Path


def read(path: Path) -> bytes:
    """The content of a file. Raises OSError, also for a pipe or a device: reading that may never end."""
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise OSError(EINVAL, "is a pipe or a device, must be a file", str(path))
    return path.read_bytes()


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yields a temporary path to write to, and moves that to `path` at the end. Raises OSError that names `path`."""
    partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        yield partial
        partial.replace(path)
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(path)) from None
    finally:
        partial.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Writes the file with this text, in UTF-8. Raises OSError that names `path`."""
    with replacing(path) as partial:
        partial.write_text(as_text(text), encoding="utf-8")


def make_folder(path: Path) -> None:
    """Makes the folder, and those above it, where there is none. Raises OSError."""
    for link in (path, *path.parents):
        if link.is_symlink() and not link.exists():
            why = f"the link {link} leads to {link.readlink()}, which does not exist"
            raise FileNotFoundError(ENOENT, why, str(path))
    path.mkdir(parents=True, exist_ok=True)


def file_name(text: str) -> str:
    """The name that a text in UTF-8, such as a settings file, means, as this process knows names in its locale."""
    return os.fsdecode(text.encode("utf-8", "surrogateescape"))


def as_text(text: str) -> str:
    r"""The text with every file name in it as Unicode, bytes that are not text as `\xff`.

    Python keeps bytes of a name that it cannot decode as lone surrogates, which no file, table or database accepts.
    """
    return text.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")


def is_text(path: Path) -> bool:
    """Whether the name is Unicode, according to the locale."""
    return as_text(str(path)) == str(path)


def content_hash(content: bytes) -> str:
    """A hash, 32 hex digits, of the content of a file."""
    return hashlib.blake2b(content, digest_size=16).hexdigest()
