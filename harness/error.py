"""The errors that a user can make: all have one base, and each message says what is wrong and what is allowed."""

from collections.abc import Sequence


class HarnessError(Exception):
    """The base of the harness's errors: what was given cannot be used."""


class SettingsError(HarnessError, ValueError):
    """What is wrong with the settings, one line for each mistake: `lines`."""

    def __init__(self, lines: Sequence[str]) -> None:
        super().__init__("\n".join(lines))
        self.lines = list(lines)
