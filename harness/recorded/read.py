"""Reads a recorded flight, whichever format its log has."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from harness.recorded import dataflash, ulog
from harness.recorded.csv_log import read_csv
from harness.recorded.frames import with_derived
from harness.recorded.plausible import plausible
from harness.recorded.recorded_flight import LogError, RecordedFlight

SUFFIXES = (".ulg", ".bin", ".csv")


def read_log(paths: Sequence[Path], map_name: str | None = None) -> RecordedFlight:
    """The flight of one ULog or DataFlash file, or of one or several CSV files; a folder stands for the logs in it.

    `map_name` names the map of CSV files, a TOML file or a shipped one. Raises `LogError`, also where units look wrong.
    """
    files = list(dict.fromkeys(file for path in paths for file in _files(path)))
    kinds = [_magic(path) for path in files]
    binary = [path for path, kind in zip(files, kinds, strict=True) if kind]
    if binary and len(files) > 1:
        raise LogError(f"{binary[0]}: is a whole flight, must be given alone; only CSV files are read together")
    if binary and map_name:
        raise LogError(f"{binary[0]}: describes itself; --map is for CSV files")
    try:
        with np.errstate(all="ignore"):  # of damaged numbers, which are then left out
            flight = _read(files, kinds, map_name)
    except MemoryError:
        raise LogError(f"{files[0]}: takes more memory than there is") from None
    return plausible(with_derived(flight))


def _read(files: Sequence[Path], kinds: Sequence[bytes], map_name: str | None) -> RecordedFlight:
    if kinds[0] == ulog.MAGIC:
        return ulog.read_ulog(files[0])
    return dataflash.read_dataflash(files[0]) if kinds[0] else read_csv(files, map_name)


def _files(path: Path) -> Iterator[Path]:
    if path.is_dir():
        found = sorted(one for one in path.iterdir() if one.suffix.lower() in SUFFIXES and one.is_file())
        if not found:
            raise LogError(f"{path}: holds no file that ends in {', '.join(SUFFIXES)}")
        yield from found
    elif not path.exists():
        raise LogError(f"{path}: no such file or folder")
    elif not path.is_file():
        raise LogError(f"{path}: is a pipe or a device, must be a file")
    else:
        yield path


def _magic(path: Path) -> bytes:
    """The first bytes of a ULog or DataFlash file; nothing of another. Raises `LogError`."""
    try:
        with path.open("rb") as file:
            begin = file.read(len(ulog.MAGIC))
    except OSError as error:
        raise LogError(f"{path}: {error.strerror}") from None
    return next((magic for magic in (ulog.MAGIC, dataflash.MAGIC) if begin.startswith(magic)), b"")
