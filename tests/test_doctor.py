"""The doctor: what is missing of an installation, and what moves the bits of a flight."""

import os
import platform
import re
import subprocess
from collections.abc import Mapping
from pathlib import Path

import pytest

from harness.provenance import packages
from tests.builders import words_of, write


def doctor(environment: Mapping[str, str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        words_of("doctor"), capture_output=True, text=True, check=False, timeout=300, env={**os.environ, **environment}
    )


def test_this_installation_is_sound_and_every_package_that_it_needs_is_listed() -> None:
    done = doctor({})
    assert done.returncode == 0, done.stdout
    assert done.stdout.splitlines()[-1] == "sound"
    for name, version in packages().items():
        assert re.search(f"^ok  {name} +{re.escape(version)}$", done.stdout, re.MULTILINE), name
    assert re.search("^ok  viewer +rerun-cli ", done.stdout, re.MULTILINE)


def test_a_package_that_cannot_be_loaded_or_is_too_old_is_missing_and_hides_nothing_else(tmp_path: Path) -> None:
    write(tmp_path / "pebble.py", "raise ImportError('libpebble.so: cannot open shared object file')")
    (tmp_path / "filterpy-1.4.dist-info").mkdir()
    write(tmp_path / "filterpy-1.4.dist-info" / "METADATA", "Metadata-Version: 2.1\nName: filterpy\nVersion: 1.4\n")
    done = doctor({"PYTHONPATH": f"{tmp_path}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"})
    assert done.returncode == 1
    missing = [line.split(maxsplit=2)[1:] for line in done.stdout.splitlines() if line.startswith("MISSING")]
    assert ["filterpy", "1.4, required is >=2.0"] in missing
    (why,) = (text for name, text in missing if name == "pebble")
    assert why.endswith("cannot be loaded: ImportError: libpebble.so: cannot open shared object file")
    assert "stored flights" in done.stdout
    assert done.stdout.splitlines()[-1] == "INCOMPLETE: install what is missing"


@pytest.mark.skipif(
    (platform.machine(), platform.libc_ver()[0]) != ("x86_64", "glibc"),
    reason="GLIBC_TUNABLES hides AVX and FMA from glibc on x86_64 alone",
)
def test_on_another_processor_it_says_by_how_much_flights_move_and_that_it_is_the_processor() -> None:
    """One without fused multiplication and addition, as far as the C library goes."""
    done = doctor({"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX"})
    assert done.returncode == 0, done.stdout
    (line,) = (line for line in done.stdout.splitlines() if "stored flights" in line)
    assert (found := re.search(r"(\d+) of 30 moved, at most by (\S+) m in \w+, 1e-05 allowed", line)), line
    assert int(found[1]) > 0
    assert 0.0 < float(found[2]) < 1e-5
    assert re.search("^ok  not as stored +processor x86_64 .* there, x86_64 .* here$", done.stdout, re.MULTILINE)
