"""The examination of an installation, part by part: what is missing must not hide what is there."""

from collections.abc import Iterator

from harness.doctor.finding import Finding, Soundness
from harness.doctor.installation import installation


def examine() -> Iterator[Finding]:
    """Runs all checks, one at a time."""
    yield from installation()
    try:
        from harness.doctor.self_tests import self_tests
        from harness.doctor.stored_flights import compared
    except (ImportError, OSError) as error:  # JSBSim raises the second where its data are missing
        yield Finding("flights", f"none can be flown here: {error}", Soundness.MISSING)
        return
    yield from self_tests()
    yield from compared()
