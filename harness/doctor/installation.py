"""The requirements of an installation: Python, packages in their versions, the viewer."""

import platform
import subprocess
from collections.abc import Iterator
from importlib import import_module
from importlib.metadata import PackageNotFoundError, metadata, packages_distributions, version

from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

from harness.doctor.finding import Finding, Soundness
from harness.provenance import DISTRIBUTION, requirements


def installation() -> Iterator[Finding]:
    """Whether each thing is there, in a version that serves, and can be loaded."""
    try:
        asked = SpecifierSet(str(metadata(DISTRIBUTION)["Requires-Python"]))
    except PackageNotFoundError:
        yield Finding(DISTRIBUTION, "not installed: run `pip install` on its folder or its wheel", Soundness.MISSING)
        return
    here = platform.python_version()
    serves = asked.contains(here, prereleases=True)
    yield Finding(
        "python", here if serves else f"{here}, required is {asked}", Soundness.OK if serves else Soundness.MISSING
    )
    yield Finding(DISTRIBUTION, version(DISTRIBUTION), Soundness.OK)
    modules = _modules()
    for text in requirements():
        yield _package(Requirement(text), modules)
    yield _viewer()


def _package(requirement: Requirement, modules: dict[str, list[str]]) -> Finding:
    name, asked = requirement.name, requirement.specifier
    try:
        there = version(name)
    except PackageNotFoundError:
        return Finding(name, f"not installed, required is {asked}", Soundness.MISSING)
    if not asked.contains(there, prereleases=True):
        return Finding(name, f"{there}, required is {asked}", Soundness.MISSING)
    try:
        for module in modules.get(_plain(name), ()):
            import_module(module)
    except Exception as error:  # whatever a broken package raises
        return Finding(name, f"{there} cannot be loaded: {type(error).__name__}: {error}", Soundness.MISSING)
    return Finding(name, there, Soundness.OK)


def _modules() -> dict[str, list[str]]:
    """The modules of each package."""
    modules: dict[str, list[str]] = {}
    for module, packages in packages_distributions().items():
        for package in packages:
            modules.setdefault(_plain(package), []).append(module)
    return modules


def _plain(name: str) -> str:
    return name.lower().replace("_", "-")


def _viewer() -> Finding:
    """Whether the viewer's program starts; without a display it can be had elsewhere."""
    try:
        from harness.review.viewer import RERUN, has_display, quiet

        done = subprocess.run([RERUN, "--version"], env=quiet(), capture_output=True, text=True, check=True, timeout=60)
    except (ImportError, OSError, subprocess.SubprocessError) as error:
        return Finding("viewer", f"does not start: {error}", Soundness.MISSING)
    elsewhere = "" if has_display() else "; no display here: `harness view --save` writes a file to open elsewhere"
    return Finding("viewer", " ".join(done.stdout.split()[:2]) + elsewhere, Soundness.OK)
